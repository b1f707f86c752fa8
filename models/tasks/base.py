"""What a task is to the learning core: two degrees of freedom of the hand, perhaps by turns."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..arrays import DofChange, Indices, JointPositions, PoseChange, Scalars
from ..demonstrations import (
    BEYOND_M,
    Demonstrations,
    TwoDofMotion,
    joints_at,
    way_point_demonstrations,
)
from ..kinematics import HandPose, Kinematics, rotated, turn
from ..props import Props
from ..simulation import Simulation
from .attempt import Attempt, FreeDrive, FreePhase, Phase

# What a turn by one radian counts for, in [m]: 0.8 rad/s is as fast as 0.2 m/s.
LEVER_M = 0.25


def drive_freely(
    simulation: Simulation, kinematics: Kinematics, rng: np.random.Generator
) -> Attempt:
    """Leave the arm where it is, and want nothing."""
    del kinematics, rng
    return FreeDrive(simulation)


@dataclass(frozen=True)
class Task:
    """One motion of the hand, or two of which the hand's height says which it is.

    Degrees of freedom are in [m]; a turn counts :data:`LEVER_M` for each radian.

    Attributes:
        name: The word in files and addresses.
        motions: One or two.
        rotation_weight_m: How many metres a turn by one radian counts for in losses (the paper's
            lambda; Plane: 0).
        boundary_m: A hand higher than this is in the second motion.
        props: What there is beside the arm and the table.
        begin: Puts arm and props where an attempt begins, by chance, and watches over it.
        phases: Those that an attempt goes through.
    """

    name: str
    motions: tuple[TwoDofMotion, ...]
    rotation_weight_m: float
    boundary_m: float = np.inf
    props: Props = field(default_factory=Props)
    begin: Callable[[Simulation, Kinematics, np.random.Generator], Attempt] = drive_freely
    phases: type[Phase] = FreePhase

    @property
    def has_goal(self) -> bool:
        """Whether there is anything to achieve when it is driven."""
        return self.begin is not drive_freely

    @property
    def home_q(self) -> JointPositions:
        """Where the arm starts, ``(7,)`` in [rad]."""
        return self.motions[0].home_q

    @property
    def workspace(self) -> tuple[np.ndarray, np.ndarray]:
        """Low and high corner of the first motion's degrees of freedom, each ``(2,)`` in [m]."""
        return self.motions[0].workspace

    @property
    def height_m(self) -> float:
        """How high the hand is at the start, in [m]."""
        middle = np.mean(self.workspace, axis=0)
        return float(self.motions[0].pose_at(middle).position[2])

    @property
    def outline(self) -> np.ndarray:
        """Round what the hand may do in the first motion: places ``(4, 3)`` in [m]."""
        (x_low, y_low), (x_high, y_high) = self.workspace
        corners = np.array([[x_low, y_low], [x_high, y_low], [x_high, y_high], [x_low, y_high]])
        return self.pose_at(corners).position

    def motion_at(self, pose: HandPose) -> Indices:
        """Which of the motions the hand is in: ``(...)``, counted from 0."""
        return np.asarray(pose.position[..., 2] > self.boundary_m).astype(np.int64)

    def dof(self, pose: HandPose) -> DofChange:
        """Where the hand is in the two degrees of freedom of its motion."""
        return self._by_motion(pose, [motion.dof(pose) for motion in self.motions])

    def pose_at(self, dof: DofChange, motion: int = 0) -> HandPose:
        """The pose that a motion asks for at a point of its degrees of freedom."""
        return self.motions[motion].pose_at(dof)

    def dof_change(self, before: HandPose, after: HandPose) -> DofChange:
        """How far the hand got, in one step, in the two degrees of freedom of where it began."""
        change = _change(before, after)
        moves = [change @ to_dof.T for to_dof in self._to_dof]
        return self._by_motion(before, moves)

    def moved(self, pose: HandPose, change: DofChange) -> HandPose:
        """The pose after a small change in the two degrees of freedom: undoes ``dof_change``."""
        moves = [change @ motion.axes.T for motion in self.motions]
        way = self._by_motion(pose, moves)
        return HandPose(pose.position + way[..., :3], rotated(pose.rotation, way[..., 3:]))

    def dof_jacobian(self, kinematics: Kinematics, q: JointPositions) -> np.ndarray:
        """How fast the hand gets along with each joint, ``(..., 2, 7)`` in [m/rad]."""
        jacobian = kinematics.jacobian(q)
        rows = [to_dof @ jacobian for to_dof in self._to_dof]
        return rows[0] if len(rows) == 1 else self._by_motion(kinematics.hand_pose(q), rows)

    def off_task_change(self, before: HandPose, after: HandPose) -> PoseChange:
        """How far the hand got in the four directions that the task holds still, in [m]."""
        change = _change(before, after)
        change[..., 3:] *= LEVER_M
        still = [change[..., np.all(motion.axes == 0.0, axis=1)] for motion in self.motions]
        return self._by_motion(before, still)

    def azimuth(self, pose: HandPose) -> Scalars:
        """Where the hand is round the base, in [rad], if its motion is along x and y; else 0."""
        around = np.arctan2(pose.position[..., 1], pose.position[..., 0])
        level = [np.all(np.any(motion.axes[:2] != 0.0, axis=1)) for motion in self.motions]
        return self._by_motion(pose, [np.asarray(around * is_level) for is_level in level])

    def stays_inside(self, pose: HandPose, change: DofChange) -> np.ndarray:
        """Whether the hand is still over the workspace when it got by ``change``: ``(...)``."""
        inside = []
        for motion in self.motions:
            low, high = motion.workspace[0] - BEYOND_M, motion.workspace[1] + BEYOND_M
            there = motion.dof(pose) + change
            inside.append(np.asarray(np.all((there >= low) & (there <= high), axis=-1)))
        return self._by_motion(pose, inside)

    def demonstrations(
        self,
        kinematics: Kinematics,
        rng: np.random.Generator,
        trajectories: int,
        steps: int,
        *,
        disturbed: bool = False,
    ) -> Demonstrations:
        """Trajectories through random way-points, as many of one motion as of the other.

        Args:
            kinematics: The arm.
            rng: All chance.
            trajectories: How many.
            steps: How many steps each.
            disturbed: Whether they start beside the task and find back to it while they move.
        """
        each = -(-trajectories // len(self.motions))
        parts = [
            way_point_demonstrations(motion, kinematics, rng, each, steps, disturbed=disturbed)
            for motion in self.motions
        ]
        # By turns, so that a share from the end holds as much of one as of the other.
        states = np.stack([part.states for part in parts], axis=1)
        actions = np.stack([part.actions for part in parts], axis=1)
        shape = (-1, *states.shape[2:])
        return Demonstrations(
            states.reshape(shape)[:trajectories], actions.reshape(shape)[:trajectories]
        )

    def spread(self, kinematics: Kinematics, grid: tuple[int, int]) -> JointPositions:
        """Joint positions with the hand on a grid over the first motion's workspace.

        Row by row along its first degree of freedom, ``(grid[0] * grid[1], 7)``.
        """
        low, high = self.workspace
        first, second = np.meshgrid(
            np.linspace(low[0], high[0], grid[0]),
            np.linspace(low[1], high[1], grid[1]),
            indexing="ij",
        )
        points = np.stack([first.ravel(), second.ravel()], axis=-1)
        return joints_at(self.motions[0], kinematics, points)

    @cached_property
    def _to_dof(self) -> tuple[np.ndarray, ...]:
        """For each motion, from a change of the hand's pose to its degrees of freedom, (2, 6)."""
        return tuple(np.linalg.pinv(motion.axes) for motion in self.motions)

    def _by_motion(self, pose: HandPose, choices: list[np.ndarray]) -> np.ndarray:
        if len(choices) == 1:
            return np.asarray(choices[0])
        is_second = self.motion_at(pose) == 1
        while choices[0].ndim > is_second.ndim:
            is_second = is_second[..., None]
        return np.asarray(np.where(is_second, choices[1], choices[0]))


def _change(before: HandPose, after: HandPose) -> np.ndarray:
    """Displacement in [m] and turn in [rad], ``(..., 6)``."""
    way = after.position - before.position
    return np.concatenate([way, turn(before.rotation, after.rotation)], axis=-1)
