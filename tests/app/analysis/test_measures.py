"""Measures of drives, on records of which the answer is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from app.analysis.measures import Thresholds, heat_map, measure
from app.storage.ticks import COLUMNS, pack, unpack

RATE_HZ = 60
AT = {name: index for index, name in enumerate(COLUMNS)}


def drive(*pieces: tuple[float, float, float]) -> np.ndarray:
    """A record: for so many seconds the stick is at (x, y), and the hand follows at 0.1 m/s."""
    sticks = np.concatenate(
        [np.tile([x, y], (round(seconds * RATE_HZ), 1)) for seconds, x, y in pieces]
    )
    rows = np.zeros((len(sticks), len(COLUMNS)))
    rows[:, AT["monotonic_s"]] = 500.0 + np.arange(len(rows)) / RATE_HZ
    rows[:, [AT["raw_x"], AT["raw_y"]]] = sticks
    rows[:, [AT["hand_x"], AT["hand_y"]]] = np.cumsum(0.1 * sticks / RATE_HZ, axis=0)
    return rows


def test_time_way_and_rest_are_what_was_recorded() -> None:
    found = measure(drive((2.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, -0.5)), COLUMNS)
    assert found.completion_time_s == pytest.approx(4.0)
    assert found.path_length_m == pytest.approx(0.1 * 2.0 + 0.05 * 1.0, abs=0.002)
    assert found.idle_time_s == pytest.approx(1.0)
    assert found.is_success is None
    assert found.undo_share == 0.0


def test_turning_back_is_undoing_until_the_new_direction_is_the_recent_one() -> None:
    found = measure(drive((3.0, 1.0, 0.0), (3.0, -1.0, 0.0)), COLUMNS)
    # Of six seconds pushed, half a second until the window holds as much of one as of the other.
    assert found.undo_share == pytest.approx(0.45 / 6.0, abs=0.01)


@pytest.mark.parametrize(("turn_deg", "undoes"), [(90.0, False), (110.0, False), (130.0, True)])
def test_only_a_sharp_turn_undoes(turn_deg: float, undoes: bool) -> None:
    angle = np.radians(turn_deg)
    rows = drive((2.0, 1.0, 0.0), (2.0, float(np.cos(angle)), float(np.sin(angle))))
    assert (measure(rows, COLUMNS).undo_share > 0.01) == undoes
    strict = Thresholds(undo_angle_deg=80.0)
    assert measure(rows, COLUMNS, thresholds=strict).undo_share > 0.01


def test_who_rests_before_turning_back_has_thought_not_undone() -> None:
    assert (
        measure(drive((2.0, 1.0, 0.0), (1.5, 0.0, 0.0), (2.0, -1.0, 0.0)), COLUMNS).undo_share
        == 0.0
    )


def test_evenness_is_one_for_all_directions_and_none_for_one() -> None:
    eighths = [(1.0, float(np.cos(a)), float(np.sin(a))) for a in np.arange(8) * np.pi / 4]
    assert measure(drive(*eighths), COLUMNS).evenness == pytest.approx(1.0)
    assert measure(drive((2.0, 0.0, 1.0)), COLUMNS).evenness == 0.0
    two = measure(drive((1.0, 1.0, 0.0), (1.0, 0.0, 1.0)), COLUMNS).evenness
    assert two == pytest.approx(np.log(2) / np.log(8))


def test_the_heat_map_shows_where_the_stick_was() -> None:
    rows = drive((1.0, 1.0, 0.0), (3.0, 0.0, -1.0), (2.0, 0.0, 0.0))
    shares = heat_map({name: rows[:, index] for name, index in AT.items()}, Thresholds(bins=3))
    assert_allclose(shares, np.array([[0, 0, 0], [0.75, 0, 0], [0, 0.25, 0]]))


def test_what_the_task_counted_is_in_the_row() -> None:
    outcome = {"counts": {"touches": 2, "degrees": 700}, "is_success": False, "elapsed_s": 4.0}
    found = measure(drive((1.0, 1.0, 0.0)), COLUMNS, outcome)
    assert found.as_row()["touches"] == 2
    assert found.as_row()["is_success"] is False
    assert "counts" not in found.as_row()


def test_the_record_as_stored_gives_the_same_numbers() -> None:
    rows = drive((2.0, 0.6, 0.3), (1.0, -0.6, 0.1), (1.0, 0.0, 0.0))
    assert measure(unpack(pack(rows)), COLUMNS) == measure(rows, COLUMNS)


@pytest.mark.parametrize("ticks", [0, 1])
def test_a_drive_that_hardly_began_has_measures_too(ticks: int) -> None:
    found = measure(drive((1.0, 1.0, 0.0))[:ticks], COLUMNS)
    assert found.path_length_m == 0.0
    assert np.isfinite(found.undo_share)
