"""Whether the strategies differ in a study: paired tests for few people, with sizes and intervals.

Everyone drives under every strategy, so people are compared with themselves. Times and shares of
few people are far from normal, so nothing is assumed of their distribution but that, if two
strategies were alike, a difference would be as likely to have either sign: Wilcoxon's signed-rank
test, exact (Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1945). As
many tests are made of a measure as there are tasks and pairs, and Holm's correction holds the
chance of any false alarm among them at the level (Holm, "A simple sequentially rejective multiple
test procedure", Scandinavian Journal of Statistics 1979).
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy import stats
from statsmodels.stats.multitest import multipletests

from app.analysis.signed_rank import signed_rank_p

LEVEL = 0.05
TEST = "Wilcoxon's signed-rank test, exact, two-sided, with Holm's correction"
_CONFIDENCE = 0.95
_RESAMPLES = 2000
_SEED = 0  # of drawn resamples: the same data, the same words

# For one task: a strategy's values by participant.
Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Interval:
    """A number estimated from people, with its 95 % interval; NaN where there is none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Comparison:
    """Two strategies over the same people.

    Attributes:
        task: Where; "" for all of the study.
        measure: Of what.
        first: A strategy.
        second: The one it is compared with.
        people: How many have a value under both.
        difference: Mean of first minus second, in the measure's unit; bootstrap interval (BCa).
        effect: Matched-pairs rank-biserial correlation: the share of the ranks with first above
            second less the share below, from -1 to 1 (Kerby, "The simple difference formula",
            Comprehensive Psychology 2014); bootstrap interval.
        p: Of the test alone; NaN if there is nothing to test.
        p_holm: Corrected over all comparisons of the measure.
    """

    task: str
    measure: str
    first: str
    second: str
    people: int
    difference: Interval
    effect: Interval
    p: float
    p_holm: float = float("nan")

    @property
    def is_significant(self) -> bool:
        """Whether the two differ, at the level of 5 % after correction."""
        return bool(self.p_holm < LEVEL)


def compare(
    measure: str, tasks: Mapping[str, Values], about: str | None = None
) -> list[Comparison]:
    """Compare every two strategies in every task; corrected over all of them.

    Args:
        measure: Its name.
        tasks: For each task, a strategy's values by participant. Who lacks a value under one of
            two strategies is left out of their comparison.
        about: The strategy that the study's hypothesis is about, laid down beforehand: only pairs
            with it are compared.
    """
    found = [
        _pair(task, measure, first, second, values)
        for task, values in tasks.items()
        for first, second in combinations(values, 2)
        if about is None or about in (first, second)
    ]
    return _corrected(found)


def paired(first: Mapping[str, float], second: Mapping[str, float]) -> np.ndarray:
    """First minus second of whoever has both, ``(n,)``, in the order of their names."""
    both = sorted(first.keys() & second.keys())
    return np.array([first[who] - second[who] for who in both])


def p_of(differences: np.ndarray) -> float:
    """How likely differences at least so one-sided are if neither sign is favoured; two-sided.

    Args:
        differences: ``(n,)``; people without a difference count for both signs alike (Pratt).
    """
    if len(differences) == 0:
        return float("nan")
    if not differences.any():
        return 1.0
    sizes = np.abs(differences)
    if len(np.unique(sizes)) == len(sizes) and sizes.all():
        return float(stats.wilcoxon(differences, method="exact").pvalue)
    return signed_rank_p(differences)


def corrected(p: Sequence[float]) -> list[float]:
    """Holm's correction of those that are numbers."""
    raw = np.array(p, dtype=float)
    is_tested = ~np.isnan(raw)
    if is_tested.any():
        raw[is_tested] = multipletests(raw[is_tested], method="holm")[1]
    return [float(value) for value in raw]


def friedman(values: Values) -> tuple[int, float]:
    """How many have a value under every strategy, and Friedman's p that all strategies are alike.

    NaN with fewer than three strategies or people.
    """
    everyone = set.intersection(*(set(each) for each in values.values())) if values else set()
    if len(values) < 3 or len(everyone) < 3:
        return len(everyone), float("nan")
    who = sorted(everyone)
    columns = [[each[one] for one in who] for each in values.values()]
    if np.ptp(np.array(columns), axis=0).max() == 0.0:
        return len(everyone), 1.0
    return len(everyone), float(stats.friedmanchisquare(*columns).pvalue)


def _pair(task: str, measure: str, first: str, second: str, values: Values) -> Comparison:
    differences = paired(values[first], values[second])
    return Comparison(
        task,
        measure,
        first,
        second,
        len(differences),
        _interval(differences, _mean),
        _interval(differences, rank_biserial),
        p_of(differences),
    )


def _corrected(found: list[Comparison]) -> list[Comparison]:
    holm = corrected([each.p for each in found])
    return [replace(each, p_holm=p) for each, p in zip(found, holm, strict=True)]


def _mean(sample: np.ndarray, axis: int = -1) -> np.ndarray:
    mean: np.ndarray = np.mean(sample, axis=axis)
    return mean


def rank_biserial(sample: np.ndarray, axis: int = -1) -> np.ndarray:
    """The share of the ranks with a positive difference less the share with a negative one."""
    ranks = stats.rankdata(np.abs(sample), axis=axis)
    r: np.ndarray = (np.sign(sample) * ranks).sum(axis) / ranks.sum(axis)
    return r


def _interval(differences: np.ndarray, statistic: Callable[..., Any]) -> Interval:
    nothing = float("nan")
    if len(differences) < 2:
        return Interval(
            float(statistic(differences)) if len(differences) else nothing, *2 * [nothing]
        )
    value = float(statistic(differences))
    for method in ("BCa", "percentile"):  # the former has none where resamples do not differ
        with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
            warnings.simplefilter("ignore", stats.DegenerateDataWarning)
            made = stats.bootstrap(
                (differences,),
                statistic,
                n_resamples=_RESAMPLES,
                confidence_level=_CONFIDENCE,
                method=method,
                rng=np.random.default_rng(_SEED),
            ).confidence_interval
        if np.isfinite([made.low, made.high]).all():
            return Interval(value, float(made.low), float(made.high))
    return Interval(value, nothing, nothing)
