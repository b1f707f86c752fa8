"""Avoid: the hand goes round an obstacle and back without touching it (the user study's first)."""

import numpy as np

from ..arrays import JointPositions
from ..demonstrations import joints_at
from ..kinematics import Kinematics
from ..props import Obstacle, Props
from ..simulation import Simulation
from .attempt import Attempt, Phase, Progress
from .base import Task
from .plane import PlaneMotion

_HEIGHT_M = 0.12
_OBSTACLE = Obstacle((0.5, 0.0), radius_m=0.045, height_m=0.15)
_START_M = 0.11  # from the obstacle's middle, where an attempt begins
_TURN_DEG = 360.0
# A touch ends when nothing has touched for so long; one bump is not counted five times.
LET_GO_S = 0.3


def _in_front() -> JointPositions:
    # The hand at x = 0.5 m, y = 0, z = 0.12 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, 0.22207, 0.0, -2.40113, 0.0, 2.62320, np.pi / 4])


class AvoidPhase(Phase):
    """Which of the two turns, seen from above."""

    CLOCKWISE = "clockwise"
    COUNTER_CLOCKWISE = "counter-clockwise"
    DONE = "done"


class GoingRound(Attempt):
    """One turn clockwise, seen from above, then one counter-clockwise; touches are counted."""

    def __init__(self, simulation: Simulation) -> None:
        """Begin where the hand is."""
        super().__init__(simulation)
        self.touches = 0
        self._turned_deg = [0.0, 0.0]  # of the two turns, each in its own direction
        self._untouched_s = np.inf
        self._bearing_deg = self._bearing()

    def watch(self, dt_s: float) -> None:
        """Add up the angle about the obstacle, and the touches."""
        bearing = self._bearing()
        moved = (bearing - self._bearing_deg + 180.0) % 360.0 - 180.0
        self._bearing_deg = bearing
        if not self.progress.is_done:
            turn = 0 if self._turned_deg[0] < _TURN_DEG else 1
            forth = -moved if turn == 0 else moved
            # Who set out the wrong way turns round and begins; nothing is to be unwound.
            self._turned_deg[turn] = max(0.0, self._turned_deg[turn] + forth)
        if self.simulation.is_touching:
            self.touches += self._untouched_s > LET_GO_S
            self._untouched_s = 0.0
        else:
            self._untouched_s += dt_s

    @property
    def progress(self) -> Progress:
        """Degrees of both turns."""
        first, second = (min(turned, _TURN_DEG) for turned in self._turned_deg)
        is_done = second >= _TURN_DEG
        if is_done:
            phase = AvoidPhase.DONE
        elif first >= _TURN_DEG:
            phase = AvoidPhase.COUNTER_CLOCKWISE
        else:
            phase = AvoidPhase.CLOCKWISE
        return Progress(
            phase=phase,
            fraction=(first + second) / (2 * _TURN_DEG),
            counts={"degrees": int(first + second), "touches": self.touches},
            is_done=is_done,
            is_success=is_done,
        )

    def _bearing(self) -> float:
        x, y = self.simulation.hand.position[:2] - np.array(_OBSTACLE.position)
        return float(np.degrees(np.arctan2(y, x)))


def begin(simulation: Simulation, kinematics: Kinematics, rng: np.random.Generator) -> GoingRound:
    """Put the hand beside the post, anywhere about it."""
    angle = rng.uniform(0.0, 2 * np.pi)
    at = np.array(_OBSTACLE.position) + _START_M * np.array([np.cos(angle), np.sin(angle)])
    simulation.reset(joints_at(AVOID.motions[0], kinematics, at[None])[0])
    return GoingRound(simulation)


AVOID = Task(
    "avoid",
    (PlaneMotion(height_m=_HEIGHT_M, home_q=_in_front()),),
    rotation_weight_m=0.0,
    props=Props(obstacle=_OBSTACLE),
    begin=begin,
    phases=AvoidPhase,
)
