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


class ArmKinematics(Kinematics):
    """Kinematics whose single states are quick. For one thread: it works in one place."""

    def __init__(self, pack: PandaPack) -> None:
        """Read the arm from its asset pack."""
        super().__init__(Kinematics.from_urdf(pack.urdf)._chain)
        self._mj_model = compiled(pack, Props())
        self._mj_data = mujoco.MjData(self._mj_model)
        self._hand = self._mj_model.body(HAND_FRAME).id

    def hand_pose(self, q: JointPositions) -> HandPose:
        """The hand's pose at joint positions ``q`` in [rad]."""
        if q.ndim > 1:
            return super().hand_pose(q)
        self._mj_data.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, self._mj_data)
        position, rotation = self._mj_data.xpos[self._hand], self._mj_data.xmat[self._hand]
        return HandPose(position.copy(), rotation.reshape(3, 3).copy())

    def jacobian(self, q: JointPositions) -> HandJacobian:
        """The hand's velocity per joint velocity, in the world: linear rows above angular ones."""
        if q.ndim > 1:
            return super().jacobian(q)
        self._mj_data.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, self._mj_data)
        mujoco.mj_comPos(self._mj_model, self._mj_data)
        rows = np.zeros((2, 3, self._mj_model.nv))
        mujoco.mj_jacBody(self._mj_model, self._mj_data, rows[0], rows[1], self._hand)
        return rows[:, :, :N_JOINTS].reshape(6, N_JOINTS)
