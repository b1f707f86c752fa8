"""The same kinematics for one state at a time, by MuJoCo: a control loop asks for one at a time.

pytorch-kinematics takes 0.2 ms for a state and hardly more for a thousand; MuJoCo takes a few
microseconds for each. tests/models/test_arm_kinematics.py holds the two together.
"""

import mujoco
import numpy as np

from .arrays import HandJacobian, JointPositions
from .kinematics import HandPose, Kinematics
from .panda import HAND_FRAME, N_JOINTS
from .panda_pack import PandaPack
from .props import Props
from .world import compiled

_FEW = 8  # states, for which one after the other is quicker


class ArmKinematics(Kinematics):
    """Kinematics whose single states are quick. For one thread: it works in one place."""

    def __init__(self, kinematics: Kinematics, pack: PandaPack) -> None:
        """Of the same arm as ``kinematics``, which is still asked for many states."""
        super().__init__(kinematics._chain)
        self._mj_model = compiled(pack, Props())
        self._mj_data = mujoco.MjData(self._mj_model)
        self._hand = self._mj_model.body(HAND_FRAME).id

    def hand_pose(self, q: JointPositions) -> HandPose:
        """The hand's pose at joint positions ``q`` in [rad]."""
        if q.ndim > 1:
            if len(q) > _FEW or q.ndim > 2:
                return super().hand_pose(q)
            poses = [self.hand_pose(row) for row in q]
            return HandPose(
                np.array([pose.position for pose in poses]),
                np.array([pose.rotation for pose in poses]),
            )
        self._mj_data.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, self._mj_data)
        position, rotation = self._mj_data.xpos[self._hand], self._mj_data.xmat[self._hand]
        return HandPose(position.copy(), rotation.reshape(3, 3).copy())

    def jacobian(self, q: JointPositions) -> HandJacobian:
        """The hand's velocity per joint velocity, in the world: linear rows above angular ones."""
        if q.ndim > 1:
            if len(q) > _FEW or q.ndim > 2:
                return super().jacobian(q)
            return np.array([self.jacobian(row) for row in q])
        self._mj_data.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, self._mj_data)
        mujoco.mj_comPos(self._mj_model, self._mj_data)
        rows = np.zeros((2, 3, self._mj_model.nv))
        mujoco.mj_jacBody(self._mj_model, self._mj_data, rows[0], rows[1], self._hand)
        return rows[:, :, :N_JOINTS].reshape(6, N_JOINTS)
