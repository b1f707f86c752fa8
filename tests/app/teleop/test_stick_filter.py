import math
import re
from pathlib import Path

import numpy as np
import pytest

from app.teleop.stick_filter import DEAD_ZONE, STEADY_TIME_CONSTANT_S, StickFilter

SETTINGS_JS = Path(__file__).resolve().parents[3] / "static" / "js" / "stick_settings.js"


def test_a_held_stick_arrives_without_turning() -> None:
    stick = StickFilter()
    target = np.array([0.3, -0.6])
    for _ in range(30):
        h = stick.update(target, 1 / 60)
        assert np.cross([*h, 0], [*target, 0])[2] == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(h) <= np.linalg.norm(target)
    assert h == pytest.approx(target, abs=1e-4)


def test_a_released_stick_is_zero_at_once() -> None:
    stick = StickFilter()
    for _ in range(30):
        stick.update(np.array([1.0, 0.0]), 1 / 60)
    assert stick.update(np.zeros(2), 1 / 60).tolist() == [0.0, 0.0]
    assert stick.update(np.array([0.5 * DEAD_ZONE, 0.0]), 1 / 60).tolist() == [0.0, 0.0]


def test_how_far_it_comes_in_a_time_does_not_depend_on_the_ticks() -> None:
    coarse, fine = StickFilter(), StickFilter()
    target = np.array([0.8, 0.1])
    for _ in range(2):
        end = coarse.update(target, 0.02)
    for _ in range(8):
        other_end = fine.update(target, 0.005)
    assert end == pytest.approx(other_end)


def left_of_tremor(stick: StickFilter, hz: float) -> float:
    """How much of a tremor around a steady push comes through, from 0 to 1."""
    times = np.arange(0.0, 3.0, 1 / 60)
    passed = [
        stick.update(np.array([0.5 + 0.2 * math.sin(2 * math.pi * hz * t), 0.0]), 1 / 60)[0]
        for t in times
    ]
    late = np.array(passed)[times > 2.0]
    return float(np.ptp(late)) / 0.4


@pytest.mark.parametrize(("hz", "most"), [(4.0, 0.16), (6.0, 0.11), (12.0, 0.06)])
def test_a_steady_stick_leaves_little_of_a_tremor(hz: float, most: float) -> None:
    assert left_of_tremor(StickFilter(is_steady=True), hz) <= most
    assert left_of_tremor(StickFilter(), hz) > 2.5 * most


def test_a_steady_stick_arrives_within_a_second_and_lets_go_at_once() -> None:
    stick = StickFilter(is_steady=True)
    for _ in range(60):
        h = stick.update(np.array([0.0, 1.0]), 1 / 60)
    assert h == pytest.approx([0.0, 1.0], abs=0.02)
    assert stick.update(np.zeros(2), 1 / 60).tolist() == [0.0, 0.0]


def test_becoming_steady_under_a_push_does_not_jerk() -> None:
    stick = StickFilter()
    for _ in range(30):
        before = stick.update(np.array([0.7, 0.2]), 1 / 60)
    for is_steady in (True, False):
        stick.is_steady = is_steady
        assert stick.update(np.array([0.7, 0.2]), 1 / 60) == pytest.approx(before, abs=1e-4)


def test_the_page_shows_a_steady_stick_as_slow_as_it_is() -> None:
    found = re.search(r"STEADY_S = ([\d.]+)", SETTINGS_JS.read_text())
    assert found is not None
    assert float(found[1]) == STEADY_TIME_CONSTANT_S
