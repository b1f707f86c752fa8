"""Fetch and pour: Plane until the cup is grasped, then its pouring (the study's Reach & Pour).

The same stick means another thing once the cup is lifted; the hand's height says which.
"""

from .avoid import AVOID
from .base import LEVER_M, Task
from .pour_cup import POUR_CUP

_LIFTED_M = 0.2  # between the height of reaching and that of pouring

FETCH_AND_POUR = Task(
    "fetch-and-pour",
    "Fetch and pour",
    (*AVOID.motions, *POUR_CUP.motions),
    rotation_weight_m=LEVER_M,
    boundary_m=_LIFTED_M,
)
