"""The arm, the table and the props in MuJoCo: joint targets in, positions and poses out.

MuJoCo's own compiled structures are called ``mj_model`` and ``mj_data`` here; :mod:`world`
compiles them.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from .arrays import HandJacobian, JointPositions
from .beads import BeadCounts, count_beads, in_frame, rotation_matrix
from .errors import InputError
from .panda import FINGER_OPEN_M, HAND_FRAME, N_JOINTS, Q_HOME, Q_MAX, Q_MIN
from .panda_pack import PandaPack
from .props import HANDLE_SIZE_M, TABLE_TOP_M, WALL_M, Props
from .world import GRIP, OBSTACLE, TIMESTEP_S, settled
from .world import compiled as _compile

__all__ = ["GRASP_REACH_M", "TABLE_TOP_M", "TIMESTEP_S", "HandState", "Simulation"]

# The servo never pulls further ahead of the arm than this, so that a blocked arm is not wound up.
_MAX_LEAD_RAD = 0.05
_LIMIT_MARGIN_RAD = 0.01  # targets stay this far inside the joint limits
# The hand can take hold of a cup whose nearest point is this far from the hand frame, in [m].
GRASP_REACH_M = 0.03
_HOLDING_M = HANDLE_SIZE_M[1] / 2  # each finger from the middle, while they hold the handle
# Where things are among MuJoCo's positions (qpos) and velocities (qvel).
_FINGERS = slice(N_JOINTS, N_JOINTS + 2)
_CUP_POSITION, _CUP_WXYZ, _CUP_VELOCITY = slice(9, 12), slice(12, 16), slice(9, 15)
_BEAD_POSITIONS, _BEAD_VELOCITIES = slice(16, None), slice(15, None)


@dataclass(frozen=True)
class HandState:
    """Where something is: position ``(3,)`` in [m] and orientation ``(4,)`` as (w, x, y, z)."""

    position: np.ndarray
    wxyz: np.ndarray


class Simulation:
    """One arm on one table, with its props."""

    def __init__(self, pack: PandaPack, props: Props = Props()) -> None:
        """Compile the world from the asset pack and put the arm in its home pose."""
        self._props = props
        self._shared = self._mj_model = _compile(pack, props)
        self._mj_data = mujoco.MjData(self._mj_model)
        self._mj_elsewhere = mujoco.MjData(self._mj_model)
        self._hand = self._mj_model.body(HAND_FRAME).id
        self._target = Q_HOME.copy()
        self._first_bead = self._mj_model.nbody - (props.beads.count if props.beads else 0)
        if props.cup is not None:
            self._grip = self._mj_model.equality(GRIP).id
        if props.obstacle is not None:
            self._obstacle = self._mj_model.geom(OBSTACLE).id
        self.reset(Q_HOME)

    # The arm.

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

    @property
    def hand_jacobian(self) -> HandJacobian:
        """The hand's velocity per joint velocity, in the world: linear rows above angular ones."""
        rows = np.zeros((2, 3, self._mj_model.nv))
        mujoco.mj_jacBody(self._mj_model, self._mj_data, rows[0], rows[1], self._hand)
        return rows[:, :, :N_JOINTS].reshape(6, N_JOINTS)

    def pose_at(self, q: JointPositions) -> HandState:
        """The pose of the hand with the joints at ``q`` ``(7,)`` in [rad]; nothing moves."""
        elsewhere = self._mj_elsewhere
        elsewhere.qpos[:N_JOINTS] = q
        mujoco.mj_kinematics(self._mj_model, elsewhere)
        return HandState(elsewhere.xpos[self._hand].copy(), elsewhere.xquat[self._hand].copy())

    # The props.

    @property
    def cup(self) -> HandState | None:
        """The pose of the cup, in the middle below its floor with z to its opening; None: none."""
        if self._props.cup is None:
            return None
        qpos = self._mj_data.qpos
        return HandState(qpos[_CUP_POSITION].copy(), qpos[_CUP_WXYZ].copy())

    @property
    def bead_positions(self) -> np.ndarray:
        """The middle of each bead, ``(n, 3)`` in [m]."""
        beads: np.ndarray = self._mj_data.qpos[_BEAD_POSITIONS].reshape(-1, 3).copy()
        return beads

    @property
    def bead_counts(self) -> BeadCounts:
        """How many beads are where."""
        cup = self.cup
        at = (None, None) if cup is None else (cup.position, cup.wxyz)
        return count_beads(self._props, self.bead_positions, *at)

    @property
    def beads_in_cup(self) -> int:
        """How many beads are between the cup's floor and its rim."""
        return self.bead_counts.in_cup

    @property
    def beads_spilt(self) -> int:
        """How many beads came to be outside cup and bowls and below the rims of all bowls."""
        return self.bead_counts.spilt

    def beads_in(self, bowl_name: str) -> int:
        """How many beads are in that bowl.

        Raises:
            InputError: If there is no such bowl.
        """
        names = [bowl.name for bowl in self._props.bowls]
        if bowl_name not in names:
            raise InputError(f"There is no bowl '{bowl_name}' on the table.")
        return self.bead_counts.in_bowls[names.index(bowl_name)]

    @property
    def is_holding(self) -> bool:
        """Whether the cup is in the hand."""
        return self._props.cup is not None and bool(self._mj_data.eq_active[self._grip])

    @property
    def is_touching(self) -> bool:
        """Whether the arm, the hand or the held cup is in contact with the obstacle."""
        if self._props.obstacle is None:
            return False
        contact = self._mj_data.contact
        geoms = contact.geom[(contact.geom == self._obstacle).any(axis=1)]
        bodies = self._mj_model.geom_bodyid[geoms]
        return bool((bodies < self._first_bead).all(axis=1).any())

    def grasp(self) -> bool:
        """Close the fingers on the cup, if it is no further than :data:`GRASP_REACH_M`.

        The cup keeps its place in the hand: it neither jumps nor turns.

        Returns:
            Whether the cup is in the hand now; if not, nothing has changed.
        """
        if self.is_holding:
            return True
        if self._props.cup is None:
            return False
        mujoco.mj_kinematics(self._mj_model, self._mj_data)
        cup, hand = self._props.cup, self.hand
        at = self._mj_data.qpos
        x, y, z = in_frame(hand.position, at[_CUP_POSITION], at[_CUP_WXYZ])
        beside_m = max(0.0, np.hypot(x, y) - cup.radius_m - WALL_M)
        over_m = max(0.0, -z, z - cup.height_m)
        if np.hypot(beside_m, over_m) > GRASP_REACH_M:
            return False
        # Where the hand holds it is a number of the compiled world, which others read: take a copy.
        self._mj_model = copy.copy(self._shared)
        qpos, held = self._mj_data.qpos, self._mj_model.eq_data[self._grip]
        back, turned_back = np.zeros(3), np.zeros(4)
        mujoco.mju_negPose(back, turned_back, hand.position, hand.wxyz)
        mujoco.mju_mulPose(
            held[3:6], held[6:10], back, turned_back, qpos[_CUP_POSITION], qpos[_CUP_WXYZ]
        )
        self._mj_data.eq_active[self._grip] = 1
        self._mj_data.ctrl[N_JOINTS:] = _HOLDING_M
        return True

    def refill(self) -> None:
        """Put the beads back into the cup, at rest in it; the cup should be upright."""
        self._fill()
        mujoco.mj_forward(self._mj_model, self._mj_data)

    # Time.

    def reset(self, q: JointPositions) -> None:
        """Put the arm at ``q`` ``(7,)`` in [rad] and everything else back, at rest."""
        self._mj_model = self._shared
        mujoco.mj_resetData(self._mj_model, self._mj_data)
        qpos, held = self._mj_data.qpos, self.is_holding
        qpos[:N_JOINTS] = q
        self.set_target(q)
        qpos[_FINGERS] = self._mj_data.ctrl[N_JOINTS:] = _HOLDING_M if held else FINGER_OPEN_M
        if held:
            mujoco.mj_kinematics(self._mj_model, self._mj_data)
            hand, at = self.hand, self._mj_model.eq_data[self._grip]
            mujoco.mju_mulPose(
                qpos[_CUP_POSITION], qpos[_CUP_WXYZ], hand.position, hand.wxyz, at[3:6], at[6:10]
            )
        self._fill()
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
        steps = max(1, round(dt_s / self._mj_model.opt.timestep))
        mujoco.mj_step(self._mj_model, self._mj_data, steps)

    def _fill(self) -> None:
        if self._props.cup is None or self._props.beads is None:
            return
        places = settled(self._props.cup, self._props.beads)
        qpos, qvel = self._mj_data.qpos, self._mj_data.qvel
        turned = rotation_matrix(qpos[_CUP_WXYZ])
        qpos[_BEAD_POSITIONS] = (qpos[_CUP_POSITION] + places @ turned.T).ravel()
        linear, spin = qvel[_CUP_VELOCITY][:3], qvel[_CUP_VELOCITY][3:]
        qvel[_BEAD_VELOCITIES] = (linear + np.cross(spin, places) @ turned.T).ravel()
