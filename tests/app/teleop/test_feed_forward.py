"""The arrows lead where the stick leads, and are seen when they should be."""

import numpy as np
import pytest

from app.teleop.feed_forward import AHEAD_S, DIRECTIONS, arrows
from models.beads import rotation_matrix
from models.panda_pack import PandaPack
from models.simulation import Simulation
from models.tasks.fetch_and_pour import FetchPhase
from tests.app.teleop.test_driven_tasks import Drive, lab_of
from tests.app.teleop.test_live_session import NEWER, PAGE


def tip(simulation: Simulation) -> np.ndarray:
    hand = simulation.hand
    return hand.position + 0.1 * rotation_matrix(hand.wxyz)[:, 2]


@pytest.mark.parametrize("task", ["avoid", "pour-cup"])
def test_an_arrow_leads_where_the_hand_goes_when_the_stick_is_pushed(
    task: str, pack: PandaPack
) -> None:
    lab = lab_of(task, pack)
    for index, h in enumerate(DIRECTIONS):
        drive = Drive(lab, pack, lab.learned, seed=3)
        for _ in range(15):  # the beads come to rest
            drive.tick(np.zeros(2))
        begin, end = arrows(lab.learned, drive.attempt.simulation)[index]
        assert begin == pytest.approx(tip(drive.attempt.simulation), abs=1e-6)
        for _ in range(30):
            drive.tick(h)
        gone, meant = tip(drive.attempt.simulation) - begin, 0.5 / AHEAD_S * (end - begin)
        assert np.linalg.norm(meant) > 0.03  # a tilt on the spot, too
        cosine = gone @ meant / np.linalg.norm(gone) / np.linalg.norm(meant)
        assert cosine > 0.97
        assert 0.6 < np.linalg.norm(gone) / np.linalg.norm(meant) < 1.2


def test_who_may_switch_them_sees_them_while_steering(pack: PandaPack) -> None:
    lab = lab_of("avoid", pack)
    drive = Drive(lab, pack, lab.learned, arrows="switch")
    drive.tick(np.zeros(2))
    assert drive.scene.arrows is None
    drive.session.show_arrows(NEWER, True)
    drive.tick(np.zeros(2))
    assert drive.scene.arrows is None
    drive.session.show_arrows(PAGE, True)
    for _ in range(12):
        drive.tick(np.array([0.0, 1.0]))
    first = drive.scene.arrows
    assert first is not None
    assert drive.session.status(PAGE, drive.now_s).arrows
    for _ in range(12):
        drive.tick(np.array([0.0, 1.0]))
    later = drive.scene.arrows
    assert later is not None
    assert not np.allclose(first, later)  # they stay at the hand
    drive.session.give_up(PAGE)
    assert drive.scene.arrows is None
    assert drive.recorder.outcomes[0]["arrows_s"] == pytest.approx(24 / 60)


@pytest.mark.parametrize(("setting", "are_seen"), [("off", False), ("on", True)])
def test_where_the_study_decides_nobody_can_switch_them(
    setting: str, are_seen: bool, pack: PandaPack
) -> None:
    lab = lab_of("avoid", pack)
    drive = Drive(lab, pack, lab.learned, arrows=setting)
    drive.session.show_arrows(PAGE, not are_seen)
    for _ in range(12):
        drive.tick(np.zeros(2))
    assert (drive.scene.arrows is not None) == are_seen


def test_they_go_while_the_arm_moves_by_itself(pack: PandaPack) -> None:
    lab = lab_of("fetch-and-pour", pack)
    drive = Drive(lab, pack, lab.learned, arrows="on")
    drive.tick(np.zeros(2))
    assert drive.scene.arrows is not None
    drive.attempt.stage = FetchPhase.LOWER  # type: ignore[attr-defined]
    for _ in range(12):
        drive.tick(np.zeros(2))
    assert drive.scene.arrows is None
