import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from models.beads import BeadCounts
from models.demonstrations import DT_S
from models.errors import UnknownTaskError
from models.kinematics import HandPose
from models.simulation import HandState, Simulation
from models.tasks import TASKS, get_task
from models.tasks.avoid import AvoidPhase, GoingRound
from models.tasks.base import LEVER_M
from models.tasks.pour_cup import Pouring


@pytest.fixture(params=list(TASKS))
def task(request):
    return get_task(request.param)


def hand_at(x, y, z, turned_rad=0.0):
    cos, sin = np.cos(turned_rad), np.sin(turned_rad)
    rotation = np.array([[cos, sin, 0.0], [sin, -cos, 0.0], [0.0, 0.0, -1.0]])
    return HandPose(np.array([x, y, z]), rotation)


def test_demonstrations_use_the_two_degrees_of_freedom_and_nothing_else(task, kinematics, rng):
    s, a = task.demonstrations(kinematics, rng, 20, 30).pairs()
    before, after = kinematics.hand_pose(s), kinematics.hand_pose(s + a * DT_S)
    inside = np.linalg.norm(task.dof_change(before, after), axis=-1)
    off = np.linalg.norm(task.off_task_change(before, after), axis=-1)
    assert inside.mean() > 0.005
    assert off.mean() < 0.02 * inside.mean()


def test_every_motion_is_demonstrated_as_often(task, kinematics, rng):
    s, _ = task.demonstrations(kinematics, rng, 12, 20).pairs()
    motions = np.bincount(task.motion_at(kinematics.hand_pose(s)))
    assert_array_equal(motions, [240 // len(task.motions)] * len(task.motions))


def test_the_arm_starts_in_the_middle_of_what_it_may_do(task, kinematics):
    pose = kinematics.hand_pose(task.home_q)
    assert task.motion_at(pose) == 0
    assert task.stays_inside(pose, np.zeros(2))
    assert_allclose(pose.position[2], task.height_m, atol=2e-3)


def test_the_jacobian_is_the_derivative_of_the_degrees_of_freedom(task, kinematics, rng):
    s, _ = task.demonstrations(kinematics, rng, 6, 5).pairs()
    step = 1e-5 * rng.normal(size=s.shape)
    change = task.dof_change(kinematics.hand_pose(s), kinematics.hand_pose(s + step))
    linear = (task.dof_jacobian(kinematics, s) @ step[..., None])[..., 0]
    assert_allclose(change, linear, atol=1e-8)


def test_what_was_moved_changed_by_that_much_and_by_nothing_else(task, kinematics, rng):
    s, _ = task.demonstrations(kinematics, rng, 6, 5).pairs()
    change = 1e-4 * rng.normal(size=(len(s), 2))
    before = kinematics.hand_pose(s)
    after = task.moved(before, change)
    assert_allclose(task.dof_change(before, after), change, atol=1e-9)
    assert_allclose(task.off_task_change(before, after), 0.0, atol=1e-9)


def test_a_turn_counts_a_lever_for_each_radian():
    task = get_task("pour")
    change = task.dof_change(hand_at(0.5, 0.0, 0.3), hand_at(0.5, 0.0, 0.31, 0.04))
    assert_allclose(change, [0.01, LEVER_M * np.sin(0.04)], atol=1e-12)
    assert_allclose(task.dof(hand_at(0.5, 0.0, 0.3, 0.4)), [0.3, 0.4 * LEVER_M])


def test_the_same_move_means_another_thing_once_the_bottle_is_lifted():
    task = get_task("reach-and-pour")
    low, high = hand_at(0.55, 0.1, 0.15), hand_at(0.55, 0.1, 0.3)
    assert_allclose(task.dof_change(low, hand_at(0.56, 0.1, 0.16)), [0.01, 0.0], atol=1e-12)
    assert_allclose(task.dof_change(high, hand_at(0.56, 0.1, 0.31)), [0.01, 0.0], atol=1e-12)
    assert_allclose(task.off_task_change(high, hand_at(0.56, 0.1, 0.31))[:2], [0.01, 0.0])
    assert task.azimuth(low) == pytest.approx(np.arctan2(0.1, 0.55))
    assert task.azimuth(high) == 0.0


def test_a_long_move_at_the_edge_leaves_the_workspace(task):
    middle = np.mean(task.workspace, axis=0)
    pose = task.pose_at(middle)
    assert task.stays_inside(pose, np.array([0.02, 0.02]))
    assert not task.stays_inside(pose, np.array([0.5, 0.0]))


def test_a_task_that_does_not_exist_is_named_with_those_that_do():
    with pytest.raises(UnknownTaskError, match="'fly'; choose one of: plane, pour, reach"):
        get_task("fly")


def test_an_attempt_begins_in_a_phase_of_its_task(task, pack, kinematics, rng):
    attempt = task.begin(Simulation(pack, task.props), kinematics, rng)
    assert isinstance(attempt.progress.phase, task.phases)
    assert not attempt.progress.is_done


class Scripted(Simulation):
    """What an attempt sees of a simulation, said beforehand."""

    bead_counts, is_touching = BeadCounts(20, (0, 0), 0), False
    hand = HandState(np.array([0.61, 0.0, 0.12]), np.array([0.0, 1.0, 0.0, 0.0]))

    def __init__(self):
        pass

    def go_to(self, angle_deg):
        angle = np.radians(angle_deg)
        at = np.array([0.5 + 0.11 * np.cos(angle), 0.11 * np.sin(angle), 0.12])
        self.hand = HandState(at, self.hand.wxyz)


def test_a_bead_that_lies_where_nothing_counts_it_does_not_keep_the_pouring_going():
    seen = Scripted()
    pouring = Pouring(seen, bowl=0)
    pouring.watch(1.0)
    seen.bead_counts = BeadCounts(0, (18, 0), 0)
    were_empty = []
    for _ in range(4):
        pouring.watch(0.25)
        were_empty.append(pouring.is_empty)
    assert were_empty == [False, False, False, True]  # though two of the twenty lie on a rim
    assert pouring.is_enough


def test_a_bump_counts_once_and_the_next_one_too():
    seen = Scripted()
    attempt = GoingRound(seen)
    counted = []
    # Touching for two seconds with a bounce of a fifth, let go for half a second, and once more.
    for is_touching in [False, *[True] * 10, *[False] * 2, *[True] * 10, *[False] * 5, True, True]:
        seen.is_touching = is_touching
        attempt.watch(0.1)
        counted.append(attempt.progress.counts["touches"])
    assert counted == [0, *[1] * 27, 2, 2]


def test_who_goes_round_the_wrong_way_has_nothing_to_unwind():
    seen = Scripted()
    attempt = GoingRound(seen)
    for angle in range(0, 400, 10):  # counter-clockwise
        seen.go_to(angle)
        attempt.watch(0.1)
    assert attempt.progress.counts["degrees"] == 0
    for angle in range(390, 10, -10):  # a little more than once round
        seen.go_to(angle)
        attempt.watch(0.1)
    assert attempt.progress.counts["degrees"] == 360
    assert attempt.progress.phase == AvoidPhase.COUNTER_CLOCKWISE
