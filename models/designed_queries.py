"""Questions chosen so that few answers suffice, in the order in which to ask them.

What a person's answers will say about their map (:mod:`reading`) depends on the moves alone, not
on the answers: the questions can be chosen before the person is met. Each next question is the one
that leaves the least variance, on average, over moves as the pool has them (Cohn 1996, "Neural
network exploration using optimal experiment design"; I-optimality). Whatever is rare in the pool
counts little there, so that outliers are not asked about; and two questions along the same line
say nothing about mirroring, so that lines are crossed early.
"""

import numpy as np

from .errors import InputError
from .kinematics import Kinematics
from .queries import QueryPool, long_step
from .reading import nearness
from .tasks import Task

# Moves that can be seen well, and whose answer still has room for noise within the stick.
_SHORTEST, _LONGEST = 0.3, 0.8
_CANDIDATES, _TARGETS = 300, 150
# What is not known beforehand: standard deviations in steps of full stick.
_DRIFT = 0.15  # of the map over the workspace
_CURVE = 0.3  # of the response's exponent
_NOISE = 0.15  # of an answer


def design_queries(
    task: Task,
    kinematics: Kinematics,
    pool: QueryPool,
    k: int,
    rng: np.random.Generator,
    allowed: np.ndarray | None = None,
) -> list[int]:
    """Which samples of a pool to ask about, best first.

    Args:
        task: Whose moves are asked about.
        kinematics: The arm.
        pool: The samples.
        k: How many.
        rng: Draws the candidates.
        allowed: Rows that may be asked about; all if None.

    Raises:
        InputError: If fewer than ``k`` samples fit.
    """
    before = kinematics.hand_pose(pool.states)
    u = _steps(task, kinematics, pool)
    length = np.abs(u)
    candidates = rng.permutation(designable(task, kinematics, pool, allowed))[:_CANDIDATES]
    if not 0 < k <= len(candidates):
        raise InputError(f"{k} questions were asked for; the pool has {len(candidates)} that fit.")
    seen = np.flatnonzero(length > 0.05)
    rows = np.concatenate([candidates, rng.choice(seen, min(_TARGETS, len(seen)), replace=False)])
    f = u[rows] / length[rows]
    left = _covariance(f, length[rows], task.dof(before)[rows], task.motion_at(before)[rows])
    chosen: list[int] = []
    targets = slice(len(candidates), None)
    for _ in range(k):
        variance = np.real(np.diagonal(left))[: len(candidates)] + _NOISE**2
        gain = np.sum(np.abs(left[: len(candidates), targets]) ** 2, axis=1) / variance
        gain[chosen] = -1.0
        best = int(np.argmax(gain))
        chosen.append(best)
        column = left[:, best]
        left = left - np.outer(column, column.conj()) / variance[best]
    return [int(row) for row in candidates[chosen]]


def designable(
    task: Task, kinematics: Kinematics, pool: QueryPool, allowed: np.ndarray | None = None
) -> np.ndarray:
    """The rows of the samples that :func:`design_queries` may choose from; arguments as there."""
    length = np.abs(_steps(task, kinematics, pool))
    fit = (length >= _SHORTEST) & (length <= _LONGEST)
    if allowed is not None:
        fit &= np.isin(np.arange(len(pool)), allowed)
    return np.flatnonzero(fit)


def _steps(task: Task, kinematics: Kinematics, pool: QueryPool) -> np.ndarray:
    """The samples' steps ``(n,)`` in the task's plane, as complex numbers, over a long one."""
    before, after = kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    change = task.dof_change(before, after) / long_step(task, kinematics, pool)
    steps: np.ndarray = change[:, 0] + 1j * change[:, 1]
    return steps


def _covariance(
    f: np.ndarray, length: np.ndarray, place: np.ndarray, motion: np.ndarray
) -> np.ndarray:
    """Of what different people would answer, for all pairs of moves: ``(n, n)``."""
    straight = f[:, None] * f.conj()[None]
    curve = _CURVE**2 * np.outer(np.log(length) + 1.0, np.log(length) + 1.0)
    either_hand = 1.0 + _DRIFT**2 * nearness(place, place)
    covariance: np.ndarray = either_hand * 2.0 * straight.real + curve * straight
    same: np.ndarray = covariance * (motion[:, None] == motion[None])
    return same
