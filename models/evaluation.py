"""How well a mapping does what a person means."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .arrays import JointPositions, Scalars
from .demonstrations import DT_S
from .kinematics import Kinematics
from .mapping import Mapping
from .panda import Q_MAX, Q_MIN
from .queries import QueryPool
from .simulated_human import SimulatedHuman

DirectionErrors = Float[np.ndarray, "states directions"]
# Moves shorter than this share of the RMS move have no relative error to speak of.
_SHORT = 0.25


def position_error(
    kinematics: Kinematics,
    s: JointPositions,
    intended: JointPositions,
    reached: JointPositions,
) -> Scalars:
    r"""The paper's relative error :math:`E_d = |x^* - x'| / |x^* - x|` of the hand, a sample each.

    Args:
        kinematics: The arm.
        s: Where it was, ``(n, 7)`` in [rad].
        intended: Where it was meant to go.
        reached: Where it went.
    """
    x, x_star, x_reached = (kinematics.hand_pose(q).position for q in (s, intended, reached))
    error: np.ndarray = np.linalg.norm(x_star - x_reached, axis=-1)
    return np.asarray(error / np.linalg.norm(x_star - x, axis=-1))


def rotation_error(
    kinematics: Kinematics, intended: JointPositions, reached: JointPositions
) -> Scalars:
    r"""The paper's :math:`E_r = 2 \arccos |\langle q', q^*\rangle|`, in [rad], a sample each.

    By way of the arcsine, which keeps its precision where the angle is small:
    :math:`|R^* - R'|_F = 2 \sqrt 2 \sin(E_r / 2)`.
    """
    difference = kinematics.hand_pose(intended).rotation - kinematics.hand_pose(reached).rotation
    sine = np.linalg.norm(difference, axis=(-2, -1)) / (2.0 * np.sqrt(2.0))
    return np.asarray(2.0 * np.arcsin(np.clip(sine, 0.0, 1.0)))


@dataclass(frozen=True)
class Judgement:
    """The paper's measures of a mapping for one person, over the moves of a pool.

    Attributes:
        position_error: Mean E_d over moves that take the hand at least a quarter of the RMS
            travel: a pure turn has no relative distance.
        rotation_error: Mean E_r over all moves, in [rad].
        motion_gain: Mean travel made over mean travel meant: a hand that hardly moves is seen.
    """

    position_error: float
    rotation_error: float
    motion_gain: float


def judge_moves(
    mapping: Mapping, human: SimulatedHuman, kinematics: Kinematics, pool: QueryPool
) -> Judgement:
    """Let a noise-free person ask for every move of a pool that is within their reach."""
    before, after = kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    h = human.answer(human.task.dof_change(before, after), before)
    fit = np.linalg.norm(h, axis=-1) <= 1.0
    s, intended, meant_m = pool.states[fit], pool.next_states[fit], pool.travel_m[fit]
    reached = step(mapping, h[fit], s)
    long = meant_m >= _SHORT * np.sqrt(np.mean(pool.travel_m**2))
    errors = position_error(kinematics, s[long], intended[long], reached[long])
    way = kinematics.hand_pose(reached).position - before.position[fit]
    return Judgement(
        float(np.mean(errors)),
        float(np.mean(rotation_error(kinematics, intended, reached))),
        float(np.mean(np.linalg.norm(way, axis=-1)) / np.mean(meant_m)),
    )


def direction_error_deg(
    mapping: Mapping,
    human: SimulatedHuman,
    kinematics: Kinematics,
    s: JointPositions,
    directions: int = 16,
    stick: float = 0.7,
) -> DirectionErrors:
    """The angle between the move meant and the move made, in [deg].

    A hand that does not move at all is 90 degrees off.

    Args:
        mapping: The mapping.
        human: Whose meaning counts.
        kinematics: The arm.
        s: States, ``(n, 7)`` in [rad].
        directions: How many directions of the stick at each.
        stick: How far the stick is pushed.
    """
    meant, made = _meant_and_made(mapping, human, kinematics, s, directions, stick)
    lengths = np.linalg.norm(meant, axis=-1) * np.linalg.norm(made, axis=-1)
    dot = np.sum(meant * made, axis=-1)
    cosine = np.where(lengths > 0.0, dot / np.maximum(lengths, 1e-300), 0.0)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def motion_gain(
    mapping: Mapping,
    human: SimulatedHuman,
    kinematics: Kinematics,
    s: JointPositions,
    directions: int = 16,
    stick: float = 0.7,
) -> DirectionErrors:
    """The length of the move made over the length of the move meant: 1 is as fast as meant."""
    meant, made = _meant_and_made(mapping, human, kinematics, s, directions, stick)
    gain: np.ndarray = np.linalg.norm(made, axis=-1) / np.linalg.norm(meant, axis=-1)
    return gain


def step(mapping: Mapping, h: np.ndarray, s: JointPositions) -> JointPositions:
    """The paper's T: the state one step after stick ``h`` at ``s``."""
    return np.clip(s + mapping(h, s) * DT_S, Q_MIN, Q_MAX)


def _meant_and_made(
    mapping: Mapping,
    human: SimulatedHuman,
    kinematics: Kinematics,
    s: JointPositions,
    directions: int,
    stick: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Changes in the task's two DoF, ``(n, directions, 2)`` each."""
    angles = np.arange(directions) * (2 * np.pi / directions)
    ring = stick * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    h = np.broadcast_to(ring, (len(s), directions, 2))
    states = np.repeat(s[:, None, :], directions, axis=1)
    before = kinematics.hand_pose(states)
    after = kinematics.hand_pose(step(mapping, h, states))
    return human.wish(h, before), human.task.dof_change(before, after)
