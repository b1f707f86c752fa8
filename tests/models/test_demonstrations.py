import numpy as np
import pytest
from jaxtyping import TypeCheckError
from numpy.testing import assert_allclose, assert_array_equal

from models.demonstrations import DT_S, MAX_SPEED_M_S, Demonstrations, joints_at
from models.errors import ShapeError, UnknownTaskError
from models.kinematics import HandPose
from models.panda import Q_MAX, Q_MIN, QD_MAX
from models.tasks import TASKS, get_task


def demonstrate(plane, kinematics, *, disturbed, seed=4, trajectories=30, steps=25):
    return plane.demonstrations(
        kinematics, np.random.default_rng(seed), trajectories, steps, disturbed=disturbed
    )


def test_demonstrations_stay_in_the_plane_and_point_down(plane, kinematics):
    states, _ = demonstrate(plane, kinematics, disturbed=False).pairs()
    pose = kinematics.hand_pose(states)
    assert np.abs(pose.position[:, 2] - plane.height_m).max() < 0.005
    assert pose.rotation[:, 2, 2].max() < -np.cos(np.radians(1.0))


def test_demonstrations_reach_over_the_whole_workspace_and_hardly_beyond(plane, kinematics):
    states, _ = demonstrate(plane, kinematics, disturbed=False).pairs()
    at = plane.dof(kinematics.hand_pose(states))
    low, high = plane.workspace
    assert np.all(at.min(axis=0) < low + 0.03)
    assert np.all(at.max(axis=0) > high - 0.03)
    assert np.all((at > low - 0.06) & (at < high + 0.06))


def test_demonstrations_keep_the_speed_limits_of_hand_and_joints(plane, kinematics):
    states, actions = demonstrate(plane, kinematics, disturbed=True).pairs()
    velocity = np.einsum("nij,nj->ni", kinematics.jacobian(states), actions)
    assert np.linalg.norm(velocity[:, :2], axis=1).max() <= MAX_SPEED_M_S * 1.02
    assert np.all(np.abs(actions) < QD_MAX)
    assert np.all((states > Q_MIN) & (states < Q_MAX))


def test_a_state_follows_from_the_one_before(plane, kinematics):
    shown = demonstrate(plane, kinematics, disturbed=True)
    assert_allclose(shown.states[:, 1:], shown.states[:, :-1] + shown.actions[:, :-1] * DT_S)


def test_disturbed_demonstrations_find_back_to_the_plane_while_they_move(plane, kinematics):
    shown = demonstrate(plane, kinematics, disturbed=True, steps=40)

    def off(states):
        return np.abs(kinematics.hand_pose(states).position[:, 2] - plane.height_m).mean()

    assert off(shown.states[:, 0]) > 0.005
    assert off(shown.states[:, -1]) < 0.3 * off(shown.states[:, 0])


def test_the_same_seed_demonstrates_the_same(plane, kinematics):
    first, again = (demonstrate(plane, kinematics, disturbed=True) for _ in range(2))
    other = demonstrate(plane, kinematics, disturbed=True, seed=5)
    assert first.content_hash == again.content_hash != other.content_hash


def test_a_split_keeps_every_trajectory_on_one_side(plane, kinematics):
    shown = demonstrate(plane, kinematics, disturbed=False)
    training, held_out = shown.split(0.2)
    assert (len(training.states), len(held_out.states)) == (24, 6)
    assert_array_equal(np.concatenate([training.actions, held_out.actions]), shown.actions)


def test_states_and_actions_that_disagree_are_refused():
    with pytest.raises((ShapeError, TypeCheckError)):
        Demonstrations(np.zeros((2, 3, 7)), np.zeros((2, 4, 7)))
    with pytest.raises(ShapeError, match="trajectories, steps"):
        Demonstrations(np.zeros((3, 7)), np.zeros((3, 7)))


@pytest.mark.parametrize("name", TASKS)
def test_a_task_starts_at_home_and_finds_every_point_of_its_workspace(name, kinematics):
    task = get_task(name)
    home = kinematics.hand_pose(task.home_q)
    assert_allclose(home.position[2], task.height_m, atol=1e-3)
    q = task.spread(kinematics, (3, 4))
    found, meant = kinematics.hand_pose(q), task.pose_at(task.dof(kinematics.hand_pose(q)))
    assert q.shape == (12, 7)
    assert_allclose(found.position, meant.position, atol=1e-6)
    assert_allclose(found.rotation, meant.rotation, atol=1e-6)
    assert_allclose(task.dof(found)[[0, -1]], task.workspace, atol=1e-6)


def test_a_point_out_of_reach_does_not_break_the_search(plane, kinematics):
    q = joints_at(plane.motions[0], kinematics, np.array([[3.0, 0.0]]))
    assert np.all((q >= Q_MIN) & (q <= Q_MAX))


def test_plane_splits_a_move_into_its_own_and_the_rest(plane):
    before = HandPose(np.array([0.5, 0.1, 0.25]), np.diag([1.0, -1.0, -1.0]))
    after = HandPose(np.array([0.52, 0.07, 0.26]), np.diag([1.0, -1.0, -1.0]))
    assert_allclose(plane.dof_change(before, after), [0.02, -0.03])
    assert_allclose(plane.off_task_change(before, after), [0.01, 0.0, 0.0, 0.0], atol=1e-15)


def test_an_unknown_task_is_answered_with_the_known_ones():
    with pytest.raises(UnknownTaskError, match="no task 'juggle'; choose one of: plane"):
        get_task("juggle")
