"""A move on show: from its start, at the speed at which it would be driven."""

from dataclasses import dataclass

import numpy as np

from models.demonstrations import DT_S

_REST_S = 0.6  # the arm stands still before and after


@dataclass
class Show:
    """The move of a question.

    Attributes:
        query_id: Whose.
        path: Joint positions, one every 0.1 s, ``(m, 7)`` in [rad].
        began_s: When.
    """

    query_id: str
    path: np.ndarray
    began_s: float

    @property
    def duration_s(self) -> float:
        """How long it moves."""
        return (len(self.path) - 1) * DT_S

    def at(self, now_s: float) -> tuple[np.ndarray, float]:
        """Joint positions ``(7,)`` in [rad] and the fraction shown."""
        fraction = np.clip((now_s - self.began_s - _REST_S) / self.duration_s, 0.0, 1.0)
        place = fraction * (len(self.path) - 1)
        before = min(int(place), len(self.path) - 2)
        share = place - before
        return (1 - share) * self.path[before] + share * self.path[before + 1], float(fraction)

    def is_over(self, now_s: float) -> bool:
        """Whether it has come to rest."""
        return now_s - self.began_s > self.duration_s + 2 * _REST_S
