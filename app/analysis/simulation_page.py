"""``docs/simulation.md``: what the simulations showed, in plain words, from the files of runs.

No number on the page is typed by hand, and every verdict follows from the rows.
"""

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from app import texts
from app.analysis import simulation_tables as md
from app.analysis.pictures import save_figure
from app.analysis.simulation_claims import (
    Bar,
    Count,
    is_the_papers,
    labels_bars,
    mean,
    noises,
    paper_bars,
    people_bars,
    ratio,
    tasks,
)
from app.analysis.simulation_figure import bars_figure, labels_figure
from app.analysis.simulation_hypotheses import hypotheses, other_claims
from app.analysis.simulation_output import Run
from app.analysis.simulation_progress import duration
from app.analysis.simulation_rows import (
    MEASURES,
    SimulationError,
    Spread,
    distinct,
    select,
    spread,
    values,
    write_file,
)
from app.analysis.simulation_variations import (
    bars_table,
    controllers_section,
    labels_section,
    people_section,
)
from models.experiment import METHODS, Row

_SHOWN_NOISE = 0.1  # of the picture of labels, where it was tried
_PICTURE = "simulation"
_LABELS_PICTURE = "simulation-labels"


@dataclass(frozen=True)
class Runs:
    """The runs that the page is made from.

    Attributes:
        paper: The paper's grid.
        labels: Several numbers of labels.
        people: Several preferences, shares of wrong answers; may be empty.
        controllers: Several controllers; may be empty.
    """

    paper: tuple[Run, ...]
    labels: tuple[Run, ...]
    people: tuple[Run, ...] = ()
    controllers: tuple[Run, ...] = ()

    def all(self) -> tuple[Run, ...]:
        """Every run, in the order of the page."""
        return (*self.paper, *self.labels, *self.people, *self.controllers)


def write_page(runs: Runs, page: Path, pictures: Path) -> None:
    """Write the page and its pictures; folders are made where they are not there.

    Args:
        runs: What it is made from.
        page: The Markdown file.
        pictures: The folder for its pictures.

    Raises:
        SimulationError: If the runs are not what their names say.
    """
    text = page_text(runs, Path(os.path.relpath(pictures, page.parent)).as_posix())
    for folder in (page.parent, pictures):
        folder.mkdir(parents=True, exist_ok=True)
    paper, labels = joined(runs.paper), joined(runs.labels)
    bars = bars_figure(paper, runs.paper[0].rotation_weight)
    save_figure(bars, pictures / _PICTURE, ["png"])
    save_figure(labels_figure(labels, _shown_noise(labels)), pictures / _LABELS_PICTURE, ["png"])
    write_file(page, text)


def page_text(runs: Runs, pictures: str) -> str:
    """The page; its pictures lie in a folder of that address.

    Raises:
        SimulationError: If the runs are not what their names say.
    """
    paper, labels = joined(runs.paper), joined(runs.labels)
    if not is_the_papers(paper):
        raise SimulationError(
            "--paper needs all of the paper's methods, and one setting for each task, method and "
            "noise."
        )
    if len({row.labels for row in labels}) < 2:
        raise SimulationError("--labels needs runs with at least two numbers of labels.")
    people = _with_randomly_drawn(joined(runs.people), paper)
    controllers = joined(runs.controllers)
    text, verdicts = hypotheses(paper)
    bars = paper_bars(paper)
    all_bars = [*bars, *labels_bars(labels), *people_bars(people)]
    turned = select(controllers, controller="warped", method="manual-align", noise=0.0)
    labels_picture = f"{pictures}/{_LABELS_PICTURE}.png"
    sections = [
        _introduction(paper, runs.paper[0].rotation_weight, pictures),
        _in_short(paper, verdicts, all_bars),
        _again(runs),
        text,
        other_claims(paper, mean(turned, "position_error") if turned else None),
        _asked(bars),
        _numbers(paper),
        labels_section(labels, labels_picture, _shown_noise(labels)),
        *([people_section(people)] if people else []),
        *([controllers_section(controllers)] if controllers else []),
        _falls_short(verdicts, all_bars),
    ]
    return md.filled("\n\n".join(sections)) + "\n"


def joined(runs: Iterable[Run]) -> list[Row]:
    """The rows of several runs, a cell that more than one holds counting once."""
    rows: dict[tuple[object, ...], Row] = {}
    for run in runs:
        for row in run.rows:
            cell = tuple(value for name, value in vars(row).items() if name not in MEASURES)
            rows.setdefault(cell, row)
    return list(rows.values())


def _shown_noise(labels: Sequence[Row]) -> float:
    levels = noises(labels)
    return _SHOWN_NOISE if _SHOWN_NOISE in levels else levels[0]


def _in_short(rows: Sequence[Row], verdicts: dict[str, Count], bars: Sequence[Bar]) -> str:
    meanings = {
        "H1": "with an answer for every move, the alignment is accurate",
        "H2": "with few answers, priors come close to that",
        "H3": "three priors together outperform each alone",
    }
    lines = [f"* **{name} {verdicts[name].verdict}**: {text}." for name, text in meanings.items()]
    held = sum(bar.held for bar in bars)
    lines += [f"* **{held} of {len(bars)}** numbers that we asked for hold."]
    for noise in noises(rows):
        cells = [select(rows, task=task, noise=noise) for task in tasks(rows)]
        found = [
            ratio(select(cell, method="task-space"), select(cell, method="all-priors"))
            for cell in cells
            if select(cell, method="task-space")
        ]
        if found:
            lines.append(
                f"* At noise {noise:g}, `task-space` has at most {max(found):.2f} times the error "
                "of `all-priors`, whatever the task."
            )
    return "## In short\n\n" + "\n".join(lines)


def _with_randomly_drawn(people: list[Row], paper: list[Row]) -> list[Row]:
    """The people with those of the paper's grid beside them, under the same conditions."""
    methods, levels = distinct(people, "method"), noises(people)
    return people + [
        row
        for row in paper
        if row.method in methods
        and row.noise in levels
        and not select(people, task=row.task, preference=row.preference, noise=row.noise)
    ]


def _introduction(rows: Sequence[Row], weight: float, pictures: str) -> str:
    seeds = len(distinct(rows, "seed"))
    sizes = md.listed(
        [
            f"{row.labels} and {row.unlabelled} in *{texts.title_of(row.task)}*"
            for row in (select(rows, task=task)[0] for task in tasks(rows))
        ]
    )
    return f"""# The simulation experiments

<!-- Written by 'joymap simulate-page' from the files of runs: change the code, not this page. -->

Joymap learns what a person means by their stick from a few answers. Here the people are
simulated, so that it is known what they mean. The experiment is the paper's (section
"Simulation Experiments"); one method, `task-space`, is ours.

One run goes like this:

1. A simulated person is drawn, with a private idea of what the stick should do.
2. The robot makes K moves. For each, the person answers with the stick they would have given.
   Answers are noisy: the noise level is the length of the noise over that of the answer.
3. A method learns from these K *labels*, and from N moves that nobody has labelled.
4. The person asks for new moves, in places that neither the controller nor the method has seen.

K and N are {sizes}. Everything is repeated with {seeds} seeds; each draws other people, moves and
noise.

![Alignment error of every method in every task, at every noise level]({pictures}/{_PICTURE}.png)

A bar is a method; lower is better, and the axis is logarithmic. Two methods learn nothing from
answers: `no-align` hands the stick to the controller as it is, and `manual-align` is the affine
map that fits best. `no-priors` learns from the answers alone. `proportionality`, `reversibility`
and `consistency` each add one of the paper's priors, and `all-priors` adds all of them.
`ideal-align` is given an exact answer for every move, which nobody has. `task-space` learns what
the person wants from the hand, and works out the rest from the controller, which is known.

| measure | what it is |
|---|---|
| position error | how far the hand ends from where it was meant to, over the move's length |
| rotation error | the angle between how the hand is turned and how it was meant to be, in rad |
| alignment error | position error + {weight:g}/rad × rotation error |
| motion gain | length of the moves made over that of the moves meant; near 0, it hardly moves |

The paper does not say how it weighs rotation against position; {weight:g}/rad is our choice, and
`--rotation-weight` changes it. Pure rotations are left out of the position error: nothing
relative can be said of a distance that is nearly zero."""


def _again(runs: Runs) -> str:
    lines = [
        [
            run.folder.name,
            str(len(run.rows)),
            duration(run.worker_seconds),
            f"`{run.origin}`",
        ]
        for run in runs.all()
    ]
    text = f"""## Run it again

`make simulation` makes the runs and this page; `joymap simulate --out DIR` alone makes the
paper's grid. A run that was stopped goes on where it was. The same seed gives the same rows, to
the bit, on the same machine; only the training times differ.

{md.table(["run", "cells", "work of one core", "made by"], lines)}

"Made by" stands for the code, the controllers' weights and the libraries' versions."""
    if len({run.origin for run in runs.all()}) > 1:
        text += " **These runs were not all made by the same.**"
    return text


def _asked(bars: Sequence[Bar]) -> str:
    return f"""## What we asked of it

Each is a mean, or a ratio of two methods' mean errors: the larger of position and alignment
error's. {sum(bar.held for bar in bars)} of {len(bars)} hold.

{bars_table(bars)}"""


def _numbers(rows: Sequence[Row]) -> str:
    measures: tuple[tuple[str, str, Callable[[Spread | None], str]], ...] = (
        ("position_error", "Position error", md.error_spread),
        ("rotation_error", "Rotation error, in thousandths of a radian", md.milliradians),
        ("motion_gain", "Motion gain", md.gain),
    )
    text = "## All numbers\n\nMean ± standard deviation over the seeds; columns are noise levels."
    for measure, title, show in measures:
        text += f"\n\n### {title}\n\n{_measure_table(rows, measure, show)}"
    times = [
        [f"`{method}`", *(md.seconds(mean(rows, "training_seconds", method=method, task=task))
                          for task in tasks(rows))]
        for method in METHODS if select(rows, method=method)
    ]  # fmt: skip
    head = ["method", *(texts.title_of(task) for task in tasks(rows))]
    return f"""{text}

### Time to learn

Mean wall clock of the learning alone, while every core was busy (`make bench` measures it
undisturbed).

{md.table(head, times)}"""


def _measure_table(rows: Sequence[Row], measure: str, show: Callable[[Spread | None], str]) -> str:
    levels = noises(rows)
    lines = [
        [
            texts.title_of(task),
            f"`{method}`",
            *(
                show(_spread(select(rows, task=task, method=method, noise=noise), measure))
                for noise in levels
            ),
        ]
        for task in tasks(rows)
        for method in METHODS
        if select(rows, task=task, method=method)
    ]
    return md.table(["task", "method", *(f"{noise:g}" for noise in levels)], lines, texts=2)


def _falls_short(verdicts: dict[str, Count], bars: Sequence[Bar]) -> str:
    missed = [
        f"* {name} {verdict.verdict}."
        for name, verdict in verdicts.items()
        if verdict.held < verdict.cases
    ] + [
        f"* {bar.what}, *{texts.title_of(bar.task)}*: {md.ratio(bar.found)}, asked for at most "
        f"{bar.limit:g}."
        for bar in bars
        if not bar.held
    ]
    found = "\n".join(missed) or "Everything that was claimed and asked for held in these runs."
    return f"""## What falls short

{found}

Simulated people are simpler than people. They have one idea of the stick and keep to it, and
their noise is the same everywhere. Numbers here say which method to prefer, not how content
anybody will be."""


def _spread(rows: Sequence[Row], measure: str) -> Spread | None:
    found = values(rows, measure)
    return spread(found) if len(found) else None
