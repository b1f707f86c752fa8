"""Pour a cup: the hand reaches out and in, and tilts what it holds (the user study's Pour)."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import DofChange, JointPositions
from ..kinematics import HandPose
from .base import LEVER_M, Task

_REACH_M = (0.38, 0.64)
_TILT_RAD = (-0.3, 2.3)


def _upright() -> JointPositions:
    # The hand at x = 0.51 m, y = 0, z = 0.3 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, -0.08094, 0.0, -2.23940, 0.0, 2.15846, np.pi / 4])


def _box() -> tuple[np.ndarray, np.ndarray]:
    low, high = (np.array([_REACH_M[end], LEVER_M * _TILT_RAD[end]]) for end in (0, 1))
    return low, high


def _along_and_about_x() -> np.ndarray:
    axes = np.zeros((6, 2))
    axes[0, 0], axes[3, 1] = 1.0, 1.0 / LEVER_M
    return axes


@dataclass(frozen=True)
class TiltMotion:
    """The hand's reach away from the base, and its tilt about that direction.

    Attributes:
        height_m: Of the hand over the table.
        home_q: Where the arm starts.
        workspace: Of reach and tilt.
        axes: See :class:`TwoDofMotion`.
    """

    height_m: float = 0.30
    home_q: JointPositions = field(default_factory=_upright)
    workspace: tuple[np.ndarray, np.ndarray] = field(default_factory=_box)
    axes: np.ndarray = field(default_factory=_along_and_about_x)

    def dof(self, pose: HandPose) -> DofChange:
        """The hand's x and its tilt from pointing down, both in [m]."""
        tilt = np.arctan2(-pose.rotation[..., 2, 1], -pose.rotation[..., 1, 1])
        return np.stack([pose.position[..., 0], LEVER_M * tilt], axis=-1)

    def pose_at(self, dof: DofChange) -> HandPose:
        """The hand over a point of the line y = 0, tilted about it."""
        batch = dof.shape[:-1]
        position = np.broadcast_to(np.array([0.0, 0.0, self.height_m]), (*batch, 3)).copy()
        position[..., 0] = dof[..., 0]
        tilt = dof[..., 1] / LEVER_M
        rotation = np.zeros((*batch, 3, 3))
        rotation[..., 0, 0] = 1.0
        rotation[..., 1, 1], rotation[..., 1, 2] = -np.cos(tilt), np.sin(tilt)
        rotation[..., 2, 1], rotation[..., 2, 2] = -np.sin(tilt), -np.cos(tilt)
        return HandPose(position, rotation)


POUR_CUP = Task("pour-cup", "Pour a cup", (TiltMotion(),), rotation_weight_m=LEVER_M)
