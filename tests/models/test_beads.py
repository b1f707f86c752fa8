"""Beads of a whole record are counted as those of each tick alone."""

import numpy as np
import pytest

from models.beads import BeadCounts, count_beads, count_beads_by_tick
from models.tasks import get_task


@pytest.mark.parametrize("task", ["plane", "pour-cup", "fetch-and-pour"])
def test_all_ticks_at_once_are_counted_as_each_alone(task, rng):
    props = get_task(task).props
    beads = rng.uniform((0.3, -0.2, -0.01), (0.7, 0.2, 0.2), (300, 20, 3))
    cups = rng.uniform((0.3, -0.2, 0.0), (0.7, 0.2, 0.2), (300, 3))
    wxyzs = rng.normal(size=(300, 4))
    wxyzs /= np.linalg.norm(wxyzs, axis=1, keepdims=True)
    beads[::3, :5] = cups[::3, None] + 0.01  # some within reach of every cup
    alone = [count_beads(props, *tick) for tick in zip(beads, cups, wxyzs, strict=True)]
    assert count_beads_by_tick(props, beads, cups, wxyzs) == alone
    spilt = {counts.spilt for counts in alone}
    assert len(spilt) > 2
    if props.cup is not None:
        assert max(counts.in_cup for counts in alone) > 2
        assert max(counts.in_bowls[0] for counts in alone) > 0


def test_a_record_without_ticks_has_no_counts():
    nothing = np.zeros((0, 20, 3)), np.zeros((0, 3)), np.zeros((0, 4))
    assert count_beads_by_tick(get_task("pour-cup").props, *nothing) == []


def test_where_there_is_no_cup_no_bead_is_in_it():
    counts = count_beads(get_task("plane").props, np.array([[0.4, 0.0, -0.01]]))
    assert counts == BeadCounts(in_cup=0, in_bowls=(), spilt=1)
