"""The one seam of every method: a problem goes in, an alignment comes out.

A :class:`Method` learns z = f(h, s) from a :class:`FitProblem`, and reads an alignment of its kind
back from the numbers in a file. Simulations, trainings, checkpoints and drives use nothing else.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .alignment import Alignment
from .arrays import HumanInput, JointPositions, LatentAction
from .controller import LatentController
from .errors import InputError, ShapeError
from .kinematics import Kinematics
from .panda import N_JOINTS
from .queries import QueryPool
from .tasks import Task

# Two directions are the least that can tell a rotation from a mirror.
MIN_LABELS = 2


@dataclass(frozen=True)
class Labels:
    """A person's answers: states ``(k, 7)``, sticks ``(k, 2)``, intended next states ``(k, 7)``.

    Attributes:
        states: s of the moves shown, in [rad].
        human_inputs: h, the sticks given for them.
        next_states: s* after one step, in [rad].
        latents: The z that made each move, ``(k, 2)``; None where it is not known.

    Raises:
        ShapeError: If their numbers disagree.
        InputError: If a number is not finite, or a stick outside [-1, 1]^2.
    """

    states: JointPositions
    human_inputs: HumanInput
    next_states: JointPositions
    latents: LatentAction | None = None

    def __post_init__(self) -> None:
        """Check the answers."""
        k = len(self.states)
        arrays = [self.states, self.human_inputs, self.next_states]
        expected = [(k, N_JOINTS), (k, 2), (k, N_JOINTS)]
        if self.latents is not None:
            arrays.append(self.latents)
            expected.append((k, 2))
        shapes = [array.shape for array in arrays]
        if shapes != expected:
            raise ShapeError(f"Labels of shapes {tuple(shapes)} do not belong together.")
        if not all(np.isfinite(array).all() for array in arrays):
            raise InputError("An answer holds something that is not a number.")
        if np.any(np.abs(self.human_inputs) > 1.0):
            raise InputError("A stick input is outside [-1, 1].")

    def __len__(self) -> int:
        """How many answers."""
        return len(self.states)


@dataclass(frozen=True)
class AlignmentContext:
    """What an alignment is for.

    Attributes:
        task: What is steered.
        kinematics: The arm.
        controller: What z goes into.
    """

    task: Task
    kinematics: Kinematics
    controller: LatentController


@dataclass(frozen=True)
class FitProblem(AlignmentContext):
    """Everything that an alignment may be learned from.

    Attributes:
        labels: The person's answers.
        pool: Unlabelled samples: where the arm moves, and where the priors hold.
        steps: Of an optimiser, if there is one; None: as many as suit the method.
    """

    labels: Labels
    pool: QueryPool
    steps: int | None = None


@dataclass(frozen=True)
class Progress:
    """How far a training is: ``fraction`` of its ``steps``, and its losses at ``step``."""

    step: int
    steps: int
    losses: dict[str, float]

    @property
    def fraction(self) -> float:
        """From 0 to 1."""
        return self.step / self.steps


Report = Callable[[Progress], None]


def no_report(progress: Progress) -> None:
    """Ignore progress."""


@dataclass(frozen=True)
class Fit:
    """What a method gives.

    Attributes:
        alignment: The result.
        snapshots: The alignment at fractions of the training, from 0 to 1; the last is the result.
        settings: How it was learned, for a file.
    """

    alignment: Alignment
    snapshots: tuple[tuple[float, Alignment], ...]
    settings: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def at_once(cls, alignment: Alignment) -> "Fit":
        """The fit of a method without steps."""
        return cls(alignment, ((1.0, alignment),))


class Method(ABC):
    """A way to come by an alignment.

    Attributes:
        is_learned: Whether the answers decide the result, so that it is trained and saved.
    """

    is_learned = True

    @abstractmethod
    def fit(self, problem: FitProblem, seed: int, report: Report = no_report) -> Fit:
        """Learn z = f(h, s).

        Args:
            problem: Answers, unlabelled samples, and what the alignment is for.
            seed: All chance: the same seed gives the same bits.
            report: Called with progress now and then, in the calling thread.

        Raises:
            TooFewLabelsError: If there are too few answers to learn from.
            InputError: If the problem lacks what the method needs.
        """

    @abstractmethod
    def from_arrays(self, arrays: Mapping[str, np.ndarray], context: AlignmentContext) -> Alignment:
        """The inverse of :meth:`Alignment.to_arrays`.

        Raises:
            ShapeError: If the numbers are not those of an alignment of this kind and task.
        """
