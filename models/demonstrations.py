"""Moves of the arm through random way-points: what the controller is learned from.

Damped least squares drives the hand towards way-points in the task's two degrees of freedom. The
hand is pulled back to the task (and the posture to the home posture) *in proportion to its speed*:
the action is then a function of the state and of two numbers, and nothing moves when they are zero.
"""

import hashlib
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from .arrays import DofChange, JointPositions
from .errors import ShapeError
from .kinematics import HandPose, Kinematics, turn
from .panda import N_JOINTS, Q_MAX, Q_MIN

DT_S = 0.1  # the paper's step size dt
MAX_SPEED_M_S = 0.2
# One way-point after another; the hand turns to the next one when it is this close, in [m].
_ARRIVED_M = 0.03
# Way-points lie in the workspace and a little beyond, so that its edge is no edge of the data.
BEYOND_M = 0.04
_DAMPING = 1e-3
# Travel after which an error has shrunk by e: 0.1 m for the hand, 0.17 m for the posture.
_RETURN_PER_M = 10.0
_POSTURE_RETURN_PER_M = 6.0
# How far beside the task a disturbed trajectory may start (standard deviations; clipped at 2).
_OFF_LENGTH_M = 0.02
_OFF_ANGLE_RAD = 0.07
_OFF_POSTURE_RAD = 0.15
_TURN_SD = 0.2  # how much a trajectory's speed wanders


@runtime_checkable
class TwoDofMotion(Protocol):
    """Where the hand may go in two degrees of freedom."""

    @property
    def home_q(self) -> JointPositions:
        """Where the arm starts, ``(7,)`` in [rad]."""
        ...

    @property
    def workspace(self) -> tuple[np.ndarray, np.ndarray]:
        """Low and high corner, each ``(2,)``, of where the hand may be in the two DoF."""
        ...

    @property
    def axes(self) -> np.ndarray:
        """The hand's velocity (linear, angular) per unit of each DoF, ``(6, 2)``."""
        ...

    def dof(self, pose: HandPose) -> DofChange:
        """Where a pose is in the two DoF."""
        ...

    def pose_at(self, dof: DofChange) -> HandPose:
        """The pose that the motion asks for at a point of its two DoF."""
        ...


@dataclass(frozen=True)
class Demonstrations:
    """States ``(t, n, 7)`` in [rad] and actions ``(t, n, 7)`` in [rad/s] of t trajectories.

    Raises:
        ShapeError: If they disagree.
    """

    states: JointPositions
    actions: JointPositions
    dt_s: float = DT_S

    def __post_init__(self) -> None:
        """Check the shapes."""
        if self.states.ndim != 3 or self.states.shape != self.actions.shape:
            raise ShapeError(
                f"States {self.states.shape} and actions {self.actions.shape} must both be "
                "(trajectories, steps, 7)."
            )

    @property
    def content_hash(self) -> str:
        """SHA-256 of the arrays."""
        digest = hashlib.sha256(repr((self.states.shape, self.dt_s)).encode())
        digest.update(np.ascontiguousarray(self.states).tobytes())
        digest.update(np.ascontiguousarray(self.actions).tobytes())
        return digest.hexdigest()

    def split(self, held_out: float) -> tuple["Demonstrations", "Demonstrations"]:
        """Whole trajectories to learn from, and the last share ``held_out`` of them to judge by."""
        kept = len(self.states) - max(1, round(held_out * len(self.states)))
        return (
            Demonstrations(self.states[:kept], self.actions[:kept], self.dt_s),
            Demonstrations(self.states[kept:], self.actions[kept:], self.dt_s),
        )

    def pairs(self) -> tuple[JointPositions, JointPositions]:
        """All states and all actions, each ``(t * n, 7)``."""
        return self.states.reshape(-1, N_JOINTS), self.actions.reshape(-1, N_JOINTS)


def way_point_demonstrations(
    motion: TwoDofMotion,
    kinematics: Kinematics,
    rng: np.random.Generator,
    trajectories: int,
    steps: int,
    *,
    disturbed: bool,
) -> Demonstrations:
    """Drive from random places through random way-points at random speeds.

    Args:
        motion: Where the hand may go.
        kinematics: The arm.
        rng: All chance.
        trajectories: How many trajectories.
        steps: How many steps each.
        disturbed: Whether they start beside the motion's poses, each by a random amount.
    """
    low, high = motion.workspace[0] - BEYOND_M, motion.workspace[1] + BEYOND_M
    q = joints_at(motion, kinematics, rng.uniform(low, high, (trajectories, 2)))
    if disturbed:
        q = _disturb(motion, kinematics, q, rng)
    target = rng.uniform(low, high, (trajectories, 2))
    speed = rng.uniform(0.1, 1.0, trajectories) * MAX_SPEED_M_S
    states = np.empty((trajectories, steps, N_JOINTS))
    actions = np.empty_like(states)
    for step in range(steps):
        pose = kinematics.hand_pose(q)
        way = target - motion.dof(pose)
        distance = np.linalg.norm(way, axis=-1)
        arrived = distance < _ARRIVED_M
        target[arrived] = rng.uniform(low, high, (int(arrived.sum()), 2))
        way = target - motion.dof(pose)
        distance = np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
        drift = speed * (1.0 + _TURN_SD * rng.standard_normal(trajectories))
        pace = np.clip(drift, 0.0, np.minimum(MAX_SPEED_M_S, distance / (2 * DT_S)))
        velocity = way / distance[:, None] * pace[:, None]
        states[:, step] = q
        actions[:, step] = _action(motion, kinematics, q, pose, velocity)
        q = np.clip(q + actions[:, step] * DT_S, Q_MIN, Q_MAX)
    return Demonstrations(states, actions)


def joints_at(motion: TwoDofMotion, kinematics: Kinematics, dof: DofChange) -> JointPositions:
    """Joint positions that put the hand at points of the two DoF, found from home."""
    q = np.broadcast_to(motion.home_q, (*dof.shape[:-1], N_JOINTS)).copy()
    goal = motion.pose_at(dof)
    for _ in range(40):
        pose = kinematics.hand_pose(q)
        step, null = _least_squares(kinematics, q, 0.5 * _error(pose, goal))
        q = np.clip(q + step + _project(null, 0.3 * (motion.home_q - q)), Q_MIN, Q_MAX)
    for _ in range(6):  # and the last of the error, without the posture
        step, _ = _least_squares(kinematics, q, _error(kinematics.hand_pose(q), goal))
        q = np.clip(q + step, Q_MIN, Q_MAX)
    return q


def _action(
    motion: TwoDofMotion,
    kinematics: Kinematics,
    q: np.ndarray,
    pose: HandPose,
    velocity: np.ndarray,
) -> np.ndarray:
    pace = np.linalg.norm(velocity, axis=-1, keepdims=True)
    off = _error(pose, motion.pose_at(motion.dof(pose)))
    twist = velocity @ motion.axes.T + _RETURN_PER_M * pace * off
    action, null = _least_squares(kinematics, q, twist)
    posture = _POSTURE_RETURN_PER_M * pace * (motion.home_q - q)
    towards: np.ndarray = action + _project(null, posture)
    return towards


def _disturb(
    motion: TwoDofMotion, kinematics: Kinematics, q: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    amount = rng.uniform(0.0, 1.0, (len(q), 1))
    deviate = np.clip(rng.standard_normal((len(q), 6)), -2.0, 2.0)
    # Along its own degrees of freedom the motion is nowhere beside itself.
    size = np.repeat([_OFF_LENGTH_M, _OFF_ANGLE_RAD], 3) * np.all(motion.axes == 0.0, axis=1)
    step, null = _least_squares(kinematics, q, amount * deviate * size)
    posture = np.clip(rng.standard_normal(q.shape), -2.0, 2.0) * _OFF_POSTURE_RAD
    beside: np.ndarray = np.clip(q + step + _project(null, amount * posture), Q_MIN, Q_MAX)
    return beside


def _least_squares(
    kinematics: Kinematics, q: np.ndarray, twist: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joint velocities for a velocity of the hand ``(t, 6)``, and the null space's projector."""
    jacobian = kinematics.jacobian(q)
    square = jacobian @ np.swapaxes(jacobian, -1, -2) + _DAMPING * np.eye(6)
    inverse = np.swapaxes(np.linalg.solve(square, jacobian), -1, -2)
    return (inverse @ twist[..., None])[..., 0], np.eye(N_JOINTS) - inverse @ jacobian


def _project(null: np.ndarray, wish: np.ndarray) -> np.ndarray:
    projected: np.ndarray = (null @ wish[..., None])[..., 0]
    return projected


def _error(pose: HandPose, goal: HandPose) -> np.ndarray:
    """What is missing from ``pose`` to ``goal``: linear [m], angular [rad], ``(..., 6)``."""
    return np.concatenate(
        [goal.position - pose.position, turn(pose.rotation, goal.rotation)], axis=-1
    )
