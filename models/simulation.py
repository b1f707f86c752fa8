"""The arm and the table in MuJoCo: joint targets in, joint positions and the hand's pose out.

MuJoCo's own compiled structures are called ``mj_model`` and ``mj_data`` here.
"""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from .arrays import JointPositions, JointVelocities
from .panda import FINGER_OPEN_M, HAND_FRAME, JOINT_NAMES, N_JOINTS, Q_HOME, Q_MAX, Q_MIN
from .panda_pack import PandaPack

TIMESTEP_S = 1.0 / 240.0
TABLE_TOP_M = 0.0  # the base stands on the table; its top is the world's z = 0
# Stiffness and damping of the joints' position servos. Chosen so that the arm follows a joint
# target at full speed within 0.02 s and without ringing (tests/models/test_simulation).
_SERVO_KP = np.array([4500.0, 4500.0, 3500.0, 3500.0, 2000.0, 2000.0, 2000.0])  # [N m/rad]
_SERVO_KD = 0.02 * _SERVO_KP  # [N m s/rad]; at 1 rad/s the arm trails its target by 0.02 rad
_ARMATURE = 0.1  # reflected rotor inertia, [kg m^2]
# The servo never pulls further ahead of the arm than this, so that a blocked arm is not wound up.
_MAX_LEAD_RAD = 0.05
_LIMIT_MARGIN_RAD = 0.01  # targets stay this far inside the joint limits


@dataclass(frozen=True)
class HandState:
    """Where the hand is: position ``(3,)`` in [m] and orientation ``(4,)`` as (w, x, y, z)."""

    position: np.ndarray
    wxyz: np.ndarray


class Simulation:
    """One arm on one table."""

    def __init__(self, pack: PandaPack) -> None:
        """Compile the world from the asset pack and put the arm in its home pose."""
        self._mj_model = _compile(pack)
        self._mj_data = mujoco.MjData(self._mj_model)
        self._mj_elsewhere = mujoco.MjData(self._mj_model)
        self._jacobian = np.zeros((3, self._mj_model.nv))
        self._hand = self._mj_model.body(HAND_FRAME).id
        self._target = Q_HOME.copy()
        self.reset(Q_HOME)

    @property
    def q(self) -> JointPositions:
        """Joint positions of the arm, ``(7,)`` in [rad]."""
        q: JointPositions = self._mj_data.qpos[:N_JOINTS].copy()
        return q

    @property
    def target(self) -> JointPositions:
        """Where the joint servos pull to, ``(7,)`` in [rad]."""
        return self._target.copy()

    @property
    def hand(self) -> HandState:
        """The pose of the hand frame in the world."""
        return HandState(
            self._mj_data.xpos[self._hand].copy(), self._mj_data.xquat[self._hand].copy()
        )

    def hand_velocity(self, qd: JointVelocities) -> np.ndarray:
        """How fast the hand would move, ``(3,)`` in [m/s], if the joints moved at ``qd``."""
        mujoco.mj_jacBody(self._mj_model, self._mj_data, self._jacobian, None, self._hand)
        velocity: np.ndarray = self._jacobian[:, :N_JOINTS] @ qd
        return velocity

    def hand_at(self, q: JointPositions) -> np.ndarray:
        """Where the hand would be, ``(3,)`` in [m], with the joints at ``q``; nothing moves."""
        self._mj_elsewhere.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, self._mj_elsewhere)
        position: np.ndarray = self._mj_elsewhere.xpos[self._hand].copy()
        return position

    def reset(self, q: JointPositions) -> None:
        """Put the arm at ``q`` ``(7,)`` in [rad], at rest."""
        mujoco.mj_resetData(self._mj_model, self._mj_data)
        self._mj_data.qpos[:N_JOINTS] = q
        self._mj_data.qpos[N_JOINTS:] = FINGER_OPEN_M
        self.set_target(q)
        self._mj_data.ctrl[N_JOINTS:] = FINGER_OPEN_M
        mujoco.mj_forward(self._mj_model, self._mj_data)

    def set_target(self, q_target: JointPositions) -> None:
        """Pull the joints to ``q_target`` ``(7,)`` in [rad], kept inside the joint limits."""
        lead = np.clip(q_target - self._mj_data.qpos[:N_JOINTS], -_MAX_LEAD_RAD, _MAX_LEAD_RAD)
        self._target = np.clip(
            self._mj_data.qpos[:N_JOINTS] + lead,
            Q_MIN + _LIMIT_MARGIN_RAD,
            Q_MAX - _LIMIT_MARGIN_RAD,
        )
        self._mj_data.ctrl[:N_JOINTS] = self._target

    def step(self, dt_s: float) -> None:
        """Let ``dt_s`` seconds pass, in whole time steps."""
        for _ in range(max(1, round(dt_s / TIMESTEP_S))):
            mujoco.mj_step(self._mj_model, self._mj_data)


@cache
def _compile(pack: PandaPack) -> mujoco.MjModel:
    # One compiled world serves every simulation: MuJoCo only reads it.
    # The URDF has no pictures MuJoCo could read and fixed links we must not lose (the hand frame).
    urdf = pack.urdf.read_text().replace(
        "<link ",
        f'<mujoco><compiler meshdir="{pack.folder}" strippath="false" discardvisual="true" '
        'fusestatic="false"/></mujoco><link ',
        1,
    )
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.timestep = TIMESTEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for body in spec.bodies:
        body.gravcomp = 1.0  # the real arm compensates its own weight
    for index, name in enumerate(JOINT_NAMES):
        joint = spec.joint(name)
        joint.armature = _ARMATURE
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=_SERVO_KP[index], kv=_SERVO_KD[index])
    finger = spec.joint("panda_finger_joint1")
    finger.armature = 0.01
    servo = spec.add_actuator(
        name=finger.name, target=finger.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    servo.set_to_position(kp=400.0, kv=40.0)
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[0.6, 0.75, 0.02],
        pos=[0.35, 0.0, TABLE_TOP_M - 0.02],
    )
    # The base is bolted to the table; neighbours in the chain overlap by design.
    spec.add_exclude(bodyname1="world", bodyname2="panda_link0")
    spec.add_exclude(bodyname1="world", bodyname2="panda_link1")
    spec.add_exclude(bodyname1="panda_link5", bodyname2="panda_link7")
    spec.add_exclude(bodyname1="panda_link7", bodyname2="panda_hand")
    return spec.compile()
