"""What a study showed, as files: a table of means, one of comparisons, the pictures, and words."""

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app import texts
from app.analysis import study_values as values
from app.analysis.comparisons import LEVEL, TEST, Comparison, friedman
from app.analysis.pictures import save_figure
from app.analysis.simulation_rows import write_file
from app.analysis.study_export import StudyExport
from app.analysis.study_figures import comparisons, pictures
from models.tasks import TASKS

INDEX = "figures.json"
_ENDINGS = ("png", "svg")


@dataclass(frozen=True)
class Report:
    """What was written of a study.

    Attributes:
        files: Their names.
        findings: A sentence for each pair of strategies that differs.
    """

    files: tuple[str, ...]
    findings: tuple[str, ...]


def write_report(
    export: StudyExport,
    out: Path,
    about: str | None = None,
    note: Callable[[float], None] = lambda _done: None,
) -> Report:
    """Write everything into a folder, which is made.

    Args:
        export: The study's.
        out: The folder.
        about: Compare others with this strategy only.
        note: Called with the fraction done.

    Returns:
        What was written, and found.
    """
    out.mkdir(parents=True, exist_ok=True)
    found = comparisons(export, about)
    note(0.1)
    drawn, files = [], []
    for picture in pictures(export, found):
        files += [path.name for path in save_figure(picture.figure, out / picture.name, _ENDINGS)]
        drawn.append({"name": picture.name, "title": picture.title, "says": picture.says})
        note(0.1 + 0.12 * len(drawn))
    index = {
        "study": export.title,
        "participants": len(export.tables["participants"]),
        "excluded": export.excluded,
        "drives": len(values.tries(export)),
        "test": TEST,
        "findings": findings(found),
        "pictures": drawn,
    }
    texts = {
        "summary.csv": _csv(summary(export)),
        "comparisons.csv": _csv([_row(each) for each in found]),
        "report.md": as_text(export, found, drawn),
        INDEX: json.dumps(index, indent=2, ensure_ascii=False),
    }
    for name, text in texts.items():
        write_file(out / name, text)
    note(1.0)
    return Report((*texts, *files), tuple(findings(found)))


def summary(export: StudyExport) -> list[dict[str, Any]]:
    """Mean and standard deviation over people of each measure, by task and strategy."""
    done = values.successes(export)
    rows: list[dict[str, Any]] = []
    for measure in values.OBJECTIVE:
        for task, strategies in values.objective(export, measure).items():
            people, p = friedman(strategies)
            for strategy, found in strategies.items():
                mean, deviation = values.mean_of(found)
                made, tries = done[task][strategy]
                rows.append(
                    {
                        "task": task,
                        "measure": measure.name,
                        "unit": _unit(measure),
                        "strategy": strategy,
                        "people": len(found),
                        "mean": mean,
                        "sd": deviation,
                        "successes": made,
                        "tries": tries,
                        "friedman_people": people,
                        "friedman_p": p,
                    }
                )
    for item in values.scale_items(export):
        people, p = friedman(item.values)
        for strategy, found in item.values.items():
            mean, deviation = values.mean_of(found)
            rows.append(
                {
                    "measure": f"{item.questionnaire}/{item.key}",
                    "strategy": strategy,
                    "people": len(found),
                    "mean": mean,
                    "sd": deviation,
                    "friedman_people": people,
                    "friedman_p": p,
                }
            )
    return rows


def findings(found: Sequence[Comparison]) -> list[str]:
    """A sentence for each pair that differs; one that says so if none does."""
    sentences = [_sentence(each) for each in found if each.is_significant]
    if sentences:
        return sentences
    people = [each.people for each in found if not math.isnan(each.p)]
    if not people:
        return ["There is nothing to compare yet."]
    return [
        f"No two strategies differ in any of {len(people)} comparisons, of at most "
        f"{max(people)} people each."
    ]


def as_text(
    export: StudyExport, found: Sequence[Comparison], drawn: Sequence[dict[str, str]]
) -> str:
    """The report, as Markdown."""
    people, drives = len(export.tables["participants"]), len(values.tries(export))
    left_out = f", {export.excluded} more were excluded" if export.excluded else ""
    parts = [
        f"# {export.title}\n\n{people} participants{left_out}; {drives} tries.\n",
        "\n".join(f"![{each['title']}]({each['name']}.png)\n\n{each['says']}\n" for each in drawn),
        f"## What differs\n\n{TEST}, over all tasks and pairs of a measure (the items of a "
        f"questionnaire are corrected together); level {LEVEL:g}.\n",
        "\n".join(f"* {sentence}" for sentence in findings(found)) + "\n",
        comparisons_table(found),
        "The effect is the matched-pairs rank-biserial correlation, from -1 to 1; brackets hold "
        "95 % bootstrap intervals over people. A try that came to nothing counts with the time "
        "that there was.\n",
    ]
    return "\n".join(parts)


def comparisons_table(found: Sequence[Comparison]) -> str:
    """Every comparison, as a Markdown table."""
    lines = [
        "| measure | | first | second | people | first - second | effect | p | corrected |",
        "|---|---|---|---|---:|---:|---:|---:|---:|",
    ]
    for each in found:
        difference, effect = each.difference, each.effect
        star = " *" if each.is_significant else ""
        lines.append(
            f"| {_word(each.measure)} | {_title(each.task)} | `{each.first}` | `{each.second}` "
            f"| {each.people} "
            f"| {difference.value:.2f} [{difference.low:.2f}, {difference.high:.2f}] "
            f"| {effect.value:.2f} [{effect.low:.2f}, {effect.high:.2f}] "
            f"| {each.p:.4f} | {each.p_holm:.4f}{star} |"
        )
    return "\n".join(lines) + "\n"


def _sentence(each: Comparison) -> str:
    less, more = (each.first, each.second)
    if each.effect.value > 0.0:
        less, more = more, less
    return (
        f"{_word(each.measure).capitalize()}, {_title(each.task)}: less under "
        f"“{texts.STRATEGIES[less]}” than under “{texts.STRATEGIES[more]}” "
        f"(n = {each.people}, p = {each.p_holm:.3f})."
    )


def _word(measure: str) -> str:
    words = {known.name: known.word for known in values.OBJECTIVE}
    return words.get(measure, measure)


def _title(task: str) -> str:
    return texts.title_of(task) if task in TASKS else task


def _unit(measure: values.Measure) -> str:
    return measure.title.split("[", 1)[1].rstrip("]")


def _row(each: Comparison) -> dict[str, Any]:
    return {
        "measure": each.measure,
        "task_or_item": each.task,
        "first": each.first,
        "second": each.second,
        "people": each.people,
        "difference": each.difference.value,
        "difference_low": each.difference.low,
        "difference_high": each.difference.high,
        "rank_biserial": each.effect.value,
        "rank_biserial_low": each.effect.low,
        "rank_biserial_high": each.effect.high,
        "p": each.p,
        "p_holm": each.p_holm,
    }


def _csv(rows: Sequence[dict[str, Any]]) -> str:
    names = list(dict.fromkeys(name for row in rows for name in row))
    sheet = io.StringIO()
    writer = csv.DictWriter(sheet, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow(
            {
                name: "" if isinstance(value, float) and math.isnan(value) else value
                for name, value in row.items()
            }
        )
    return sheet.getvalue()
