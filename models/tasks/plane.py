"""Plane: the hand moves in a horizontal plane, pointing down (the paper's easiest task)."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import DofChange, JointPositions, PoseChange
from ..demonstrations import Demonstrations, joints_at, way_point_demonstrations
from ..kinematics import HandPose, Kinematics, turn

_DOWN = np.diag([1.0, -1.0, -1.0])  # R_world_hand of a hand that points down, fingers along y


def _in_front() -> JointPositions:
    # The hand at x = 0.5 m, y = 0, z = 0.25 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, -0.04176, 0.0, -2.33427, 0.0, 2.29251, np.pi / 4])


def _box() -> tuple[np.ndarray, np.ndarray]:
    # In front of the arm, and far enough from where it is stretched out or folded up.
    return np.array([0.35, -0.25]), np.array([0.65, 0.25])


def _along_x_and_y() -> np.ndarray:
    return np.eye(6, 2)


@dataclass(frozen=True)
class Plane:
    """The hand's x and y over the table, at one height."""

    name: str = "plane"
    title: str = "Move in a plane"
    height_m: float = 0.25
    rotation_weight_m: float = 0.0
    home_q: JointPositions = field(default_factory=_in_front)
    workspace: tuple[np.ndarray, np.ndarray] = field(default_factory=_box)
    axes: np.ndarray = field(default_factory=_along_x_and_y)

    def dof(self, pose: HandPose) -> DofChange:
        """The hand's x and y, in [m]."""
        return pose.position[..., :2]

    def pose_at(self, dof: DofChange) -> HandPose:
        """The hand over a point of the plane, pointing down."""
        height = np.full((*dof.shape[:-1], 1), self.height_m)
        return HandPose(
            np.concatenate([dof, height], axis=-1),
            np.broadcast_to(_DOWN, (*dof.shape[:-1], 3, 3)).copy(),
        )

    def dof_change(self, before: HandPose, after: HandPose) -> DofChange:
        """How far the hand got along x and y, in [m]."""
        change: np.ndarray = after.position[..., :2] - before.position[..., :2]
        return change

    def off_task_change(self, before: HandPose, after: HandPose) -> PoseChange:
        """How far the hand rose, in [m], and how it turned, in [rad]: ``(..., 4)``."""
        rise = after.position[..., 2:] - before.position[..., 2:]
        return np.concatenate([rise, turn(before.rotation, after.rotation)], axis=-1)

    def demonstrations(
        self,
        kinematics: Kinematics,
        rng: np.random.Generator,
        trajectories: int,
        steps: int,
        *,
        disturbed: bool = False,
    ) -> Demonstrations:
        """Trajectories through random way-points in the plane."""
        return way_point_demonstrations(
            self, kinematics, rng, trajectories, steps, disturbed=disturbed
        )

    def spread(self, kinematics: Kinematics, grid: tuple[int, int]) -> JointPositions:
        """Joint positions with the hand on a grid over the workspace, row by row along x."""
        low, high = self.workspace
        x, y = np.meshgrid(
            np.linspace(low[0], high[0], grid[0]),
            np.linspace(low[1], high[1], grid[1]),
            indexing="ij",
        )
        return joints_at(self, kinematics, np.stack([x.ravel(), y.ravel()], axis=-1))


PLANE = Plane()
