import numpy as np
import pytest

from app.teleop.stick_filter import DEAD_ZONE, StickFilter


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
