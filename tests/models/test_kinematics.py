from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from models.errors import PandaPackError
from models.kinematics import Kinematics, turn
from models.panda import HAND_FRAME, JOINT_NAMES, Q_HOME, Q_MAX, Q_MIN, QD_MAX
from tests.models.conftest import random_joints

# The chain keeps some constants in single precision.
SINGLE = 1e-7


def test_the_hand_is_where_mujoco_says_in_a_thousand_poses(kinematics, pack, rng):
    urdf = pack.urdf.read_text()
    settings = (
        f'<mujoco><compiler meshdir="{pack.folder}" strippath="false" discardvisual="true" '
        'fusestatic="false"/></mujoco>'
    )
    mj_model = mujoco.MjModel.from_xml_string(urdf.replace("<link ", settings + "<link ", 1))
    mj_data = mujoco.MjData(mj_model)
    hand = mj_model.body(HAND_FRAME).id
    q = random_joints(rng, 1000)
    pose, jacobian = kinematics.hand_pose(q), kinematics.jacobian(q)
    linear, angular = np.zeros((3, mj_model.nv)), np.zeros((3, mj_model.nv))
    for index in range(len(q)):
        mj_data.qpos[:7] = q[index]
        mujoco.mj_kinematics(mj_model, mj_data)
        mujoco.mj_comPos(mj_model, mj_data)
        mujoco.mj_jacBody(mj_model, mj_data, linear, angular, hand)
        rotation = mj_data.xmat[hand].reshape(3, 3)
        assert_allclose(pose.position[index], mj_data.xpos[hand], atol=2 * SINGLE)
        assert_allclose(pose.rotation[index], rotation, atol=5 * SINGLE)
        assert_allclose(jacobian[index], np.concatenate([linear, angular])[:, :7], atol=5 * SINGLE)


def test_the_jacobian_is_the_derivative_of_the_pose(kinematics, rng):
    q = random_joints(rng, 20)
    jacobian = kinematics.jacobian(q)
    step = 1e-5
    for joint in range(7):
        move = step * np.eye(7)[joint]
        before, after = kinematics.hand_pose(q - move), kinematics.hand_pose(q + move)
        linear = (after.position - before.position) / (2 * step)
        angular = turn(before.rotation, after.rotation) / (2 * step)
        assert_allclose(jacobian[:, :3, joint], linear, atol=1e-6)
        assert_allclose(jacobian[:, 3:, joint], angular, atol=1e-6)


def test_torch_gradients_are_the_jacobian(kinematics, rng):
    q = torch.from_numpy(random_joints(rng, 1)[0]).requires_grad_()
    position, _ = kinematics.hand_pose_torch(q)
    for axis in range(3):
        (gradient,) = torch.autograd.grad(position[axis], q, retain_graph=True)
        expected = kinematics.jacobian(q.detach().numpy())[axis]
        assert_allclose(gradient.numpy(), expected, atol=SINGLE)


def test_every_rotation_is_a_rotation(kinematics, rng):
    rotation = kinematics.hand_pose(random_joints(rng, 50)).rotation
    assert_allclose(
        rotation @ np.swapaxes(rotation, -1, -2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-6
    )
    assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-6)


def test_any_batch_gives_the_same_rows(kinematics, rng):
    q = random_joints(rng, 6)
    flat = kinematics.hand_pose(q)
    square = kinematics.hand_pose(q.reshape(2, 3, 7))
    one = kinematics.hand_pose(q[4])
    assert_allclose(square.position.reshape(6, 3), flat.position, atol=1e-12)
    assert_allclose(one.rotation, flat.rotation[4], atol=1e-12)
    assert kinematics.jacobian(q.reshape(2, 3, 7)).shape == (2, 3, 6, 7)


def test_a_turn_is_its_axis_times_the_sine_of_its_angle():
    cos, sin = np.cos(0.3), np.sin(0.3)
    about_z = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    assert_allclose(turn(np.eye(3), about_z), [0.0, 0.0, sin])
    assert_allclose(turn(about_z, about_z), 0.0, atol=1e-15)


def test_the_ready_pose_points_down(kinematics):
    pose = kinematics.hand_pose(Q_HOME)
    assert_allclose(pose.rotation, np.diag([1.0, -1.0, -1.0]), atol=1e-6)


def test_the_limits_are_those_of_the_urdf(pack):
    joints = {joint.get("name"): joint for joint in ElementTree.parse(pack.urdf).iter("joint")}
    found = [joints[name].find("limit") for name in JOINT_NAMES]
    limits = [limit.attrib for limit in found if limit is not None]
    assert len(limits) == len(JOINT_NAMES)
    assert_allclose([float(limit["lower"]) for limit in limits], Q_MIN)
    assert_allclose([float(limit["upper"]) for limit in limits], Q_MAX)
    assert_allclose([float(limit["velocity"]) for limit in limits], QD_MAX)


def test_a_missing_urdf_is_named(tmp_path):
    with pytest.raises(PandaPackError, match=r"nowhere\.urdf"):
        Kinematics.from_urdf(tmp_path / "nowhere.urdf")
