"""Simulated people: each has a preference, and answers with more or less noise."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .arrays import DofChange, HumanInput
from .errors import InputError
from .kinematics import HandPose, Kinematics
from .queries import QueryPool
from .tasks import Task

Preference = Float[np.ndarray, "2 2"]
_SENSITIVITY_QUANTILE = 0.97


def axes() -> Preference:
    """Stick right is the first degree of freedom, stick up the second."""
    return np.eye(2)


def rotated(angle_deg: float) -> Preference:
    """The axes, turned."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[cos, -sin], [sin, cos]])


def mirrored(preference: Preference) -> Preference:
    """The same preference with the stick's first axis turned round."""
    turned_round: np.ndarray = np.diag([-1.0, 1.0]) @ preference
    return turned_round


def random_preference(rng: np.random.Generator) -> Preference:
    """Any rotation, mirrored or not."""
    turned = rotated(rng.uniform(0.0, 360.0))
    return mirrored(turned) if rng.random() < 0.5 else turned


def sensitivity(task: Task, kinematics: Kinematics, pool: QueryPool) -> Float[np.ndarray, "2"]:
    """What full stick means: a long step among the pool's, the same in both DoF."""
    change = task.dof_change(
        kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    )
    long = np.quantile(np.linalg.norm(change, axis=-1), _SENSITIVITY_QUANTILE)
    return np.full(2, long)


@dataclass(frozen=True)
class SimulatedHuman:
    """Somebody who expects the hand to move by kappa P^-1 h in one step.

    Attributes:
        task: Whose degrees of freedom they see.
        preference: P, orthogonal; see :func:`rotated` and :func:`mirrored`.
        kappa: The step they expect for full stick, in each DoF.
        noise_cv: RMS length of the noise of an answer over the answer's length.
        always_full: Whether they push the stick to its edge whatever they see.

    Raises:
        InputError: If the preference cannot be inverted or a sensitivity is not positive.
    """

    task: Task
    preference: Preference
    kappa: Float[np.ndarray, "2"]
    noise_cv: float = 0.0
    always_full: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        if abs(np.linalg.det(self.preference)) < 1e-6 or np.any(self.kappa <= 0.0):
            raise InputError("A preference must be invertible and a sensitivity positive.")

    def wish(self, h: HumanInput) -> DofChange:
        """The step they expect for stick ``h``."""
        inverse = np.linalg.inv(self.preference)
        expected: np.ndarray = (h @ inverse.T) * self.kappa
        return expected

    def answer(self, change: DofChange) -> HumanInput:
        """The stick that they would give for a step, without noise and of any length."""
        h: np.ndarray = (change / self.kappa) @ self.preference.T
        return h

    def label(
        self, before: HandPose, after: HandPose, rng: np.random.Generator | None = None
    ) -> HumanInput:
        """What they answer when they see the hand move; the stick ends at the unit circle.

        Raises:
            InputError: If they are noisy and there is no ``rng``.
        """
        h = self.answer(self.task.dof_change(before, after))
        if self.noise_cv > 0.0:
            if rng is None:
                raise InputError("A noisy person needs a random generator.")
            length = np.linalg.norm(h, axis=-1, keepdims=True)
            h = h + self.noise_cv / np.sqrt(2.0) * length * rng.standard_normal(h.shape)
        length = np.linalg.norm(h, axis=-1, keepdims=True)
        edge = np.maximum(length, 1e-12 if self.always_full else 1.0)
        shortened: np.ndarray = h / edge
        return shortened
