"""Touches and fillings told from a record as the tasks count them live."""

from typing import Any

import numpy as np
import pytest

from app.analysis.measures import Thresholds, fillings, spills, touches
from models.beads import BeadCounts
from models.simulation import HandState, Simulation
from models.tasks.avoid import GoingRound

TICK_S = 1.0 / 60.0


class Post(Simulation):
    """A post that is touched when it is told so."""

    is_touching = False
    hand = HandState(np.array([0.6, 0.0, 0.12]), np.array([1.0, 0.0, 0.0, 0.0]))

    def __init__(self) -> None: ...


def live(touching: np.ndarray) -> int:
    """What the task counts."""
    simulation = Post()
    attempt = GoingRound(simulation)
    for is_touching in touching.tolist():
        simulation.is_touching = is_touching
        attempt.watch(TICK_S)
    return int(attempt.touches)


def recorded(touching: np.ndarray, begin_s: float = 50.0, late_s: float = 0.0) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    late = late_s * (rng.random(len(touching)) < 0.05)
    times = begin_s + np.cumsum(np.full(len(touching), TICK_S) + late)
    return {"touching": touching.astype(float), "monotonic_s": times}


@pytest.mark.parametrize("late_s", [0.0, 0.03])
def test_touches_are_counted_as_the_task_counts_them(late_s: float) -> None:
    rng = np.random.default_rng(3)
    found = set()
    for _ in range(30):
        touching = rng.random(400) < 0.06
        count = touches(recorded(touching, rng.uniform(0.0, 1e6), late_s), Thresholds())
        assert count == live(touching)
        found.add(count)
    assert len(found) > 2


def test_a_touch_ends_after_three_tenths_of_a_second() -> None:
    for untouched, count in ((0, 1), (5, 1), (18, 1), (19, 2)):
        touching = np.array([True, *[False] * untouched, True])
        assert touches(recorded(touching), Thresholds()) == live(touching) == count
    touching = np.array([True, *[False] * 18, True])
    assert touches(recorded(touching), Thresholds(let_go_s=0.1)) == 2


def test_a_record_from_before_touches_were_recorded_does_not_tell() -> None:
    columns = recorded(np.zeros(10, dtype=bool))
    assert touches(columns, Thresholds()) == 0
    columns["touching"][:] = np.nan
    assert touches(columns, Thresholds()) is None


def test_what_was_spilt_before_a_refill_counts() -> None:
    full, tipping = BeadCounts(20, (0, 0), 0), BeadCounts(9, (6, 0), 3)
    first, second = BeadCounts(1, (14, 0), 5), BeadCounts(2, (0, 16), 2)
    ticks = [full, tipping, first, first, full, full, tipping, second]
    assert fillings(ticks) == [first, second]
    assert spills(ticks) == 7
    assert fillings([full, tipping]) == [tipping]
    assert (fillings([]), spills([])) == ([], None)
