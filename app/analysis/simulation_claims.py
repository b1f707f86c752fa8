"""What rows say about what was claimed and asked for: ratios, paired tests, verdicts.

A ratio of two errors is always the larger of two: that of the position errors' means and that of
the alignment errors' means. Whoever says "at most" is held to both.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import wilcoxon

from app.analysis.simulation_rows import distinct, select, values
from models.experiment import PAPER_METHODS, Row

SINGLE_PRIORS = ("proportionality", "reversibility", "consistency")
WITH_PRIORS = (*SINGLE_PRIORS, "all-priors")
LEARNED = ("no-priors", *WITH_PRIORS)  # from the K answers that a person gives
BASELINES = ("no-align", "manual-align")
ERRORS = ("position_error", "alignment_error")
# What the paper's words are taken to mean; the page says so.
ACCURATE = 0.1  # "accurately": a tenth of the move's length
SIMILAR = 2.0  # "similar performance": at most twice the error
SIGNIFICANT = 0.05
# What was asked for, by noise and task.
_IDEAL = {0.0: {"plane": 1.4, "pour": 1.7, "reach-and-pour": 2.3}}
_NO_PRIORS = {
    0.0: {"plane": 0.10, "pour": 0.10, "reach-and-pour": 0.20},
    0.1: {"plane": 0.20, "pour": 0.20, "reach-and-pour": 0.25},
    0.5: {"plane": 0.45, "pour": 0.45, "reach-and-pour": 0.45},
}
_SINGLE = {noise: {"plane": 0.5, "pour": 0.5, "reach-and-pour": 0.6} for noise in (0.0, 0.1)}
_TASK_SPACE = {
    0.0: {"plane": 0.01, "pour": 0.01, "reach-and-pour": 0.04},
    0.1: {"plane": 0.07, "pour": 0.09, "reach-and-pour": 0.07},
    0.5: {"plane": 0.20, "pour": 0.22, "reach-and-pour": 0.17},
}
_GAIN_OFF = {noise: dict.fromkeys(_IDEAL[0.0], 0.2) for noise in (0.0, 0.1)}
_LOWEST = {noise: dict.fromkeys(_IDEAL[0.0], 1.0) for noise in (0.0, 0.1, 0.5)}


@dataclass(frozen=True)
class Bar:
    """A number that was asked for.

    Attributes:
        what: What is bounded.
        task: Where.
        found: What the rows give.
        limit: What it may be at most.
    """

    what: str
    task: str
    found: float
    limit: float

    @property
    def held(self) -> bool:
        """Whether what was found is within the limit."""
        return self.found <= self.limit


@dataclass(frozen=True)
class Comparison:
    """One method against another over the same seeds.

    Attributes:
        task: Where.
        noise: Where.
        method: The one that is said to be better.
        other: The one it is compared with.
        ratio: Of their errors; below 1 if the method is better.
        p: Wilcoxon's signed ranks on the alignment errors, one-sided: how likely so clear a lead
            would be if the two were equal.
    """

    task: str
    noise: float
    method: str
    other: str
    ratio: float
    p: float

    @property
    def outperforms(self) -> bool:
        """Whether the method is better, and not by chance."""
        return self.ratio < 1.0 and self.p < SIGNIFICANT


@dataclass(frozen=True)
class Count:
    """In how many cases a claim holds."""

    held: int
    cases: int

    @property
    def verdict(self) -> str:
        """In words."""
        if self.cases == 0:
            return "not tried"
        if self.held == self.cases:
            return "held"
        return "not held" if self.held == 0 else f"held in {self.held} of {self.cases} cases"


def count(outcomes: Sequence[bool]) -> Count:
    """How many are true."""
    return Count(sum(outcomes), len(outcomes))


def mean(rows: Sequence[Row], measure: str, **wanted: object) -> float:
    """A measure's mean over the rows with these values; not a number if there are none."""
    found = values(select(rows, **wanted), measure)
    return float(found.mean()) if len(found) else float("nan")


def deviation(rows: Sequence[Row], measure: str, **wanted: object) -> float:
    """A measure's standard deviation over the rows with these values, 0 for a single one."""
    found = values(select(rows, **wanted), measure)
    return float(found.std(ddof=1)) if len(found) > 1 else 0.0


def ratio(upper: Sequence[Row], lower: Sequence[Row]) -> float:
    """The first rows' error over the second's: the larger of the two errors' ratios."""
    pairs = [(mean(upper, name), mean(lower, name)) for name in ERRORS]
    return float(np.max([above / below if below else np.inf for above, below in pairs]))


def compare(rows: Sequence[Row], task: str, noise: float, method: str, other: str) -> Comparison:
    """One method against another, paired by seed."""
    ours = {row.seed: row for row in select(rows, task=task, noise=noise, method=method)}
    theirs = {row.seed: row for row in select(rows, task=task, noise=noise, method=other)}
    shared = sorted(ours.keys() & theirs.keys())
    upper, lower = [ours[seed] for seed in shared], [theirs[seed] for seed in shared]
    difference = values(upper, "alignment_error") - values(lower, "alignment_error")
    # Where there is no difference at all there is nothing to rank.
    p = float(wilcoxon(difference, alternative="less").pvalue) if difference.any() else 1.0
    return Comparison(task, noise, method, other, ratio(upper, lower), p)


def corrected(comparisons: Sequence[Comparison]) -> list[Comparison]:
    """The same with Holm's correction: of many comparisons some would look clear by chance."""
    ranks = np.argsort([found.p for found in comparisons], kind="stable")
    adjusted, highest = list(comparisons), 0.0
    for rank, place in enumerate(ranks):
        highest = max(highest, min(1.0, comparisons[place].p * (len(comparisons) - rank)))
        adjusted[place] = replace(comparisons[place], p=highest)
    return adjusted


def comparisons(
    rows: Sequence[Row],
    methods: Sequence[str],
    others: Sequence[str],
    noises: Sequence[float],
) -> list[Comparison]:
    """Every method against every other one in each task and at each noise, with correction."""
    return corrected(
        [
            compare(rows, task, noise, method, other)
            for task in tasks(rows)
            for noise in noises
            for method in methods
            for other in others
            if select(rows, task=task, noise=noise, method=method)
            and select(rows, task=task, noise=noise, method=other)
        ]
    )


def tasks(rows: Sequence[Row]) -> list[str]:
    """The tasks in the rows' order."""
    return [str(task) for task in distinct(rows, "task")]


def noises(rows: Sequence[Row]) -> list[float]:
    """The noise levels, ascending."""
    return sorted({row.noise for row in rows})


def paper_bars(rows: Sequence[Row]) -> list[Bar]:
    """What was asked of the paper's grid; what the rows do not cover is left out."""

    def over(method: str, other: str) -> Callable[[list[Row]], float]:
        return lambda cell: ratio(select(cell, method=method), select(cell, method=other))

    def worst_single(cell: list[Row]) -> float:
        return float(np.max([over(prior, "no-priors")(cell) for prior in SINGLE_PRIORS]))

    def best_other(cell: list[Row]) -> float:
        others = [name for name in LEARNED if name != "all-priors"]
        return float(np.max([over("all-priors", name)(cell) for name in others]))

    def gain_off(cell: list[Row]) -> float:
        return abs(mean(cell, "motion_gain", method="all-priors") - 1.0)

    asked: tuple[tuple[str, Callable[[list[Row]], float], dict[float, dict[str, float]]], ...] = (
        ("all-priors ÷ ideal-align", over("all-priors", "ideal-align"), _IDEAL),
        ("all-priors ÷ no-priors", over("all-priors", "no-priors"), _NO_PRIORS),
        ("worst single prior ÷ no-priors", worst_single, _SINGLE),
        (
            "task-space, position error",
            lambda cell: mean(cell, "position_error", method="task-space"),
            _TASK_SPACE,
        ),
        ("all-priors ÷ best other that learns from the same answers", best_other, _LOWEST),
        ("all-priors, how far the motion gain is from 1", gain_off, _GAIN_OFF),
    )
    bars = [
        Bar(f"{what}, noise {noise:g}", task, find(select(rows, task=task, noise=noise)), limit)
        for what, find, limits in asked
        for noise, by_task in limits.items()
        for task, limit in by_task.items()
    ]
    return [bar for bar in bars if not np.isnan(bar.found)]


def labels_bars(rows: Sequence[Row]) -> list[Bar]:
    """What was asked of few designed questions: as good as many random ones, for task-space."""
    asked = (("plane", 5, 10, 1.0), ("pour", 5, 10, 1.0), ("reach-and-pour", 8, 20, 1.5))
    bars = [
        Bar(
            f"{few} designed ÷ {many} random questions, noise 0.1",
            task,
            ratio(
                select(cell, queries="designed", labels=few),
                select(cell, queries="random", labels=many),
            ),
            limit,
        )
        for task, few, many, limit in asked
        for cell in [select(rows, task=task, noise=0.1, method="task-space")]
    ]
    return [bar for bar in bars if not np.isnan(bar.found)]


def people_bars(rows: Sequence[Row]) -> list[Bar]:
    """What was asked for everybody: task-space near or ahead of all-priors."""
    bars = []
    for task in tasks(rows):
        for noise in (0.0, 0.1):
            for preference in distinct(rows, "preference"):
                cell = select(
                    rows, task=task, noise=noise, preference=preference, wrong_answers=0.0
                )
                found = ratio(select(cell, method="task-space"), select(cell, method="all-priors"))
                is_curved = any(word in str(preference) for word in ("polar", "expo"))
                limit = 0.5 if is_curved and noise == 0.0 else 1.1
                what = f"task-space ÷ all-priors, {preference}, noise {noise:g}"
                bars.append(Bar(what, task, found, limit))
    return [bar for bar in bars if not np.isnan(bar.found)]


def lowest(rows: Sequence[Row], measure_of: Callable[[list[Row]], float]) -> Count:
    """In how many tasks and noises all-priors has the lowest of what learns from K answers."""
    outcomes = []
    for task in tasks(rows):
        for noise in noises(rows):
            cell = select(rows, task=task, noise=noise)
            found = {
                name: measure_of(select(cell, method=name))
                for name in LEARNED
                if select(cell, method=name)
            }
            outcomes.append(min(found, key=lambda name: found[name]) == "all-priors")
    return count(outcomes)


def is_the_papers(rows: Sequence[Row]) -> bool:
    """Whether there is one setting for each task, method and noise, and all of the methods."""
    settings = {(row.task, row.method, row.noise, row.seed): row for row in rows}
    return len(settings) == len(rows) and set(PAPER_METHODS) <= {row.method for row in rows}
