"""Learning a person's preference where it is simple, and inverting the known controller for z.

What a person wants is simple in the space of the task: the stick they give is a linear map of the
move they see, the same everywhere or nearly so (:mod:`reading` learns it). All that is intricate,
the arm and the controller's latent, is known, and is solved for while driving. There are four to
eight numbers to learn, and answers are regressed on moves: the noise is in the answers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .alignment import Alignment, check_batch
from .arrays import HumanInput, JointPositions, LatentAction
from .controller import LatentController
from .demonstrations import DT_S
from .errors import ShapeError, TooFewLabelsError
from .fitting import (
    MIN_LABELS,
    AlignmentContext,
    Fit,
    FitProblem,
    Labels,
    Method,
    Report,
    no_report,
)
from .kinematics import HandPose, Kinematics
from .queries import QueryPool, long_step
from .reading import MotionMap, Reading, Understanding, read_labels, understand, wish
from .tasks import Task

_NEWTON_STEPS = 3
_PLACES = 200


@dataclass(frozen=True)
class TaskSpaceAlignment(Alignment):
    """z such that the hand makes the move that the person means.

    Attributes:
        task: Whose degrees of freedom the person sees.
        kinematics: The arm.
        controller: What z is for.
        understanding: Of the person.
        unit_m: The step of full stick, in [m].
        expected_error: Of the moves that will be made, over their length; from the answers alone.
    """

    task: Task
    kinematics: Kinematics
    controller: LatentController
    understanding: Understanding
    unit_m: float
    expected_error: float

    @property
    def controller_hash(self) -> str:  # type: ignore[override]
        """Content hash of the controller."""
        return self.controller.content_hash

    def move(self, h: HumanInput, s: JointPositions) -> np.ndarray:
        """The move meant by stick ``h`` at state ``s``, in the task's two DoF, in [m]."""
        check_batch(h, s)
        return self._move(h, self.kinematics.hand_pose(s))

    def _move(self, h: HumanInput, pose: HandPose) -> np.ndarray:
        move: np.ndarray = self.unit_m * wish(
            self.understanding,
            h,
            self.task.dof(pose),
            self.task.motion_at(pose),
            self.task.azimuth(pose),
        )
        return move

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """Solve the known controller for z, by Newton's method with a constant slope."""
        check_batch(h, s)
        before = self.kinematics.hand_pose(s)
        move = self._move(h, before)
        slope = self.task.dof_jacobian(self.kinematics, s) @ self.controller.secant(s) * DT_S
        inverse = np.linalg.inv(slope)
        z = (inverse @ move[..., None])[..., 0]
        for _ in range(_NEWTON_STEPS):
            after = self.kinematics.hand_pose(self.controller.next_state(z, s, DT_S))
            missing = move - self.task.dof_change(before, after)
            z = z + (inverse @ missing[..., None])[..., 0]
        return np.asarray(z)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        reading = self.understanding.reading
        arrays = {
            "unit_m": np.array([self.unit_m]),
            "expected_error": np.array([self.expected_error]),
            "doubtful": np.array(self.understanding.doubtful, dtype=float),
            "reading": np.array(
                [reading.is_polar, reading.exponent, reading.skew, reading.drift, reading.noise]
            ),
        }
        for index, motion_map in enumerate(self.understanding.maps):
            arrays |= {
                f"maps.{index}.is_mirrored": np.array([float(motion_map.is_mirrored)]),
                f"maps.{index}.centres": motion_map.centres,
                f"maps.{index}.c": np.stack([motion_map.c.real, motion_map.c.imag]),
                f"maps.{index}.d": np.stack([motion_map.d.real, motion_map.d.imag]),
                f"maps.{index}.spread": np.array([motion_map.spread]),
            }
        return arrays

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], context: AlignmentContext
    ) -> "TaskSpaceAlignment":
        """The inverse of :meth:`to_arrays`.

        Raises:
            ShapeError: If the numbers do not belong to an alignment of this task.
        """
        try:
            is_polar, *numbers = (float(number) for number in arrays["reading"])
            maps = tuple(
                _motion_map(
                    {
                        name: arrays[f"maps.{index}.{name}"]
                        for name in ("is_mirrored", "centres", "c", "d", "spread")
                    }
                )
                for index in range(len(context.task.motions))
            )
            understanding = Understanding(
                Reading(bool(is_polar), *numbers),
                maps,
                tuple(int(row) for row in arrays["doubtful"]),
            )
            (unit_m,), (expected_error,) = arrays["unit_m"], arrays["expected_error"]
        except (KeyError, TypeError, ValueError) as error:
            raise ShapeError("These numbers are no alignment in the space of this task.") from error
        return cls(
            context.task,
            context.kinematics,
            context.controller,
            understanding,
            float(unit_m),
            float(expected_error),
        )


@dataclass(frozen=True)
class Survey:
    """What a pool says whoever is asked; worked out once, however often a person is refitted.

    Attributes:
        unit_m: How long a long step is, in [m].
        places: For each motion, where its pool's states are in its two DoF, ``(n, 2)`` in [m].
    """

    unit_m: float
    places: tuple[np.ndarray, ...]


def survey(task: Task, kinematics: Kinematics, pool: QueryPool) -> Survey:
    """How far and where the arm will move: from a few hundred of a pool's states."""
    pose = kinematics.hand_pose(pool.states[:: max(1, len(pool) // _PLACES)])
    motion, place = task.motion_at(pose), task.dof(pose)
    places = tuple(place[motion == index] for index in range(len(task.motions)))
    return Survey(long_step(task, kinematics, pool), places)


def fit_task_space(
    controller: LatentController,
    kinematics: Kinematics,
    task: Task,
    labels: Labels,
    seen: Survey,
) -> TaskSpaceAlignment:
    """Understand a person from their answers; takes milliseconds.

    Args:
        controller: What will move the arm.
        kinematics: The arm.
        task: Its degrees of freedom are what the person is taken to see.
        labels: The person's answers.
        seen: How far and where the arm will move.

    Raises:
        TooFewLabelsError: If there are fewer than two answers.
    """
    understanding, expected_error = understand_labels(task, kinematics, labels, seen)
    return TaskSpaceAlignment(
        task=task,
        kinematics=kinematics,
        controller=controller,
        understanding=understanding,
        unit_m=seen.unit_m,
        expected_error=expected_error,
    )


class TaskSpaceMethod(Method):
    """Ours: the person's preference is learned, and the arm that is known is solved for."""

    def fit(self, problem: FitProblem, seed: int, report: Report = no_report) -> Fit:
        """Understand the person; there is no chance in it.

        Raises:
            TooFewLabelsError: If there are fewer than two answers.
        """
        del seed, report
        task, kinematics = problem.task, problem.kinematics
        seen = survey(task, kinematics, problem.pool)
        return Fit.at_once(
            fit_task_space(problem.controller, kinematics, task, problem.labels, seen)
        )

    def from_arrays(
        self, arrays: Mapping[str, np.ndarray], context: AlignmentContext
    ) -> TaskSpaceAlignment:
        """The inverse of :meth:`TaskSpaceAlignment.to_arrays`.

        Raises:
            ShapeError: If the numbers do not belong to an alignment of this task.
        """
        return TaskSpaceAlignment.from_arrays(arrays, context)


def understand_labels(
    task: Task, kinematics: Kinematics, labels: Labels, seen: Survey
) -> tuple[Understanding, float]:
    """What the person means, and the expected error of the moves they would get, over their length.

    Once that error is small, they have been asked enough.

    Raises:
        TooFewLabelsError: If there are fewer than two answers.
    """
    if len(labels) < MIN_LABELS:
        raise TooFewLabelsError(f"{len(labels)} answers are too few to learn from.")
    evidence = read_labels(task, kinematics, labels, seen.unit_m)
    understanding = understand(evidence, seen.places)
    shares = np.array([len(place) for place in seen.places], dtype=float)
    spreads = np.array([motion_map.spread for motion_map in understanding.maps])
    return understanding, float(shares @ spreads / shares.sum())


def _motion_map(arrays: Mapping[str, np.ndarray]) -> MotionMap:
    centres, k = arrays["centres"], len(arrays["centres"])
    if centres.shape != (k, 2) or any(arrays[name].shape != (2, k + 1) for name in ("c", "d")):
        raise ValueError
    return MotionMap(
        is_mirrored=bool(arrays["is_mirrored"].item()),
        centres=centres,
        c=arrays["c"][0] + 1j * arrays["c"][1],
        d=arrays["d"][0] + 1j * arrays["d"][1],
        spread=float(arrays["spread"].item()),
    )
