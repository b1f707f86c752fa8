"""A driver who sees the hand, knows the task, and pushes the stick by their own idea of it."""

from collections.abc import Callable

import numpy as np

from models.demonstrations import DT_S
from models.kinematics import HandPose
from models.simulated_human import SimulatedHuman
from models.tasks.attempt import Attempt, hand_pose
from models.tasks.avoid import GoingRound
from models.tasks.fetch_and_pour import Fetching
from models.tasks.pour_cup import POUR_CUP, PouringTwice

_SPEED_M_S = 0.15
_NEAR_M = 0.012
_AT_M = 0.03  # once they tip, they do not mind to be so far off
_GAIN_PER_S = 3.0
_ROUND_M = 0.115  # how far from the post they go round it
_TIPPED_M = 2.1 * 0.25  # the tilt that empties the cup, in metres of the task
_REACH_M = {"far": 0.60, "near": 0.42, "start": 0.51, "bowl": 0.58}


def stick(person: SimulatedHuman, attempt: Attempt) -> np.ndarray:
    """The stick ``(2,)`` they give now."""
    pose = hand_pose(attempt.simulation.hand)
    h = person.answer(_WISHES[type(attempt)](attempt, pose) * DT_S, pose)
    return np.asarray(h / max(1.0, float(np.linalg.norm(h))))


def _go_round(attempt: GoingRound, pose: HandPose) -> np.ndarray:
    way = pose.position[:2] - np.array([0.5, 0.0])
    apart = np.linalg.norm(way)
    sign = -1.0 if attempt.progress.counts["degrees"] < 360 else 1.0
    along = sign * np.array([-way[1], way[0]]) / apart
    wish: np.ndarray = 0.12 * along + 2.0 * (_ROUND_M - apart) * way / apart
    return wish


def _pour_twice(attempt: PouringTwice, pose: HandPose) -> np.ndarray:
    says = attempt.progress.says
    if "far bowl" in says:
        return _pour(pose, _REACH_M["far"])
    if "near bowl" in says:
        return _pour(pose, _REACH_M["near"])
    return _carry(pose, _REACH_M["start"], 0.0)


def _fetch(attempt: Fetching, pose: HandPose) -> np.ndarray:
    if attempt.stage != "reaching":
        return _pour(pose, _REACH_M["bowl"])
    way = attempt.over - pose.position[:2]
    if np.linalg.norm(way) < _NEAR_M:
        attempt.press()
    return np.asarray(_limited(way))


def _pour(pose: HandPose, reach_m: float) -> np.ndarray:
    """First over the bowl, upright, then tip."""
    return _carry(pose, reach_m, _TIPPED_M)


def _carry(pose: HandPose, reach_m: float, tilt_m: float) -> np.ndarray:
    """To a reach, and there to a tilt; from far away, upright before anything else."""
    reach, tilt = POUR_CUP.dof(pose)
    is_tilted = tilt > 0.05
    if abs(reach - reach_m) < (_AT_M if is_tilted else _NEAR_M):
        return _limited(np.array([reach_m - reach, tilt_m - tilt]))
    return _limited(np.array([0.0 if is_tilted else reach_m - reach, -tilt]))


def _limited(way: np.ndarray) -> np.ndarray:
    return np.clip(_GAIN_PER_S * way, -_SPEED_M_S, _SPEED_M_S)


_WISHES: dict[type[Attempt], Callable[..., np.ndarray]] = {
    GoingRound: _go_round,
    PouringTwice: _pour_twice,
    Fetching: _fetch,
}
