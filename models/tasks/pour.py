"""Pour: the hand moves along the vertical axis and turns about it (the paper's reading)."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import DofChange, JointPositions
from ..kinematics import HandPose
from .base import LEVER_M, Task

_UP_M = (0.20, 0.45)
_TURN_RAD = 1.2


def _in_front() -> JointPositions:
    # The hand at x = 0.5 m, y = 0, z = 0.325 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, -0.13681, 0.0, -2.23480, 0.0, 2.09800, np.pi / 4])


def _box() -> tuple[np.ndarray, np.ndarray]:
    turned_m = _TURN_RAD * LEVER_M
    return np.array([_UP_M[0], -turned_m]), np.array([_UP_M[1], turned_m])


def _along_and_about_z() -> np.ndarray:
    axes = np.zeros((6, 2))
    axes[2, 0], axes[5, 1] = 1.0, 1.0 / LEVER_M
    return axes


@dataclass(frozen=True)
class PourMotion:
    """The hand's height over one point of the table, and its turn about the vertical.

    Attributes:
        over: The point, x and y in [m].
        home_q: Where the arm starts.
        workspace: Of height and turn.
        axes: See :class:`TwoDofMotion`.
    """

    over: tuple[float, float] = (0.5, 0.0)
    home_q: JointPositions = field(default_factory=_in_front)
    workspace: tuple[np.ndarray, np.ndarray] = field(default_factory=_box)
    axes: np.ndarray = field(default_factory=_along_and_about_z)

    def dof(self, pose: HandPose) -> DofChange:
        """The hand's height and its turn from fingers along y, both in [m]."""
        turned = np.arctan2(pose.rotation[..., 1, 0], pose.rotation[..., 0, 0])
        return np.stack([pose.position[..., 2], LEVER_M * turned], axis=-1)

    def pose_at(self, dof: DofChange) -> HandPose:
        """The hand at a height and turned, pointing down."""
        batch = dof.shape[:-1]
        position = np.broadcast_to(np.array([*self.over, 0.0]), (*batch, 3)).copy()
        position[..., 2] = dof[..., 0]
        turned = dof[..., 1] / LEVER_M
        rotation = np.zeros((*batch, 3, 3))
        rotation[..., 0, 0], rotation[..., 0, 1] = np.cos(turned), np.sin(turned)
        rotation[..., 1, 0], rotation[..., 1, 1] = np.sin(turned), -np.cos(turned)
        rotation[..., 2, 2] = -1.0
        return HandPose(position, rotation)


POUR = Task("pour", (PourMotion(),), rotation_weight_m=LEVER_M)
