import numpy as np
import pytest

from models.arm_kinematics import ArmKinematics
from models.kinematics import Kinematics
from models.panda import Q_MAX, Q_MIN
from models.panda_pack import PandaPack


@pytest.fixture(scope="module")
def quick(pack: PandaPack, kinematics: Kinematics) -> ArmKinematics:
    return ArmKinematics(kinematics, pack)


def test_one_state_is_where_it_is_among_many(quick: ArmKinematics, kinematics: Kinematics) -> None:
    states = np.random.default_rng(3).uniform(Q_MIN, Q_MAX, (200, 7))
    pose, jacobian = kinematics.hand_pose(states), kinematics.jacobian(states)
    for index, q in enumerate(states):
        one = quick.hand_pose(q)
        assert np.allclose(one.position, pose.position[index], atol=1e-6)
        assert np.allclose(one.rotation, pose.rotation[index], atol=1e-6)
        assert np.allclose(quick.jacobian(q), jacobian[index], atol=1e-6)
    few = quick.hand_pose(states[:5])
    assert np.allclose(few.position, pose.position[:5], atol=1e-6)
    assert np.allclose(few.rotation, pose.rotation[:5], atol=1e-6)
    assert np.allclose(quick.jacobian(states[:5]), jacobian[:5], atol=1e-6)


def test_many_states_are_as_ever(quick: ArmKinematics, kinematics: Kinematics) -> None:
    states = np.random.default_rng(4).uniform(Q_MIN, Q_MAX, (3, 5, 7))
    assert np.array_equal(quick.hand_pose(states).position, kinematics.hand_pose(states).position)
    assert np.array_equal(quick.jacobian(states), kinematics.jacobian(states))


def test_an_answer_is_not_overwritten_by_the_next_one(quick: ArmKinematics) -> None:
    low = quick.hand_pose(Q_MIN)
    before = low.position.copy()
    quick.hand_pose(Q_MAX)
    assert np.array_equal(low.position, before)
