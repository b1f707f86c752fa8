"""Power where it is known beforehand."""

import math

import numpy as np
import pytest

from app.analysis import power
from app.analysis.power import Power, power_figure, powers, says, table, table_csv

BETTER = -np.arange(1.0, 13.0)  # twelve people, all faster under the first, no two alike


def shares(differences: np.ndarray, *sizes: int, studies: int = 50, seed: int = 0) -> list[float]:
    return [each.share for each in powers(differences, sizes, studies, 0.05, seed)]


def test_where_all_are_better_six_people_show_it_and_five_cannot() -> None:
    # The least p of n people is 2 of 2^n patterns: 1/16, then 1/32.
    assert shares(BETTER, 5, 6) == [0.0, 1.0]


def test_a_difference_in_the_other_direction_is_not_what_was_hoped_for() -> None:
    assert shares(-BETTER, 5, 6) == [0.0, 0.0]


def test_it_is_counted_how_often_the_odd_one_out_is_drawn() -> None:
    # With him, whose difference is the greatest, p = 28/64; half of the studies of six have him.
    pool = np.append(BETTER[:-1], 20.0)
    (share,) = shares(pool, 6, studies=4000)
    assert share == pytest.approx(0.5, abs=0.03)


def test_where_nothing_differs_it_is_shown_no_more_often_than_the_level() -> None:
    pool = np.random.default_rng(5).normal(size=500)
    pool = np.concatenate([pool, -pool])
    for n in (8, 20):
        (better,), (worse,) = shares(pool, n, studies=1000), shares(-pool, n, studies=1000)
        assert better <= 0.04
        assert 0.02 <= better + worse <= 0.065


def test_nobody_is_twice_in_a_study_and_studies_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    studies: list[set[float]] = []

    def test(differences: np.ndarray) -> float:
        studies.append(set(differences.tolist()))
        return 1.0

    monkeypatch.setattr(power, "p_of", test)
    shares(BETTER, 6)
    assert {len(study) for study in studies} == {6}
    assert len({frozenset(study) for study in studies}) > 30


def test_a_sizes_power_is_the_same_whatever_other_sizes_there_are() -> None:
    pool = np.random.default_rng(1).normal(-0.5, 1.0, 40)
    assert shares(pool, 8, 14)[1:] == shares(pool, 14)
    assert shares(pool, 14) != shares(pool, 14, seed=1)


def test_a_pool_that_is_too_small_is_refused() -> None:
    with pytest.raises(ValueError, match="from 12"):
        powers(BETTER, [4, 7], 10, 0.05, 0)


def test_the_interval_is_wilsons() -> None:
    low, high = Power(10, 200, 172).interval
    p, z, n = 0.86, 1.959964, 200
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert (low, high) == pytest.approx((middle - half, middle + half), abs=1e-6)


def test_the_answer_is_the_smallest_size_that_suffices() -> None:
    found = [Power(8, 200, 148), Power(10, 200, 172), Power(12, 200, 190)]
    assert says(found, 0.8) == (
        "10 participants show it in 86 % of studies (81 to 90 %); of the smaller sizes that were "
        "tried none does so in 80 %."
    )
    assert says(found, 0.7).endswith("fewer were not tried.")
    assert says(found, 0.99) == "No size up to 12 shows it in 99 % of studies."


def test_the_tables_say_the_same() -> None:
    found = [Power(8, 200, 148), Power(10, 200, 172)]
    assert [line.split() for line in table(found).splitlines()[1:]] == [
        ["8", "74", "%", "68", "to", "80", "%"],
        ["10", "86", "%", "81", "to", "90", "%"],
    ]
    head, first, _ = table_csv(found).splitlines()
    assert head == "participants,studies,shown,power,low,high"
    assert first.startswith("8,200,148,0.74,0.67")


def test_the_picture_has_the_curve_its_band_and_what_is_wanted() -> None:
    found = [Power(8, 200, 148), Power(10, 200, 172)]
    (panel,) = power_figure(found, 0.8, "all-priors", "Go round").axes
    curve, wanted = panel.lines
    assert np.array(curve.get_xydata()).tolist() == [[8, 0.74], [10, 0.86]]
    assert set(np.array(wanted.get_ydata())) == {0.8}
    (band,) = panel.collections
    heights = np.array(band.get_paths()[0].vertices)[:, 1]
    low, high = heights.min(), heights.max()
    assert (low, high) == pytest.approx((found[0].interval[0], found[1].interval[1]))
