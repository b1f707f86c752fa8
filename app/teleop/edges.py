"""How far a task lets the hand go, and a little farther."""

import math

import numpy as np

from models.demonstrations import TwoDofMotion
from models.kinematics import HandPose
from models.simulation import Simulation
from models.tasks import Task
from models.tasks.attempt import hand_pose

_EDGE_MARGIN_M = 0.02  # over the edge of the task's area
_OFF_MARGIN_M = 0.06  # off the way that the task holds the hand to


def leaves(task: Task, simulation: Simulation, a: np.ndarray, dt_s: float) -> bool:
    """Whether joint velocities ``a`` ``(7,)`` take the hand further out than it may go."""
    here = hand_pose(simulation.hand)
    motion = task.motions[int(task.motion_at(here))]
    low, high = motion.workspace
    at, off_m = _place(motion, here)
    over, under = at > high + _EDGE_MARGIN_M, at < low - _EDGE_MARGIN_M
    is_off = off_m > _OFF_MARGIN_M
    if not (is_off or over.any() or under.any()):
        return False
    there = hand_pose(simulation.pose_at(simulation.q + a * dt_s))
    then, off_then_m = _place(motion, there)
    farther = (over & (then > at)) | (under & (then < at))
    return bool(farther.any() or (is_off and off_then_m > off_m))


def _place(motion: TwoDofMotion, pose: HandPose) -> tuple[np.ndarray, float]:
    """Where the hand is in a motion's degrees of freedom, and how far off its way, in [m]."""
    at = motion.dof(pose)
    return at, math.dist(pose.position, motion.pose_at(at).position)
