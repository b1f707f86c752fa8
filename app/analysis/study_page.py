"""``docs/simulated-study.md``: the paper's user study with simulated people, beside its claims.

No number on the page is typed by hand, and every verdict follows from the exports.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app import texts
from app.analysis import study_values as values
from app.analysis.comparisons import TEST, Comparison, Values
from app.analysis.pictures import save_figure
from app.analysis.simulation_claims import Count, count
from app.analysis.simulation_rows import write_file
from app.analysis.study_export import StudyExport
from app.analysis.study_figures import comparisons, pictures
from app.analysis.study_report import comparisons_table

OURS = "all-priors"
_BASELINES = ("no-align", "no-priors")
_HARDEST = "fetch-and-pour"


@dataclass(frozen=True)
class Studies:
    """The studies that the page is made from.

    Attributes:
        first: With the people that the driver was looked at with.
        held_out: With people nobody had seen.
        same: In which everybody secretly drove under one strategy.
    """

    first: StudyExport
    held_out: StudyExport
    same: StudyExport


@dataclass(frozen=True)
class Claim:
    """Something that the paper says of its study.

    Attributes:
        says: In our words.
        holds: In how many cases it does in a study.
        why: What to know of it.
    """

    says: str
    holds: Callable[[StudyExport, Sequence[Comparison]], Count]
    why: str


def write_study_page(studies: Studies, page: Path, images: Path) -> None:
    """Write the page and its pictures; folders are made where they are not there."""
    for folder in (page.parent, images):
        folder.mkdir(parents=True, exist_ok=True)
    shown = []
    for picture in pictures(studies.held_out, comparisons(studies.held_out, OURS)):
        name = f"simulated-study-{picture.name}"
        save_figure(picture.figure, images / name, ["png"])
        address = Path(os.path.relpath(images, page.parent)).as_posix()
        shown.append(f"![{picture.title}]({address}/{name}.png)\n\n{picture.says}\n")
    write_file(page, page_text(studies, shown))


def page_text(studies: Studies, shown: Sequence[str]) -> str:
    """The page, with these pictures of the held-out study."""
    found = comparisons(studies.held_out, OURS)
    people = {name: len(export.tables["participants"]) for name, export in vars(studies).items()}
    return "\n".join(
        [
            "# The paper's user study, with simulated people\n",
            f"{people['held_out']} simulated people take part in the paper's study, through the "
            "doors that a browser has: they consent, answer questions by an idea of the stick of "
            "their own, wait for the training, drive each task under each strategy in an order of "
            "a Williams square, never hearing which it is, and say what they felt "
            "([app/bots](../app/bots)). `make simulated-study` makes this page anew.\n",
            "They are no people: what holds here is what follows from the learning and from a "
            "model of a driver, who sees what was so a fifth of a second ago and forecasts the "
            "rest, trembles, takes back what leads nowhere and tries something else, and never "
            "gets used to a strange stick. They give up after a minute; a try that came to "
            "nothing counts with the two minutes that there were.\n",
            "## What the paper says, and what came of it\n",
            f"Tests: {TEST}; “{texts.STRATEGIES[OURS]}” against each of the two others, as the "
            "paper's hypothesis has it, corrected over three tasks and two pairs for each "
            "measure. The first study's people were looked at while the driver was made; the "
            "second one's were not.\n",
            _claims(studies),
            "## The figures\n\nOf the held-out study.\n",
            _means(studies.held_out),
            *shown,
            "## Every comparison of the held-out study\n",
            comparisons_table(found),
            "The effect is the matched-pairs rank-biserial correlation; brackets hold 95 % "
            "bootstrap intervals over people.\n",
            "## Can it say no?\n",
            _no(studies.same),
        ]
    )


def _claims(studies: Studies) -> str:
    lines = [
        "| the paper | first people | held-out people | |",
        "|---|---|---|---|",
    ]
    compared = [(export, comparisons(export, OURS)) for export in (studies.first, studies.held_out)]
    for claim in CLAIMS:
        verdicts = [claim.holds(export, found) for export, found in compared]
        lines.append(f"| {claim.says} | {' | '.join(map(_verdict, verdicts))} | {claim.why} |")
    return "\n".join(lines) + "\n"


def _verdict(found: Count) -> str:
    is_mixed = 0 < found.held < found.cases
    return found.verdict if is_mixed else f"{found.verdict} ({found.held} of {found.cases})"


def _means(export: StudyExport) -> str:
    lines = [
        "| task | strategy | achieved | time [s] | path [m] | undo [%] |",
        "|---|---|---:|---:|---:|---:|",
    ]
    measured = [values.objective(export, measure) for measure in values.OBJECTIVE]
    for task, strategies in values.successes(export).items():
        for strategy, (made, tries) in strategies.items():
            cells = []
            for tasks in measured:
                mean, deviation = values.mean_of(tasks[task][strategy])
                cells.append(f"{mean:.1f} ± {deviation:.1f}")
            lines.append(
                f"| {texts.title_of(task)} | `{strategy}` | {made} of {tries} "
                f"| {' | '.join(cells)} |"
            )
    return "\n".join(lines) + "\n"


def _no(same: StudyExport) -> str:
    found = [each for each in comparisons(same) if not np.isnan(each.p)]
    objective = {measure.name for measure in values.OBJECTIVE}
    driven = [each for each in found if each.measure in objective]
    lowest = min((each.p_holm for each in driven), default=float("nan"))
    wrong = [each for each in found if each.is_significant]
    verdict = (
        "none finds a difference"
        if not wrong
        else f"{len(wrong)} find a difference that is not there"
    )
    return (
        f"In a third study every strategy was secretly the same (`--same {OURS}`): of "
        f"{len(found)} comparisons of all pairs, {len(driven)} of them of drives, {verdict} "
        f"(the lowest corrected p of a drive's measure is {lowest:.2f}).\n"
    )


def _best_mean(export: StudyExport, _found: Sequence[Comparison]) -> Count:
    return _over_cases(export, lambda people: values.mean_of(people)[0])


def _least_spread(export: StudyExport, _found: Sequence[Comparison]) -> Count:
    return _over_cases(export, lambda people: values.mean_of(people)[1])


def _over_cases(export: StudyExport, of: Callable[[Mapping[str, float]], float]) -> Count:
    """In how many tasks and measures our strategy has the least of something."""
    cases = [
        strategies
        for measure in values.OBJECTIVE
        for strategies in values.objective(export, measure).values()
    ]
    return count([_is_least(strategies, of) for strategies in cases])


def _is_least(strategies: Values, of: Callable[[Mapping[str, float]], float]) -> bool:
    return all(of(strategies[OURS]) < of(strategies[other]) for other in _BASELINES)


def _significant(measure: str) -> Callable[[StudyExport, Sequence[Comparison]], Count]:
    """In how many tasks and pairs our strategy has significantly less of a measure."""

    def holds(_export: StudyExport, found: Sequence[Comparison]) -> Count:
        return count([_is_better(each) for each in found if each.measure == measure])

    return holds


def _is_better(each: Comparison) -> bool:
    less = each.first == OURS and each.difference.value < 0.0
    more = each.second == OURS and each.difference.value > 0.0
    return each.is_significant and (less or more)


def _rated_higher(_export: StudyExport, found: Sequence[Comparison]) -> Count:
    objective = {measure.name for measure in values.OBJECTIVE}
    said = [each for each in found if each.measure not in objective]
    higher = [
        each.is_significant and (each.difference.value > 0.0) == (each.first == OURS)
        for each in said
    ]
    return count(higher)


def _chosen(export: StudyExport, _found: Sequence[Comparison]) -> Count:
    times = values.chosen(export)
    return Count(times.get(OURS, 0), sum(times.values()))


def _falls_behind(export: StudyExport, _found: Sequence[Comparison]) -> Count:
    """Whether without priors most time is lost, against ours, in the hardest task."""
    behind = {
        task: values.mean_of(strategies["no-priors"])[0] / values.mean_of(strategies[OURS])[0]
        for task, strategies in values.objective(export, values.OBJECTIVE[0]).items()
    }
    return count([max(behind, key=behind.__getitem__) == _HARDEST])


def _evenly(export: StudyExport, _found: Sequence[Comparison]) -> Count:
    """Whether the stick's directions were used most evenly under ours while going round."""
    rows = [row for row in values.tries(export) if row["task"] == "avoid"]
    even = {
        strategy: np.mean([row["evenness"] for row in rows if row["strategy"] == strategy])
        for strategy in (OURS, *_BASELINES)
    }
    return count([bool(even[OURS] > even[other]) for other in _BASELINES])


CLAIMS = (
    Claim(
        "all priors does best on average: time, path, undo",
        _best_mean,
        "nine cases: three tasks, three measures",
    ),
    Claim(
        "… and with the least variance",
        _least_spread,
        "whoever fails has the two minutes, so a strategy under which all fail varies little",
    ),
    Claim(
        "… significantly in time",
        _significant("completion_time_s"),
        "six cases: three tasks, two others",
    ),
    Claim(
        "… significantly in undo",
        _significant("undo_share"),
        "six cases: three tasks, two others",
    ),
    Claim(
        "… and in path length",
        _significant("path_length_m"),
        "who is stuck at an edge goes no long way",
    ),
    Claim(
        "people rate it higher, item by item",
        _rated_higher,
        "what simulated people say follows from how often the hand surprised them",
    ),
    Claim("… and would choose it", _chosen, "after each task"),
    Claim(
        "without priors, the hardest task is where one falls behind most",
        _falls_behind,
        "the paper's *Reach & Pour*; it is also the task with the most answers, 30",
    ),
    Claim(
        "with all priors the stick is used evenly round *Avoid*",
        _evenly,
        "evenness of the stick's eight directions; simulated people do not fall back to the "
        "four cardinal ones, they try directions at random",
    ),
)
