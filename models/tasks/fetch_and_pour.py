"""Fetch and pour: Plane until the cup is grasped, then its pouring (the study's Reach & Pour).

The same stick means another thing once the cup is lifted; the hand's height says which.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from ..arrays import JointPositions
from ..demonstrations import joints_at
from ..kinematics import Kinematics
from ..props import Props
from ..simulation import Simulation
from .attempt import Attempt, Progress
from .avoid import AVOID
from .base import LEVER_M, Task
from .pour_cup import BEADS, CUP, POUR_CUP, Pouring, bowl_at

_LIFTED_M = 0.2  # between the height of reaching and that of pouring
_PLACE = (0.50, 0.15)  # of the cup
_BOWL = "bowl"
_BOWL_REACH_M = 0.58  # the hand's reach to pour into it
_START = (np.array([0.38, -0.22]), np.array([0.62, 0.0]))  # where the hand begins: low, high
# The button grasps when the hand is this near to where it takes the cup, seen from above.
GRASP_M = 0.035
# Arm positions this near to where they should be have arrived, in [rad].
_ARRIVED_RAD = 0.02

Stage = Literal["reaching", "lowering", "lifting", "pouring"]


class Fetching(Attempt):
    """Reach the cup, grasp it, and pour it into the bowl."""

    def __init__(self, simulation: Simulation, kinematics: Kinematics) -> None:
        """Begin with the cup on the table and the hand free."""
        super().__init__(simulation)
        self.stage: Stage = "reaching"
        self._pouring = Pouring(simulation, bowl=0)
        down, lift = AVOID.motions[0], POUR_CUP.motions[0]
        self.over = np.array(_PLACE) - np.array(CUP.in_hand[:2])
        over = joints_at(down, kinematics, self.over[None])[0]
        grip = replace(down, height_m=CUP.in_hand[2], home_q=over)  # type: ignore[type-var]
        self._grip_q: JointPositions = joints_at(grip, kinematics, self.over[None])[0]
        self._lifted_q: JointPositions = joints_at(
            lift, kinematics, np.array([[self.over[0], 0.0]])
        )[0]

    def watch(self, dt_s: float) -> None:
        """Go on from stage to stage."""
        if self.stage == "lowering" and self._is_at(self._grip_q) and self.simulation.grasp():
            self.stage = "lifting"
        elif self.stage == "lifting" and self._is_at(self._lifted_q):
            self.stage = "pouring"
        elif self.stage == "pouring":
            self._pouring.watch(dt_s)

    @property
    def can_grasp(self) -> bool:
        """Whether the hand is over the cup and free."""
        apart = np.linalg.norm(self.simulation.hand.position[:2] - self.over)
        return bool(self.stage == "reaching" and apart < GRASP_M)

    def press(self) -> str | None:
        """Grasp the cup, if the hand is over it."""
        if self.stage != "reaching":
            return "The cup is in the hand already."
        if not self.can_grasp:
            return "There is nothing to grasp here: bring the hand to the cup."
        self.stage = "lowering"
        return None

    @property
    def way(self) -> JointPositions | None:
        """Down to the cup, and up with it."""
        goals = {"lowering": self._grip_q, "lifting": self._lifted_q}
        return goals.get(self.stage)

    @property
    def progress(self) -> Progress:
        """The cup, and what is in the bowl."""
        is_done = self.stage == "pouring" and self._pouring.is_empty
        is_success = is_done and self._pouring.is_enough
        poured = self._pouring.poured
        if is_done:
            says = "Done: the bowl is served." if is_success else "Over: too much went astray."
        elif self.stage == "reaching":
            says = "Bring the hand to the cup, then grasp it."
        elif self.stage == "pouring":
            says = "Pour the cup into the bowl."
        else:
            says = "The hand takes the cup."
        reached = 0.0 if self.stage == "reaching" else 0.4
        return Progress(
            fraction=1.0 if is_success else reached + 0.6 * poured / BEADS.count,
            says=says,
            counts={"bowl": poured, "spilt": self._pouring.spilt},
            is_done=is_done,
            is_success=is_success,
        )

    def _is_at(self, q: JointPositions) -> bool:
        return bool(np.max(np.abs(self.simulation.q - q)) < _ARRIVED_RAD)


def begin(simulation: Simulation, kinematics: Kinematics, rng: np.random.Generator) -> Attempt:
    """Put the cup in its place and the hand anywhere on the other side."""
    at = rng.uniform(*_START)
    simulation.reset(joints_at(AVOID.motions[0], kinematics, at[None])[0])
    return Fetching(simulation, kinematics)


FETCH_AND_POUR = Task(
    "fetch-and-pour",
    "Fetch and pour",
    (*AVOID.motions, *POUR_CUP.motions),
    rotation_weight_m=LEVER_M,
    boundary_m=_LIFTED_M,
    props=Props(
        bowls=(bowl_at(_BOWL, _BOWL_REACH_M),), cup=replace(CUP, place=_PLACE), beads=BEADS
    ),
    begin=begin,
)
