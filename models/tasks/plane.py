"""Plane: the hand moves in a horizontal plane, pointing down (the paper's easiest task)."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import DofChange, JointPositions
from ..kinematics import HandPose
from .base import Task

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
class PlaneMotion:
    """The hand's x and y over the table, at one height."""

    height_m: float = 0.25
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


PLANE = Task("plane", (PlaneMotion(),), rotation_weight_m=0.0)
