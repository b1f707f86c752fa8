"""Understanding a person from their answers: which stick they would give for which move.

Moves and sticks are complex numbers here. Every real linear map of the plane is
``v = c u + d conj(u)``: ``c`` turns and scales, ``d`` does so to the mirror image. A person has one
of the two; a little of the other means that their axes differ in gain or are not square. With noise
in proportion to the answer, ``v / |u|`` has the same noise everywhere, and both are learned by
Gaussian regression (Rasmussen & Williams 2006, chapters 2 and 5). Evidence decides what the answers
alone must say: mirrored or not; along x and y or towards and around the base; how the response is
curved; whether the map changes over the workspace; and how noisy the person is. Answers that no
such map explains are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from .arrays import Indices, Scalars
from .fitting import Labels
from .kinematics import Kinematics
from .preferences import curved
from .tasks import Task

Complex = np.ndarray  # of complex numbers

# The forms that compete, each with what it costs beforehand (a logarithm of odds).
_EXPONENTS = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.15, 1.3, 1.5, 1.75, 2.0, 2.5])
_CURVED_COST, _CURVED_SCALE = 4.0, 0.5
_POLAR_COST = 2.0
_SKEWS = ((0.02, 0.0), (0.2, 3.0))  # standard deviation of the part that mirrors
_DRIFTS = ((0.0, 0.0), (0.15, 3.0), (0.4, 5.0))  # of what changes over the workspace
_DRIFT_LENGTH_M = 0.2
_NOISES = np.array([0.002, 0.005, 0.012, 0.03, 0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6])
# Very short moves have no direction to speak of: their noise, in steps of full stick.
_BLUR = 0.05
# An answer further off than this, in direction, is none to learn from.
_WRONG_RAD = 1.3
_WRONG_COST = 2.5
_SMALLEST = 1e-9


@dataclass(frozen=True)
class Reading:
    """One way to understand a person, as far as it is not a number to be regressed.

    Attributes:
        is_polar: Towards and around the base instead of along x and y.
        exponent: Of the response, as in :class:`Preference`.
        skew: Standard deviation of the lesser of c and d; the greater has 1.
        drift: Standard deviation of what changes over the workspace.
        noise: Of an answer, over its length.
    """

    is_polar: bool = False
    exponent: float = 1.0
    skew: float = 0.02
    drift: float = 0.0
    noise: float = 0.1


@dataclass(frozen=True)
class Evidence:
    """Answers as complex numbers.

    Attributes:
        u: Moves seen, in steps of full stick, ``(k,)``.
        h: Sticks given, ``(k,)``.
        azimuth: Of the hand round the base, in [rad], ``(k,)``.
        motion: Which motion of the task, ``(k,)``.
        place: Where in the motion's degrees of freedom, ``(k, 2)`` in [m].
    """

    u: Complex
    h: Complex
    azimuth: Scalars
    motion: Indices
    place: np.ndarray

    def at(self, rows: np.ndarray) -> "Evidence":
        """Some of them."""
        return Evidence(
            self.u[rows], self.h[rows], self.azimuth[rows], self.motion[rows], self.place[rows]
        )

    def __len__(self) -> int:
        """How many."""
        return len(self.u)


@dataclass(frozen=True)
class MotionMap:
    """What was learned of one motion: c and d, and how they change from place to place.

    Attributes:
        is_mirrored: Whether d is the greater.
        centres: Places of the answers, ``(k, 2)`` in [m].
        c: First the constant part, then each answer's weight, ``(k + 1,)``.
        d: The same.
        spread: Standard deviation of the map at a place of the pool, over its size; the root of
            its mean square.
    """

    is_mirrored: bool
    centres: np.ndarray
    c: Complex
    d: Complex
    spread: float

    def at(self, place: np.ndarray) -> tuple[Complex, Complex]:
        """c and d at places ``(..., 2)`` in [m]."""
        near = nearness(place, self.centres)
        return self.c[0] + near @ self.c[1:], self.d[0] + near @ self.d[1:]


@dataclass(frozen=True)
class Understanding:
    """What was made of a person's answers.

    Attributes:
        reading: How the person is understood.
        maps: From moves to sticks, one for each motion of the task.
        doubtful: Rows of the answers that nothing explains.
    """

    reading: Reading
    maps: tuple[MotionMap, ...]
    doubtful: tuple[int, ...]


def understand(evidence: Evidence, places: Sequence[np.ndarray]) -> Understanding:
    """Choose a reading by its evidence and regress the maps; what disagrees is left out.

    Args:
        evidence: The answers.
        places: For each motion, where its map will be used, ``(n, 2)`` in [m].
    """
    motions = len(places)
    kept = _agreeing(evidence, motions)
    for _ in range(2):
        reading, mirrored = _best_reading(evidence.at(kept), motions)
        maps = tuple(
            _regress(evidence.at(kept), index, reading, mirrored[index], places[index])
            for index in range(motions)
        )
        agreeing = _explained(evidence, reading, maps)
        if np.array_equal(agreeing, kept):
            break
        kept = agreeing
    return Understanding(reading, maps, tuple(int(row) for row in np.flatnonzero(~kept)))


def wish(
    understanding: Understanding,
    h: np.ndarray,
    place: np.ndarray,
    motion: Indices,
    azimuth: Scalars,
) -> np.ndarray:
    """The moves meant by sticks ``(..., 2)``, in steps of full stick, ``(..., 2)``.

    Args:
        understanding: Of the person.
        h: Their sticks.
        place: Where the hand is in its motion's degrees of freedom, ``(..., 2)`` in [m].
        motion: Which motion that is, ``(...)``.
        azimuth: Of the hand round the base, ``(...)`` in [rad].
    """
    v = _complex(curved(h, 1.0 / understanding.reading.exponent))
    u = np.empty_like(v)
    for index, motion_map in enumerate(understanding.maps):
        here = motion == index
        u[here] = _inverse(*motion_map.at(place[here]), v[here])
    return _plane(u * np.exp(1j * azimuth) if understanding.reading.is_polar else u)


def read_labels(task: Task, kinematics: Kinematics, labels: Labels, unit_m: float) -> Evidence:
    """Answers as complex numbers."""
    before, after = kinematics.hand_pose(labels.states), kinematics.hand_pose(labels.next_states)
    return Evidence(
        u=_complex(task.dof_change(before, after) / unit_m),
        h=_complex(labels.human_inputs),
        azimuth=task.azimuth(before),
        motion=task.motion_at(before),
        place=task.dof(before),
    )


@dataclass(frozen=True)
class _Rows:
    """Answers to one motion, ready for regression: ``y = c f + d conj(f)`` with even noise.

    Attributes:
        f: Moves, ``(k,)``.
        y: Sticks under each exponent, ``(exponents, k)``.
        place: Where, ``(k, 2)`` in [m].
    """

    f: Complex
    y: Complex
    place: np.ndarray


def _rows(evidence: Evidence, motion: int, is_polar: bool, *exponents: float) -> _Rows:
    here = evidence.motion == motion
    u, h = evidence.u[here], evidence.h[here]
    if is_polar:
        u = u * np.exp(-1j * evidence.azimuth[here])
    length = np.sqrt(np.abs(u) ** 2 + _BLUR**2)
    bend = 1.0 / np.array(exponents)[:, None] - 1.0
    y = h * np.maximum(np.abs(h), 1e-12) ** bend / length
    return _Rows(u / length, y, evidence.place[here])


def _best_reading(evidence: Evidence, motions: int) -> tuple[Reading, tuple[bool, ...]]:
    """The reading with the greatest evidence, and whether each motion is mirrored under it."""
    best, best_score = (Reading(), (False,) * motions), -np.inf
    polar = (False, True) if np.any(evidence.azimuth != 0.0) else (False,)
    exponents = _EXPONENTS
    for is_polar in polar:
        score, found = search(evidence, motions, is_polar, exponents)
        if score > best_score:
            best, best_score = found, score
    # Between the exponents of the list, if it is not the straight one.
    step = 0.12
    while best[0].exponent != 1.0 and step > 0.002:
        around = best[0].exponent * np.exp(np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * step)
        _, best = search(evidence, motions, best[0].is_polar, around)
        step *= 0.4
    return best


def search(
    evidence: Evidence, motions: int, is_polar: bool, exponents: np.ndarray
) -> tuple[float, tuple[Reading, tuple[bool, ...]]]:
    """The best exponent, skew, drift and noise for a frame, after their score.

    The score is the logarithm of how likely the sticks are, less what the forms cost beforehand.
    """
    log_h = np.log(np.maximum(np.abs(evidence.h), 0.02))
    rows = [_rows(evidence, motion, is_polar, *exponents) for motion in range(motions)]
    best_score, best = -np.inf, None
    for (skew, skew_cost), (drift, drift_cost) in product(_SKEWS, _DRIFTS):
        total = np.zeros((len(exponents), len(_NOISES)))
        mirrored = np.zeros((motions, len(exponents), len(_NOISES)), dtype=bool)
        for motion in range(motions):
            scores = np.stack(
                [_evidence(rows[motion], is_mirror, skew, drift) for is_mirror in (False, True)]
            )
            mirrored[motion] = scores[1] > scores[0]
            total += np.logaddexp(scores[0], scores[1])
        # Each exponent stretches sticks differently: what counts is how likely the sticks are.
        slope = 1.0 / exponents
        total += (len(evidence) * np.log(slope) + 2.0 * (slope - 1.0) * log_h.sum())[:, None]
        costs = np.where(
            exponents == 1.0,
            0.0,
            _CURVED_COST + 0.5 * (np.log(exponents) / _CURVED_SCALE) ** 2,
        )
        total -= costs[:, None] + skew_cost + drift_cost + _POLAR_COST * is_polar
        at = np.unravel_index(np.argmax(total), total.shape)
        if total[at] > best_score:
            best_score = float(total[at])
            reading = Reading(is_polar, float(exponents[at[0]]), skew, drift, float(_NOISES[at[1]]))
            best = reading, tuple(bool(m) for m in mirrored[:, at[0], at[1]])
    assert best is not None
    return best_score, best


def _evidence(rows: _Rows, is_mirrored: bool, skew: float, drift: float) -> np.ndarray:
    """Log likelihood for each exponent and noise: ``(exponents, noises)``."""
    k = len(rows.f)
    if k == 0:
        return np.zeros((len(rows.y), len(_NOISES)))
    values, vectors = np.linalg.eigh(
        _covariance(rows, rows.place, rows.f, is_mirrored, skew, drift)
    )
    # Scaled so that the greater of c and d is about 1.
    scales = np.maximum(np.median(np.abs(rows.y), axis=1), 1e-3)
    power = np.abs(rows.y / scales[:, None] @ vectors.conj()) ** 2  # (exponents, k)
    spread = np.maximum(values, 0.0)[None] + _NOISES[:, None] ** 2  # (noises, k)
    fit = power @ (1.0 / spread).T + np.log(spread).sum(axis=1) + k * np.log(np.pi)
    score: np.ndarray = -fit - 2.0 * k * np.log(scales)[:, None]
    return score


def _covariance(
    rows: _Rows, place: np.ndarray, f: Complex, is_mirrored: bool, skew: float, drift: float
) -> Complex:
    """Of what is said at ``place`` for ``f`` with what is said at the rows."""
    c, d = (skew, 1.0) if is_mirrored else (1.0, skew)
    straight = f[:, None] * rows.f.conj()[None]
    near = drift**2 * nearness(place, rows.place)
    covariance: Complex = (c**2 + near) * straight + (d**2 + near) * straight.conj()
    return covariance


def _regress(
    evidence: Evidence, motion: int, reading: Reading, is_mirrored: bool, places: np.ndarray
) -> MotionMap:
    """The most likely map of one motion under a reading."""
    rows = _rows(evidence, motion, reading.is_polar, reading.exponent)
    skew, drift = reading.skew, reading.drift
    c, d = (skew, 1.0) if is_mirrored else (1.0, skew)
    gram = _covariance(rows, rows.place, rows.f, is_mirrored, skew, drift)
    gram = gram + reading.noise**2 * np.eye(len(rows.f))
    weights = np.linalg.solve(gram, rows.y[0])
    along, across = rows.f.conj() * weights, rows.f * weights
    # What is not known yet, at places of the pool, for moves to all sides.
    spread = 0.0
    for f in (1.0, 1j):
        probe = np.full(len(places), f)
        cross = _covariance(rows, places, probe, is_mirrored, skew, drift)
        prior = c**2 + d**2 + 2.0 * drift**2
        known = np.real(np.sum(cross * np.linalg.solve(gram, cross.conj().T).T, axis=1))
        spread += 0.5 * float(np.mean(np.maximum(prior - known, 0.0))) if len(places) else 0.0
    return MotionMap(
        is_mirrored=is_mirrored,
        centres=rows.place,
        c=np.concatenate([[c**2 * along.sum()], drift**2 * along]),
        d=np.concatenate([[d**2 * across.sum()], drift**2 * across]),
        spread=float(np.sqrt(spread)),
    )


def _agreeing(evidence: Evidence, motions: int) -> np.ndarray:
    """Which answers to begin with: those that one turn, mirrored or not, explains together."""
    kept = np.ones(len(evidence), dtype=bool)
    for motion in range(motions):
        here = np.flatnonzero(evidence.motion == motion)
        if len(here) < 4:  # two against one is no majority
            continue
        best_score = -np.inf
        for is_polar, is_mirrored in product((False, True), repeat=2):
            rows = _rows(evidence.at(here), motion, is_polar, 1.0)
            f = rows.f.conj() if is_mirrored else rows.f
            turned = np.angle(rows.y[0] * f.conj())
            apart = np.angle(np.exp(1j * (turned[:, None] - turned[None])))
            scores = np.logaddexp(6.0 * (np.cos(apart) - 1.0), -_WRONG_COST).sum(axis=0)
            if scores.max() > best_score:
                best_score = scores.max()
                kept[here] = np.abs(apart[:, np.argmax(scores)]) < _WRONG_RAD
    return kept


def _explained(evidence: Evidence, reading: Reading, maps: tuple[MotionMap, ...]) -> np.ndarray:
    """Which answers point where the maps say they should."""
    kept = np.ones(len(evidence), dtype=bool)
    for motion, motion_map in enumerate(maps):
        here = np.flatnonzero(evidence.motion == motion)
        if len(here) < 4:
            continue
        rows = _rows(evidence, motion, reading.is_polar, reading.exponent)
        c, d = motion_map.at(rows.place)
        meant = c * rows.f + d * rows.f.conj()
        kept[here] = np.abs(np.angle(rows.y[0] * meant.conj())) < _WRONG_RAD
    # Where hardly anything is explained, nothing is wrong but the reading.
    return kept if kept.mean() > 0.5 else np.ones(len(evidence), dtype=bool)


def nearness(place: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """How alike the map is at places ``(..., 2)`` and ``(k, 2)``, from 0 to 1: ``(..., k)``."""
    apart = place[..., None, :] - centres
    near: np.ndarray = np.exp(-0.5 * np.sum(apart**2, axis=-1) / _DRIFT_LENGTH_M**2)
    return near


def _inverse(c: Complex, d: Complex, v: Complex) -> Complex:
    """u with v = c u + d conj(u); kept finite where the map nearly loses a direction."""
    square, other = np.abs(c) ** 2, np.abs(d) ** 2
    size = square - other
    least = 0.05 * np.maximum(np.maximum(square, other), _SMALLEST)
    size = np.where(np.abs(size) < least, np.where(size < 0.0, -least, least), size)
    u: Complex = (np.conj(c) * v - d * np.conj(v)) / size
    return u


def _complex(rows: np.ndarray) -> Complex:
    return np.asarray(rows[..., 0] + 1j * rows[..., 1])


def _plane(numbers: Complex) -> np.ndarray:
    return np.stack([numbers.real, numbers.imag], axis=-1)
