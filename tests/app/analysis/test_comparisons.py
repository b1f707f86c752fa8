"""Paired tests against values worked out by hand, and against chance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.analysis.comparisons import compare, corrected, friedman, p_of, paired


def people(values: list[float]) -> dict[str, float]:
    return {f"p{index}": value for index, value in enumerate(values)}


@pytest.mark.parametrize("n", [5, 8, 10])
def test_when_everyone_agrees_p_is_the_chance_of_two_outcomes_of_all_signs(n: int) -> None:
    differences = np.arange(1.0, n + 1.0)
    assert p_of(differences) == pytest.approx(2 / 2**n)
    assert p_of(-differences) == pytest.approx(2 / 2**n)
    # And also where several differences are the same.
    assert p_of(np.ones(n)) == pytest.approx(2 / 2**n)


def test_one_of_four_against_the_others_by_hand() -> None:
    # Ranks 1, 2, 3 for and 4 against: W = 4; signs with a rank sum of at most 4: 7 of 16.
    assert p_of(np.array([1.0, 2.0, 3.0, -4.0])) == pytest.approx(2 * 7 / 16)


def test_no_difference_is_no_evidence_and_nobody_is_no_test() -> None:
    assert p_of(np.zeros(6)) == 1.0
    assert np.isnan(p_of(np.array([])))


def test_holm_by_hand() -> None:
    assert corrected([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    mended = corrected([float("nan"), 0.04])
    assert np.isnan(mended[0])
    assert mended[1] == pytest.approx(0.04)


def test_only_people_with_both_values_are_paired() -> None:
    assert paired({"a": 3.0, "b": 1.0}, {"b": 4.0, "c": 9.0}).tolist() == [-3.0]


def test_a_lead_of_everyone_is_found_with_its_size_and_sign() -> None:
    slow, fast = people([10.0, 12.0, 14.0, 16.0, 19.0, 21.0]), people([1.0] * 6)
    (found,) = compare("completion_time_s", {"avoid": {"no-align": slow, "all-priors": fast}})
    assert (found.first, found.second, found.people) == ("no-align", "all-priors", 6)
    assert found.difference.value == pytest.approx(np.mean(list(slow.values())) - 1.0)
    assert found.difference.low < found.difference.value < found.difference.high
    assert found.effect.value == 1.0
    assert found.p == pytest.approx(2 / 2**6)
    assert found.is_significant


def test_the_more_is_compared_the_less_is_significant() -> None:
    values = {
        name: people([shift + 0.1 * k for k in range(6)])
        for shift, name in enumerate(("no-align", "no-priors", "all-priors"))
    }
    values = {
        name: {who: value + 0.01 * shift * k for k, (who, value) in enumerate(each.items())}
        for shift, (name, each) in enumerate(values.items())
    }
    everything = compare("m", {"avoid": values})
    assert len(everything) == 3
    assert not any(each.is_significant for each in everything)  # 3 × .03
    planned = compare("m", {"avoid": {n: values[n] for n in ("no-align", "all-priors")}})
    assert planned[0].is_significant
    assert len(compare("m", {"avoid": values}, about="all-priors")) == 2


def test_false_alarms_are_as_rare_as_they_should_be() -> None:
    """Three strategies that are alike: any alarm among three pairs in at most about 5 %."""
    rng = np.random.default_rng(5)
    alarms = 0
    for _ in range(60):
        x = rng.normal(size=(3, 10))
        alarms += min(corrected([p_of(d) for d in x - np.roll(x, 1, axis=0)])) < 0.05
    assert alarms <= 8  # 5 % of 60 is 3; more than 8 happens once in 250 times


def test_friedman_needs_three() -> None:
    three = {name: people([k + shift for k in range(6)]) for shift, name in enumerate("abc")}
    count, p = friedman(three)
    assert count == 6
    assert p == pytest.approx(np.exp(-6))  # chi-square of 12 with two degrees of freedom
    assert np.isnan(friedman({name: three[name] for name in "ab"})[1])


@given(st.lists(st.floats(-5, 5, width=16), min_size=1, max_size=9))
@settings(max_examples=40, deadline=None)
def test_p_does_not_care_who_is_first(differences: list[float]) -> None:
    d = np.array(differences)
    assert p_of(d) == pytest.approx(p_of(-d))
    assert 0.0 < p_of(d) <= 1.0
