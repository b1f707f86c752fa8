"""What a task is to the learning core: two degrees of freedom of the hand, and how to show them."""

from typing import Protocol, runtime_checkable

import numpy as np

from ..arrays import DofChange, JointPositions, PoseChange
from ..demonstrations import Demonstrations, TwoDofMotion
from ..kinematics import HandPose, Kinematics


@runtime_checkable
class Task(TwoDofMotion, Protocol):
    """One way of moving the hand in two degrees of freedom.

    To the motion itself (where it may go, where it starts) it adds names and measures.
    """

    @property
    def name(self) -> str:
        """The word in files and addresses."""
        ...

    @property
    def title(self) -> str:
        """The word for people."""
        ...

    @property
    def height_m(self) -> float:
        """The height of the hand over the table, in [m]."""
        ...

    @property
    def rotation_weight_m(self) -> float:
        """How many metres a turn by one radian counts for (the paper's lambda; Plane: 0)."""
        ...

    def dof_change(self, before: HandPose, after: HandPose) -> DofChange:
        """How far the hand got in the task's two degrees of freedom."""
        ...

    def off_task_change(self, before: HandPose, after: HandPose) -> PoseChange:
        """How far the hand got in the four directions that the task holds still.

        Lengths in [m]; angles in [rad], as if at a lever of one metre.
        """
        ...

    def demonstrations(
        self,
        kinematics: Kinematics,
        rng: np.random.Generator,
        trajectories: int,
        steps: int,
        *,
        disturbed: bool = False,
    ) -> Demonstrations:
        """Moves of the arm that use the task's two degrees of freedom.

        Args:
            kinematics: The arm.
            rng: All chance.
            trajectories: How many.
            steps: How many steps each.
            disturbed: Whether they start beside the task and find back to it while they move.
        """
        ...

    def spread(self, kinematics: Kinematics, grid: tuple[int, int]) -> JointPositions:
        """Joint positions that spread the hand over the workspace, ``(grid[0] * grid[1], 7)``."""
        ...
