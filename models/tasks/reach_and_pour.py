"""Reach & Pour: Plane until the bottle, then Pour (the paper's hardest task).

The same stick means another thing once the bottle is lifted; the state says which.
"""

import numpy as np

from ..arrays import JointPositions
from .base import LEVER_M, Task
from .plane import PlaneMotion
from .pour import PourMotion

_REACH_HEIGHT_M = 0.15
_BOTTLE = (0.55, 0.1)
# Pouring begins a little above where the bottle stands.
_LIFTED_M = 0.185


def _before_the_bottle() -> JointPositions:
    # The hand at x = 0.5 m, y = 0, z = 0.15 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, 0.15133, 0.0, -2.39803, 0.0, 2.54936, np.pi / 4])


def _over_the_bottle() -> JointPositions:
    # The hand over the bottle at z = 0.34 m.
    return np.array([0.09235, 0.02481, 0.08821, -2.00585, -0.00244, 2.03056, 0.96701])


def _low_and_high_above() -> tuple[np.ndarray, np.ndarray]:
    return np.array([0.23, -1.2 * LEVER_M]), np.array([0.45, 1.2 * LEVER_M])


REACH_AND_POUR = Task(
    "reach-and-pour",
    (
        PlaneMotion(height_m=_REACH_HEIGHT_M, home_q=_before_the_bottle()),
        PourMotion(over=_BOTTLE, home_q=_over_the_bottle(), workspace=_low_and_high_above()),
    ),
    rotation_weight_m=LEVER_M,
    boundary_m=_LIFTED_M,
)
