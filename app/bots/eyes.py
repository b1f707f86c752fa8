"""What somebody in front of the page sees, and what they make of it: where to go now.

All that is known of an attempt is what the page is told: its phase, and what stands on the table.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.kinematics import HandPose
from models.simulation import HandState
from models.tasks.attempt import Attempt, hand_pose
from models.tasks.avoid import AvoidPhase
from models.tasks.base import LEVER_M
from models.tasks.fetch_and_pour import FetchPhase
from models.tasks.pour_cup import POUR_CUP, PourCupPhase

Props = dict[str, Any]  # as in a page's session

_SPEED_M_S = 0.15
_NEAR_M = 0.012
_AT_M = 0.03  # once they tip, they do not mind to be so far off
_GAIN_PER_S = 3.0
_CLEARANCE_M = 0.07  # how far from the post's side they go round it
_TIPPED_M = 2.1 * LEVER_M  # the tilt that empties the cup, in metres of the task


@dataclass(frozen=True)
class Sight:
    """What is seen at one time.

    Attributes:
        hand: Where the hand is.
        phase: The attempt's.
        props: What stands on the table.
        can_grasp: Whether the button would grasp something.
        is_by_itself: Whether the arm moves by itself.
    """

    hand: HandPose
    phase: str
    props: Props
    can_grasp: bool = False
    is_by_itself: bool = False

    @classmethod
    def of(cls, attempt: Attempt, props: Props) -> "Sight":
        """Without a page."""
        pose, phase = hand_pose(attempt.simulation.hand), attempt.progress.phase
        return cls(pose, phase, props, attempt.can_grasp, attempt.way is not None)

    @classmethod
    def of_status(cls, status: dict[str, Any], props: Props) -> "Sight":
        """On a page, which is told so."""
        progress, is_by_itself = status["progress"], status["hold"] == "by-itself"
        return cls(hand_of(status), progress["phase"], props, progress["can_grasp"], is_by_itself)


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
    post = sight.props["obstacle"]
    way = sight.hand.position[:2] - np.array(post["position"])
    apart = np.linalg.norm(way)
    sign = -1.0 if sight.phase == AvoidPhase.CLOCKWISE else 1.0
    along = sign * np.array([-way[1], way[0]]) / apart
    round_m = post["radius_m"] + _CLEARANCE_M
    wanted: np.ndarray = 0.12 * along + 2.0 * (round_m - apart) * way / apart
    return wanted


def _pour_twice(sight: Sight) -> np.ndarray:
    near, far = sorted(_reaches(sight))
    if sight.phase == PourCupPhase.POUR_FAR:
        return _pour(sight, far)
    if sight.phase == PourCupPhase.POUR_NEAR:
        return _pour(sight, near)
    return _carry(sight, (near + far) / 2, 0.0)


def _fetch(sight: Sight) -> np.ndarray:
    if sight.phase != FetchPhase.REACH:
        return _pour(sight, *_reaches(sight))
    return _limited(_to_cup(sight))


def _reaches(sight: Sight) -> list[float]:
    """Where the hand's x is when the cup is over each bowl, in [m]."""
    ahead = sight.props["cup"]["in_hand"][0]
    return [bowl["position"][0] - ahead for bowl in sight.props["bowls"]]


def _to_cup(sight: Sight) -> np.ndarray:
    cup = sight.props["cup"]
    way: np.ndarray = np.subtract(cup["place"], cup["in_hand"][:2]) - sight.hand.position[:2]
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
