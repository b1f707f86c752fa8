"""A record shown again under a false clock, and measured again."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.analysis.measures import fillings, measure
from app.services.records import Record, split_props
from app.storage.ticks import COLUMNS, pack, pack_props, unpack, unpack_props
from app.teleop.replay import Replay
from models.panda_pack import PandaPack
from tests.app.teleop.test_driven_tasks import Drive, lab_of
from tests.app.teleop.test_live_session import PAGE, FakeScene


def record_of(drive: Drive) -> Record:
    """What would be read from the database."""
    rows = unpack(pack(drive.recorder.rows()))
    props = np.array(drive.recorder.props)
    if props.size:
        props = unpack_props(pack_props(props), len(rows))
    row = SimpleNamespace(outcome=drive.recorder.outcomes[-1])
    return Record(drive.lab.task, rows, *split_props(props, drive.lab.task.props), row)  # type: ignore[arg-type]


def carry(drive: Drive, ticks: int, move: tuple[float, float]) -> None:
    """Let the person make a move in the task's two degrees of freedom, in [m] a step."""
    for _ in range(ticks):
        h = drive.lab.person.answer(np.array(move), None)
        drive.tick(np.clip(h, -1.0, 1.0))


@pytest.mark.parametrize("task", ["avoid", "pour-cup", "fetch-and-pour"])
def test_what_the_record_says_is_what_the_task_said(task: str, pack: PandaPack) -> None:
    lab = lab_of(task, pack)
    drive = Drive(lab, pack, lab.learned, seed=11)
    if task == "avoid":  # into the post, off it, and into it again
        for _ in range(2):
            way = np.array([0.5, 0.0]) - drive.attempt.simulation.hand.position[:2]
            into = 0.018 * way / np.linalg.norm(way)
            carry(drive, 90, (into[0], into[1]))
            carry(drive, 50, (-into[0], -into[1]))
    elif task == "pour-cup":  # half of it between the bowls, the rest where it belongs
        carry(drive, 150, (0.0, 0.018))
        drive.steer(40.0)
    else:
        drive.steer(40.0)
    drive.session.give_up(PAGE)
    said = drive.recorder.outcomes[-1]["counts"]
    found = record_of(drive).measures()
    if task == "avoid":
        assert found.touches == said["touches"] >= 2
        assert found.spills is None
    else:
        assert found.spills == said["spilt"]
        assert found.touches is None
        poured = [filling.in_bowls for filling in fillings(record_of(drive).bead_counts())]
        if task == "pour-cup":  # the far bowl of the first cup, the near bowl of the second
            assert (poured[0][0], poured[1][1]) == (said["far bowl"], said["near bowl"])
        else:
            assert poured == [(said["bowl"],)]
    if task == "pour-cup":
        assert said["spilt"] > 0
    assert found.completion_time_s == pytest.approx(
        drive.recorder.outcomes[-1]["elapsed_s"], abs=1e-4
    )
    live = measure(drive.recorder.rows(), COLUMNS)
    assert (found.path_length_m, found.undo_share) == (live.path_length_m, live.undo_share)


@pytest.fixture(scope="module")
def record(pack: PandaPack) -> Record:
    lab = lab_of("pour-cup", pack)
    drive = Drive(lab, pack, lab.learned)
    carry(drive, 120, (0.0, 0.01))
    drive.session.give_up(PAGE)
    return record_of(drive)


def test_a_replay_shows_the_rows_that_were_recorded(record: Record) -> None:
    scene = FakeScene()
    replay = Replay(record, scene)  # type: ignore[arg-type]
    replay.play(100.0)
    for tick in range(1, 120):
        replay.advance(100.0 + tick / 60 + 1e-4)
        assert replay.tick == tick
    q = record.rows[:, COLUMNS.index("q_1") : COLUMNS.index("q_7") + 1]
    assert np.array_equal(scene.arms, q)
    assert np.array_equal(scene.beads, record.beads[-1])
    assert not replay.is_playing
    replay.advance(500.0)
    assert replay.tick == 119


def test_seeking_pausing_and_speed(record: Record) -> None:
    replay = Replay(record, FakeScene())  # type: ignore[arg-type]
    replay.seek(60)
    replay.advance(7.0)
    assert replay.tick == 60
    replay.speed = 2.0
    replay.play(10.0)
    replay.advance(10.25 + 1e-4)
    assert replay.tick == 90
    replay.pause()
    replay.advance(11.0)
    assert replay.tick == 90
    replay.seek(10**6)
    assert replay.status().tick == 119
    replay.play(20.0)  # from the end: again from the start
    assert (replay.tick, replay.is_playing) == (0, True)
