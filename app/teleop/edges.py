"""How far a task lets the hand go, and a little farther."""

import math

import numpy as np

from models.arrays import JointVelocities, LatentAction
from models.controller import LatentController
from models.demonstrations import TwoDofMotion
from models.kinematics import HandPose
from models.panda import QD_MAX
from models.simulation import Simulation
from models.tasks import Task
from models.tasks.attempt import hand_pose

_EDGE_MARGIN_M = 0.02  # over the edge of the task's area
_OFF_MARGIN_M = 0.06  # off the way that the task holds the hand to
_SLIP_M = 2e-4  # in a tick; the curvature that sliding may leave


def keep_inside(
    task: Task,
    simulation: Simulation,
    controller: LatentController,
    z: LatentAction,
    dt_s: float,
) -> tuple[LatentAction, JointVelocities, bool]:
    """The nearest latent action that takes the hand no further out than it may go.

    At an edge the hand slides along it: nobody is caught there by a push that leads out a little.

    Returns:
        The latent action, its joint velocities ``(7,)`` in [rad/s] within the arm's speed, and
        whether it is another than ``z``.
    """
    s = simulation.q
    a = _possible(controller.decode(z, s))
    here = hand_pose(simulation.hand)
    motion = task.motions[int(task.motion_at(here))]
    low, high = motion.workspace
    at, off_m = _place(motion, here)
    over, under = at > high + _EDGE_MARGIN_M, at < low - _EDGE_MARGIN_M
    is_off = off_m > _OFF_MARGIN_M
    if not (is_off or over.any() or under.any()):
        return z, a, False
    then, off_then_m = _place(motion, _pose_after(simulation, a, dt_s))
    if is_off and off_then_m > off_m:
        return np.zeros(2), np.zeros(7), True
    farther = (over & (then > at)) | (under & (then < at))
    if not farther.any():
        return z, a, False
    to_dof = np.linalg.pinv(motion.axes) @ simulation.hand_jacobian @ controller.secant(s)
    along = z - np.linalg.pinv(to_dof) @ np.where(farther, to_dof @ z, 0.0)
    a = _possible(controller.decode(along, s))
    then, off_then_m = _place(motion, _pose_after(simulation, a, dt_s))
    slips = (over & (then > at + _SLIP_M)) | (under & (then < at - _SLIP_M))
    if farther.all() or slips.any() or (is_off and off_then_m > off_m):
        return np.zeros(2), np.zeros(7), True
    return along, a, True


def _possible(a: JointVelocities) -> JointVelocities:
    # One factor for all joints, so that the hand keeps its direction.
    slower: np.ndarray = a / max(1.0, float(np.max(np.abs(a) / QD_MAX)))
    return slower


def _pose_after(simulation: Simulation, a: JointVelocities, dt_s: float) -> HandPose:
    return hand_pose(simulation.pose_at(simulation.q + a * dt_s))


def _place(motion: TwoDofMotion, pose: HandPose) -> tuple[np.ndarray, float]:
    """Where the hand is in a motion's degrees of freedom, and how far off its way, in [m]."""
    at = motion.dof(pose)
    return at, math.dist(pose.position, motion.pose_at(at).position)
