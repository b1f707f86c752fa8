"""The signed-rank test for ties against scipy's own, wherever scipy has an exact one."""

import numpy as np
import pytest
from scipy import stats

from app.analysis.signed_rank import signed_rank_p

EVERY_PATTERN = stats.PermutationMethod(10_000)


@pytest.mark.parametrize("people", [1, 2, 5, 8, 11, 20])
def test_it_is_scipys_where_nothing_ties(people: int, rng: np.random.Generator) -> None:
    for shift in (-0.8, 0.0, 0.4):
        differences = rng.normal(shift, 1.0, people)
        known = stats.wilcoxon(differences, method="exact").pvalue
        assert signed_rank_p(differences) == pytest.approx(known)


@pytest.mark.parametrize("people", [3, 7, 9])
def test_it_is_what_listing_every_pattern_gives_where_differences_tie_or_are_none(
    people: int, rng: np.random.Generator
) -> None:
    for _ in range(5):
        differences = rng.integers(-2, 4, people).astype(float)
        known = stats.wilcoxon(differences, zero_method="pratt", method=EVERY_PATTERN).pvalue
        assert signed_rank_p(differences) == pytest.approx(known)


def test_it_is_what_drawn_patterns_come_near(rng: np.random.Generator) -> None:
    differences = rng.integers(-2, 4, 16).astype(float)
    drawn = stats.wilcoxon(differences, zero_method="pratt", method=EVERY_PATTERN).pvalue
    assert signed_rank_p(differences) == pytest.approx(drawn, abs=0.02)


def test_a_hand_worked_case() -> None:
    # Ranks 1, 2.5, 2.5, 4; only the first is positive: sums 0, 1 are two of sixteen patterns.
    assert signed_rank_p(np.array([1.0, -3.0, -3.0, -5.0])) == 4 / 16


def test_where_nothing_differs_nothing_is_shown() -> None:
    assert signed_rank_p(np.zeros(6)) == 1.0
