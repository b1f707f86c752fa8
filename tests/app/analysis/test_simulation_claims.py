import numpy as np
import pytest
from scipy.stats import wilcoxon

from app.analysis.simulation_claims import (
    Bar,
    Comparison,
    compare,
    comparisons,
    corrected,
    count,
    labels_bars,
    paper_bars,
    people_bars,
    ratio,
)
from models.experiment import PAPER_NOISES
from tests.app.analysis.experiments import (
    GOOD,
    labels_rows,
    make_row,
    paper_rows,
    people_rows,
)


def test_a_ratio_is_the_larger_of_both_errors() -> None:
    ours = [make_row(position_error=0.1, alignment_error=0.9)]
    theirs = [make_row(position_error=0.2, alignment_error=0.3)]
    assert ratio(ours, theirs) == pytest.approx(3.0)


def test_a_ratio_to_no_rows_is_no_number() -> None:
    assert np.isnan(ratio([make_row()], []))


def test_methods_are_compared_seed_by_seed() -> None:
    rng = np.random.default_rng(1)
    lead = rng.uniform(0.001, 0.1, 8)
    lead[3] = -0.02
    person = rng.uniform(1.0, 9.0, 8)  # people differ far more than methods do
    rows = [
        make_row(method=method, seed=seed, alignment_error=person[seed] - gained)
        for method, gains in (("all-priors", lead), ("consistency", np.zeros(8)))
        for seed, gained in enumerate(gains)
    ]
    found = compare(rows, "plane", 0.0, "all-priors", "consistency")
    assert found.p == wilcoxon(-lead, alternative="less").pvalue
    assert found.p < 0.05


def test_a_seed_that_only_one_method_has_does_not_count() -> None:
    rows = [make_row(seed=0, position_error=0.1), make_row(seed=1, position_error=9.0)]
    rows += [make_row(method="no-priors", seed=0, position_error=0.2)]
    assert compare(rows, "plane", 0.0, "all-priors", "no-priors").ratio == pytest.approx(0.5)


def test_equal_methods_do_not_outperform_each_other() -> None:
    rows = paper_rows(GOOD | {"consistency": GOOD["all-priors"]})
    found = compare(rows, "plane", 0.1, "all-priors", "consistency")
    assert found.p == 1.0
    assert not found.outperforms


def test_holms_correction_is_holms() -> None:
    given = [Comparison("plane", 0.0, "a", "b", 0.5, p) for p in (0.01, 0.04, 0.03, 0.005)]
    assert [found.p for found in corrected(given)] == pytest.approx([0.03, 0.06, 0.06, 0.02])


def test_few_seeds_cannot_outperform() -> None:
    rows = paper_rows(seeds=3)
    found = comparisons(rows, ["all-priors"], ["consistency"], PAPER_NOISES)
    assert len(found) == 9
    assert all(test.ratio < 0.5 for test in found)
    assert not any(test.outperforms for test in found)


def test_all_bars_hold_where_all_is_well_and_each_bar_can_fail() -> None:
    bars = paper_bars(paper_rows())
    assert len(bars) == 3 + 9 + 6 + 9 + 9 + 6
    assert all(bar.held for bar in bars)
    for method, error, what in (
        ("ideal-align", 0.001, "all-priors ÷ ideal-align"),
        ("no-priors", 0.03, "all-priors ÷ no-priors"),
        ("reversibility", 0.59, "worst single prior"),
        ("task-space", 0.3, "task-space"),
        ("consistency", 0.019, "best other"),
    ):
        failed = [bar for bar in paper_bars(paper_rows(GOOD | {method: error})) if not bar.held]
        assert failed
        assert any(what in bar.what for bar in failed), what


def test_what_was_not_run_is_not_judged() -> None:
    rows = paper_rows({name: error for name, error in GOOD.items() if name != "task-space"})
    assert not [bar for bar in paper_bars(rows) if "task-space" in bar.what]


def test_a_robot_that_hardly_moves_is_seen() -> None:
    rows = [make_row(method="all-priors", motion_gain=0.7, seed=seed) for seed in range(2)]
    (bar,) = paper_bars(rows)
    assert bar.found == pytest.approx(0.3)
    assert not bar.held


@pytest.mark.parametrize(("designed", "held"), [(0.1, True), (0.9, False)])
def test_few_designed_questions_are_held_against_many_random_ones(
    designed: float, held: bool
) -> None:
    bars = labels_bars(labels_rows(designed))
    assert [bar.task for bar in bars] == ["plane", "pour", "reach-and-pour"]
    assert all(bar.held is held for bar in bars)


def test_polar_and_expo_people_are_to_gain_twice_without_noise() -> None:
    bars = people_bars(people_rows(task_space=0.015))
    asked = {bar.what: bar.limit for bar in bars}
    assert asked["task-space ÷ all-priors, polar, noise 0"] == 0.5
    assert asked["task-space ÷ all-priors, expo:0.7, noise 0.1"] == 1.1
    missed = {bar.what for bar in bars if not bar.held}
    assert missed == {
        "task-space ÷ all-priors, polar, noise 0",
        "task-space ÷ all-priors, expo:0.7, noise 0",
    }


def test_a_bar_is_held_up_to_its_limit() -> None:
    assert Bar("x", "plane", 0.5, 0.5).held
    assert not Bar("x", "plane", 0.5001, 0.5).held


@pytest.mark.parametrize(
    ("outcomes", "words"),
    [
        ([], "not tried"),
        ([True, True], "held"),
        ([False], "not held"),
        ([True, False, True], "held in 2 of 3 cases"),
    ],
)
def test_verdicts_are_words(outcomes: list[bool], words: str) -> None:
    assert count(outcomes).verdict == words
