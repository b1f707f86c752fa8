"""What somebody in front of the page sees, and what they make of it: where to go now.

The places of things on the table are those of the picture; phases are the page's.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.kinematics import HandPose
from models.simulation import HandState
from models.tasks.attempt import Attempt, hand_pose
from models.tasks.avoid import AvoidPhase
from models.tasks.fetch_and_pour import FETCH_AND_POUR, FetchPhase
from models.tasks.pour_cup import POUR_CUP, PourCupPhase

_SPEED_M_S = 0.15
_NEAR_M = 0.012
_AT_M = 0.03  # once they tip, they do not mind to be so far off
_GAIN_PER_S = 3.0
_POST = np.array([0.5, 0.0])
_ROUND_M = 0.115  # how far from the post they go round it
_TIPPED_M = 2.1 * 0.25  # the tilt that empties the cup, in metres of the task
_REACH_M = {"far": 0.60, "near": 0.42, "start": 0.51, "bowl": 0.58}


@dataclass(frozen=True)
class Sight:
    """What is seen at one time.

    Attributes:
        hand: Where the hand is.
        phase: The attempt's.
        can_grasp: Whether the button would grasp something.
        is_by_itself: Whether the arm moves by itself.
    """

    hand: HandPose
    phase: str
    can_grasp: bool = False
    is_by_itself: bool = False

    @classmethod
    def of(cls, attempt: Attempt) -> "Sight":
        """Without a page."""
        pose, phase = hand_pose(attempt.simulation.hand), attempt.progress.phase
        return cls(pose, phase, attempt.can_grasp, attempt.way is not None)

    @classmethod
    def of_status(cls, status: dict[str, Any]) -> "Sight":
        """On a page, which is told so."""
        progress, is_by_itself = status["progress"], status["hold"] == "by-itself"
        return cls(hand_of(status), progress["phase"], progress["can_grasp"], is_by_itself)


def hand_of(status: dict[str, Any]) -> HandPose:
    """Where the page shows the hand."""
    return hand_pose(HandState(np.array(status["hand"]), np.array(status["hand_wxyz"])))


def wish(task: str, sight: Sight) -> np.ndarray:
    """Where they want the hand to go now: ``(2,)`` in the task's degrees of freedom, [m/s].

    While the arm moves by itself they wait.
    """
    return np.zeros(2) if sight.is_by_itself else _WISHES[task](sight)


def wish_from(task: str, sight: Sight) -> Callable[[HandPose], np.ndarray]:
    """The same for wherever they believe that the hand is by now."""
    return lambda hand: wish(task, replace(sight, hand=hand))


def presses(sight: Sight) -> bool:
    """Whether they press the button now: over the cup, not at its edge."""
    return sight.can_grasp and bool(np.linalg.norm(_to_cup(sight)) < 2 * _NEAR_M)


def _go_round(sight: Sight) -> np.ndarray:
    way = sight.hand.position[:2] - _POST
    apart = np.linalg.norm(way)
    sign = -1.0 if sight.phase == AvoidPhase.CLOCKWISE else 1.0
    along = sign * np.array([-way[1], way[0]]) / apart
    wanted: np.ndarray = 0.12 * along + 2.0 * (_ROUND_M - apart) * way / apart
    return wanted


def _pour_twice(sight: Sight) -> np.ndarray:
    if sight.phase == PourCupPhase.POUR_FAR:
        return _pour(sight, _REACH_M["far"])
    if sight.phase == PourCupPhase.POUR_NEAR:
        return _pour(sight, _REACH_M["near"])
    return _carry(sight, _REACH_M["start"], 0.0)


def _fetch(sight: Sight) -> np.ndarray:
    if sight.phase != FetchPhase.REACH:
        return _pour(sight, _REACH_M["bowl"])
    return _limited(_to_cup(sight))


def _to_cup(sight: Sight) -> np.ndarray:
    cup = FETCH_AND_POUR.props.cup
    assert cup is not None
    assert cup.place is not None
    way: np.ndarray = np.subtract(cup.place, cup.in_hand[:2]) - sight.hand.position[:2]
    return way


def _pour(sight: Sight, reach_m: float) -> np.ndarray:
    """First over the bowl, upright, then tip."""
    return _carry(sight, reach_m, _TIPPED_M)


def _carry(sight: Sight, reach_m: float, tilt_m: float) -> np.ndarray:
    """To a reach, and there to a tilt; from far away, upright before anything else."""
    reach, tilt = POUR_CUP.dof(sight.hand)
    is_tilted = tilt > 0.05
    if abs(reach - reach_m) < (_AT_M if is_tilted else _NEAR_M):
        return _limited(np.array([reach_m - reach, tilt_m - tilt]))
    return _limited(np.array([0.0 if is_tilted else reach_m - reach, -tilt]))


def _limited(way: np.ndarray) -> np.ndarray:
    return np.clip(_GAIN_PER_S * way, -_SPEED_M_S, _SPEED_M_S)


_WISHES: dict[str, Callable[[Sight], np.ndarray]] = {
    "avoid": _go_round,
    "pour-cup": _pour_twice,
    "fetch-and-pour": _fetch,
}
