"""Fetch and pour: Plane until the cup is grasped, then its pouring (the study's Reach & Pour).

The same stick means another thing once the cup is lifted; the hand's height says which.
"""

from dataclasses import replace

import numpy as np

from ..arrays import JointPositions
from ..demonstrations import joints_at
from ..kinematics import Kinematics
from ..props import Props
from ..simulation import Simulation
from .attempt import Attempt, NoGrasp, Phase, Progress
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


class FetchPhase(Phase):
    """From the cup to the bowl, and how it ended."""

    REACH = "reach"
    LOWER = "lower"  # to the cup, by itself
    LIFT = "lift"  # with the cup, by itself
    POUR = "pour"
    DONE = "done"
    SPILT = "spilt"  # too little is in the bowl


class Fetching(Attempt):
    """Reach the cup, grasp it, and pour it into the bowl."""

    def __init__(self, simulation: Simulation, kinematics: Kinematics) -> None:
        """Begin with the cup on the table and the hand free."""
        super().__init__(simulation)
        self.stage = FetchPhase.REACH
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
        if self.stage == FetchPhase.LOWER and self._is_at(self._grip_q) and self.simulation.grasp():
            self.stage = FetchPhase.LIFT
        elif self.stage == FetchPhase.LIFT and self._is_at(self._lifted_q):
            self.stage = FetchPhase.POUR
        elif self.stage == FetchPhase.POUR:
            self._pouring.watch(dt_s)

    @property
    def can_grasp(self) -> bool:
        """Whether the hand is over the cup and free."""
        apart = np.linalg.norm(self.simulation.hand.position[:2] - self.over)
        return bool(self.stage == FetchPhase.REACH and apart < GRASP_M)

    def press(self) -> NoGrasp | None:
        """Grasp the cup, if the hand is over it."""
        if self.stage != FetchPhase.REACH:
            return NoGrasp.ALREADY_HELD
        if not self.can_grasp:
            return NoGrasp.OUT_OF_REACH
        self.stage = FetchPhase.LOWER
        return None

    @property
    def way(self) -> JointPositions | None:
        """Down to the cup, and up with it."""
        goals = {FetchPhase.LOWER: self._grip_q, FetchPhase.LIFT: self._lifted_q}
        return goals.get(self.stage)

    @property
    def progress(self) -> Progress:
        """The cup, and what is in the bowl."""
        is_done = self.stage == FetchPhase.POUR and self._pouring.is_empty
        is_success = is_done and self._pouring.is_enough
        poured = self._pouring.poured
        phase = self.stage
        if is_done:
            phase = FetchPhase.DONE if is_success else FetchPhase.SPILT
        reached = 0.0 if self.stage == FetchPhase.REACH else 0.4
        return Progress(
            phase=phase,
            fraction=1.0 if is_success else reached + 0.6 * poured / BEADS.count,
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
    (*AVOID.motions, *POUR_CUP.motions),
    rotation_weight_m=LEVER_M,
    boundary_m=_LIFTED_M,
    props=Props(
        bowls=(bowl_at(_BOWL, _BOWL_REACH_M),), cup=replace(CUP, place=_PLACE), beads=BEADS
    ),
    begin=begin,
    phases=FetchPhase,
)
