"""The exact signed-rank test against the one that studies are reported with."""

import numpy as np
import pytest

from app.analysis.comparisons import p_of
from app.analysis.signed_rank import signed_rank


@pytest.mark.parametrize("people", [1, 2, 5, 8, 11, 20])
def test_it_is_the_reported_test_where_nothing_ties(people: int, rng: np.random.Generator) -> None:
    for shift in (-0.8, 0.0, 0.4):
        differences = rng.normal(shift, 1.0, people)
        assert signed_rank(differences)[1] == pytest.approx(p_of(differences))


@pytest.mark.parametrize("people", [3, 7, 9])
def test_it_is_the_reported_test_where_differences_tie_or_are_none(
    people: int, rng: np.random.Generator
) -> None:
    for _ in range(5):
        differences = rng.integers(-2, 4, people).astype(float)
        assert signed_rank(differences)[1] == pytest.approx(p_of(differences))


def test_it_is_what_the_reported_test_comes_near_where_that_draws(rng: np.random.Generator) -> None:
    differences = rng.integers(-2, 4, 16).astype(float)
    assert signed_rank(differences)[1] == pytest.approx(p_of(differences), abs=0.02)


def test_a_hand_worked_case() -> None:
    # Ranks 1, 2.5, 2.5, 4; only the first is positive: sums 0, 1 are two of sixteen patterns.
    way, p = signed_rank(np.array([1.0, -3.0, -3.0, -5.0]))
    assert (way, p) == (-8.0, 4 / 16)


def test_where_nothing_differs_nothing_is_shown() -> None:
    assert signed_rank(np.zeros(6)) == (0.0, 1.0)
