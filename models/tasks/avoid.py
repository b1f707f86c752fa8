"""Avoid: the hand goes round an obstacle in a horizontal plane (the user study's first task)."""

import numpy as np

from ..arrays import JointPositions
from .base import Task
from .plane import PlaneMotion

_HEIGHT_M = 0.12


def _in_front() -> JointPositions:
    # The hand at x = 0.5 m, y = 0, z = 0.12 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, 0.22207, 0.0, -2.40113, 0.0, 2.62320, np.pi / 4])


AVOID = Task(
    "avoid",
    "Go round",
    (PlaneMotion(height_m=_HEIGHT_M, home_q=_in_front()),),
    rotation_weight_m=0.0,
)
