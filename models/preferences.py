"""What people want their stick to do: a family of preferences, and the words for them.

A preference takes a move of the hand, in steps that full stick asks for, to the stick that the
person would give for it: ``h = gain * |v|^(exponent - 1) v`` with ``v = matrix @ turn(move)``.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from .arrays import HumanInput, Scalars
from .errors import InputError

PREFERENCE_WORDS = (
    "axes",
    "random",
    "rotated:<degrees>",
    "mirrored",
    "swapped",
    "polar",
    "expo:<p>",
    "gain:<g>",
)


@dataclass(frozen=True)
class Preference:
    """One person's idea of the stick.

    Attributes:
        matrix: Orthogonal; from the move's two degrees of freedom to the stick's two axes.
        is_polar: Whether they think of towards and around the base instead of x and y.
        exponent: Of their response: below 1, small moves get more stick than their share.
        gain: Of the stick, in (0, 1]: what they push for the largest move.

    Raises:
        InputError: If it cannot be inverted.
    """

    matrix: Float[np.ndarray, "2 2"] = field(default_factory=lambda: np.eye(2))
    is_polar: bool = False
    exponent: float = 1.0
    gain: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        if abs(np.linalg.det(self.matrix)) < 1e-6:
            raise InputError("A preference must be invertible.")
        if not 0.2 <= self.exponent <= 5.0:
            raise InputError("The exponent of a preference lies between 0.2 and 5.")
        if not 0.05 <= self.gain <= 1.0:
            raise InputError("The gain of a preference lies between 0.05 and 1.")

    def stick(self, move: Float[np.ndarray, "*batch 2"], azimuth: Scalars) -> HumanInput:
        """The stick for a move, in steps of full stick, seen at an azimuth in [rad]."""
        if self.is_polar:
            move = _turn(move, np.asarray(-azimuth))
        return self.gain * curved(move @ self.matrix.T, self.exponent)

    def move(self, h: HumanInput, azimuth: Scalars) -> Float[np.ndarray, "*batch 2"]:
        """The move they expect for a stick: the inverse of :meth:`stick`."""
        move = curved(h / self.gain, 1.0 / self.exponent) @ np.linalg.inv(self.matrix).T
        return _turn(move, azimuth) if self.is_polar else move


def curved(v: Float[np.ndarray, "*batch 2"], exponent: float) -> Float[np.ndarray, "*batch 2"]:
    """The same directions with lengths to the power of ``exponent``."""
    if exponent == 1.0:
        return v
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    lifted: np.ndarray = v * np.maximum(length, 1e-12) ** (exponent - 1.0)
    return lifted


def axes() -> Preference:
    """Stick right is the first degree of freedom, stick up the second."""
    return Preference()


def rotated(angle_deg: float) -> Preference:
    """The axes, turned."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return Preference(np.array([[cos, -sin], [sin, cos]]))


def mirrored(preference: Preference) -> Preference:
    """The same preference with the stick's first axis turned round."""
    return replace(preference, matrix=np.diag([-1.0, 1.0]) @ preference.matrix)


def swapped(preference: Preference) -> Preference:
    """The same preference with the stick's axes exchanged."""
    return replace(preference, matrix=preference.matrix[::-1].copy())


def random_preference(rng: np.random.Generator) -> Preference:
    """Any rotation, mirrored or not (swapped axes are a rotation of the mirrored ones)."""
    turned = rotated(rng.uniform(0.0, 360.0))
    return mirrored(turned) if rng.random() < 0.5 else turned


def parse_preference(text: str, rng: np.random.Generator) -> Preference:
    """The preference that words joined by ``+`` describe, applied from left to right.

    Args:
        text: :data:`PREFERENCE_WORDS`, such as ``random+expo:0.7``.
        rng: Draws what ``random`` leaves open.

    Raises:
        InputError: If a word is unknown or its number is missing or out of range.
    """
    preference = axes()
    for word in text.split("+"):
        preference = _apply(word.strip(), preference, rng)
    return preference


def _apply(word: str, preference: Preference, rng: np.random.Generator) -> Preference:
    name, colon, number = word.partition(":")
    plain = {
        "axes": lambda: preference,
        "random": lambda: _after(preference, random_preference(rng)),
        "mirrored": lambda: mirrored(preference),
        "swapped": lambda: swapped(preference),
        "polar": lambda: replace(preference, is_polar=True),
    }
    numbered = {
        "rotated": lambda value: _after(preference, rotated(value)),
        "expo": lambda value: replace(preference, exponent=value),
        "gain": lambda value: replace(preference, gain=value),
    }
    if not colon and name in plain:
        return plain[name]()
    if colon and name in numbered:
        return numbered[name](_number(word, number))
    known = ", ".join(PREFERENCE_WORDS)
    raise InputError(f"There is no preference '{word}'; join by '+' any of: {known}.")


def _after(first: Preference, then: Preference) -> Preference:
    return replace(first, matrix=then.matrix @ first.matrix)


def _number(word: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"'{word}' needs a number after the colon.")
    return value


def _turn(move: Float[np.ndarray, "*batch 2"], angle: Scalars) -> Float[np.ndarray, "*batch 2"]:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = move[..., 0], move[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
