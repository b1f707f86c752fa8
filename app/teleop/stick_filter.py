"""From the stick as the page sent it to the stick the alignment gets."""

import math
from dataclasses import dataclass

import numpy as np

# A stick passes on what is slower than this; it takes the jerks out of keys and hands.
TIME_CONSTANT_S = 0.04
# Below this the stick counts as released: the rest of a filtered release, or a pad that drifts.
DEAD_ZONE = 0.02


@dataclass
class StickFilter:
    """A first-order low pass that lets go at once when the stick is let go."""

    time_constant_s: float = TIME_CONSTANT_S

    def __post_init__(self) -> None:
        """Begin released."""
        self._h = np.zeros(2)

    def update(self, raw: np.ndarray, dt_s: float) -> np.ndarray:
        """The filtered stick ``(2,)`` after ``dt_s`` seconds of ``raw`` ``(2,)``, in [-1, 1]²."""
        if math.hypot(raw[0], raw[1]) < DEAD_ZONE:
            self._h = np.zeros(2)
        else:
            share = 1.0 - math.exp(-dt_s / self.time_constant_s)
            self._h = self._h + share * (raw - self._h)
        return self._h.copy()
