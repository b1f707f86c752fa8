"""Learning a person's preference where it is simple, and inverting the known controller for z.

What a person wants is simple in the space of the task: the stick they give is a linear map of the
move they see, the same everywhere or nearly so (:mod:`reading` learns it). All that is intricate,
the arm and the controller's latent, is known, and is solved for while driving. There are four to
eight numbers to learn, and answers are regressed on moves: the noise is in the answers.
"""

from dataclasses import dataclass

import numpy as np

from .alignment import Alignment, check_batch
from .arrays import HumanInput, JointPositions, LatentAction
from .controller import LatentController
from .demonstrations import DT_S
from .errors import TooFewLabelsError
from .kinematics import Kinematics
from .queries import QueryPool, long_step
from .reading import Understanding, read_labels, understand, wish
from .tasks import Task
from .training import MIN_LABELS, Labels

_NEWTON_STEPS = 3


@dataclass(frozen=True)
class TaskSpaceAlignment(Alignment):
    """z such that the hand makes the move that the person means.

    Attributes:
        strategy: Name of the strategy that it was learned by.
        task: Whose degrees of freedom the person sees.
        kinematics: The arm.
        controller: What z is for.
        understanding: Of the person.
        unit_m: The step of full stick, in [m].
        expected_error: Of the moves that will be made, over their length; from the answers alone.
    """

    strategy: str
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
        pose = self.kinematics.hand_pose(s)
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
        move = self.move(h, s)
        slope = self.task.dof_jacobian(self.kinematics, s) @ self.controller.secant(s) * DT_S
        inverse = np.linalg.inv(slope)
        before = self.kinematics.hand_pose(s)
        z = (inverse @ move[..., None])[..., 0]
        for _ in range(_NEWTON_STEPS):
            after = self.kinematics.hand_pose(self.controller.next_state(z, s, DT_S))
            missing = move - self.task.dof_change(before, after)
            z = z + (inverse @ missing[..., None])[..., 0]
        return np.asarray(z)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        arrays = {"unit_m": np.array([self.unit_m])}
        for index, motion_map in enumerate(self.understanding.maps):
            arrays[f"maps.{index}.centres"] = motion_map.centres
            arrays[f"maps.{index}.c"] = np.stack([motion_map.c.real, motion_map.c.imag])
            arrays[f"maps.{index}.d"] = np.stack([motion_map.d.real, motion_map.d.imag])
        return arrays


def fit_task_space(
    controller: LatentController,
    kinematics: Kinematics,
    task: Task,
    labels: Labels,
    pool: QueryPool,
) -> TaskSpaceAlignment:
    """Understand a person from their answers; takes milliseconds.

    Args:
        controller: What will move the arm.
        kinematics: The arm.
        task: Its degrees of freedom are what the person is taken to see.
        labels: The person's answers.
        pool: Says how long a long step is, and where the arm will be.

    Raises:
        TooFewLabelsError: If there are fewer than two answers.
    """
    if len(labels) < MIN_LABELS:
        raise TooFewLabelsError(f"{len(labels)} answers are too few to learn from.")
    unit_m = long_step(task, kinematics, pool)
    evidence = read_labels(task, kinematics, labels, unit_m)
    places = _places(task, kinematics, pool)
    understanding = understand(evidence, places)
    shares = np.array([len(place) for place in places], dtype=float)
    spreads = np.array([motion_map.spread for motion_map in understanding.maps])
    return TaskSpaceAlignment(
        strategy="task-space",
        task=task,
        kinematics=kinematics,
        controller=controller,
        understanding=understanding,
        unit_m=unit_m,
        expected_error=float(shares @ spreads / shares.sum()),
    )


def _places(task: Task, kinematics: Kinematics, pool: QueryPool) -> list[np.ndarray]:
    """Where the hand is in the pool's states, motion by motion; a few hundred of them."""
    states = pool.states[:: max(1, len(pool) // 200)]
    pose = kinematics.hand_pose(states)
    motion, place = task.motion_at(pose), task.dof(pose)
    return [place[motion == index] for index in range(len(task.motions))]
