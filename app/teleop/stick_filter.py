"""From the stick as the page sent it to the stick the alignment gets."""

import math
from dataclasses import dataclass

import numpy as np

# A stick passes on what is slower than this; it takes the jerks out of keys and hands.
TIME_CONSTANT_S = 0.04
# Tremor of the hand is 4 to 12 Hz, meant pushes are below 1 Hz. This leaves 16 % of 4 Hz, 11 % of
# 6 Hz and 5 % of 12 Hz (the one above 55 % of 6 Hz), and a push has come to 95 % after 0.75 s.
STEADY_TIME_CONSTANT_S = 0.25
# Below this the stick counts as released: the rest of a filtered release, or a pad that drifts.
DEAD_ZONE = 0.02


@dataclass
class StickFilter:
    """A first-order low pass that lets go at once when the stick is let go."""

    time_constant_s: float = TIME_CONSTANT_S
    steady_time_constant_s: float = STEADY_TIME_CONSTANT_S
    is_steady: bool = False  # for hands that shake; may change while the stick is pushed

    def __post_init__(self) -> None:
        """Begin released."""
        self._h = np.zeros(2)

    def update(self, raw: np.ndarray, dt_s: float) -> np.ndarray:
        """The filtered stick ``(2,)`` after ``dt_s`` seconds of ``raw`` ``(2,)``, in [-1, 1]²."""
        if math.hypot(raw[0], raw[1]) < DEAD_ZONE:
            self._h = np.zeros(2)
        else:
            slow_s = self.steady_time_constant_s if self.is_steady else self.time_constant_s
            share = 1.0 - math.exp(-dt_s / slow_s)
            self._h = self._h + share * (raw - self._h)
        return self._h.copy()
