"""Simulated people: each has a preference, and answers with more or less noise."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .arrays import DofChange, HumanInput, Scalars
from .errors import InputError
from .kinematics import HandPose, Kinematics
from .preferences import Preference
from .queries import QueryPool, long_step
from .tasks import Task


def sensitivity(task: Task, kinematics: Kinematics, pool: QueryPool) -> Float[np.ndarray, "2"]:
    """What full stick means: a long step among the pool's, the same in both DoF, in [m]."""
    return np.full(2, long_step(task, kinematics, pool))


@dataclass(frozen=True)
class SimulatedHuman:
    """Somebody who has an idea of what the stick should do, and sees the hand.

    Attributes:
        task: Whose degrees of freedom they see.
        preference: Their idea.
        kappa: The step they expect for full stick, in each DoF, in [m].
        noise_cv: RMS length of the noise of an answer over the answer's length.
        always_full: Whether they push the stick to its edge whatever they see.

    Raises:
        InputError: If a sensitivity is not positive.
    """

    task: Task
    preference: Preference
    kappa: Float[np.ndarray, "2"]
    noise_cv: float = 0.0
    always_full: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        if np.any(self.kappa <= 0.0):
            raise InputError("A sensitivity must be positive.")

    def wish(self, h: HumanInput, at: HandPose | None = None) -> DofChange:
        """The step they expect for stick ``h`` where the hand is ``at``.

        Raises:
            InputError: If that depends on where the hand is, and it is not said.
        """
        step: np.ndarray = self.preference.move(h, self._azimuth(h, at)) * self.kappa
        return step

    def answer(self, change: DofChange, at: HandPose | None = None) -> HumanInput:
        """The stick that they would give for a step, without noise and of any length.

        Raises:
            InputError: If that depends on where the hand is, and it is not said.
        """
        return self.preference.stick(change / self.kappa, self._azimuth(change, at))

    def label(
        self, before: HandPose, after: HandPose, rng: np.random.Generator | None = None
    ) -> HumanInput:
        """What they answer when they see the hand move; the stick ends at the unit circle.

        Raises:
            InputError: If they are noisy and there is no ``rng``.
        """
        h = self.answer(self.task.dof_change(before, after), before)
        if self.noise_cv > 0.0:
            if rng is None:
                raise InputError("A noisy person needs a random generator.")
            length = np.linalg.norm(h, axis=-1, keepdims=True)
            h = h + self.noise_cv / np.sqrt(2.0) * length * rng.standard_normal(h.shape)
        length = np.linalg.norm(h, axis=-1, keepdims=True)
        edge = np.maximum(length, 1e-12 if self.always_full else 1.0)
        shortened: np.ndarray = h / edge
        return shortened

    def _azimuth(self, rows: np.ndarray, at: HandPose | None) -> Scalars:
        if not self.preference.is_polar:
            return np.zeros(rows.shape[:-1])
        if at is None:
            raise InputError("What this person means depends on where the hand is.")
        return self.task.azimuth(at)


def make_wrong(h: HumanInput, share: float, rng: np.random.Generator) -> HumanInput:
    """The same answers with a share of them, rounded, plainly wrong: 90 to 270 degrees off."""
    wrong = h.copy()
    rows = rng.choice(len(h), round(share * len(h)), replace=False)
    off = rng.uniform(0.5 * np.pi, 1.5 * np.pi, len(rows))
    x, y = h[rows, 0], h[rows, 1]
    wrong[rows, 0] = np.cos(off) * x - np.sin(off) * y
    wrong[rows, 1] = np.sin(off) * x + np.cos(off) * y
    return wrong
