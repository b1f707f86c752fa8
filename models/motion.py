"""How far the hand got, in the units that losses are made of; exactly, and linearised.

A pose change is the hand's displacement in [m]; where the task counts rotation, the turn (axis
times sine, in the world) follows, times the task's metres per radian.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from .arrays import (
    JointPositions,
    JointTensor,
    PoseChange,
    PoseChangeTensor,
    Scalars,
)
from .controller import LatentController
from .demonstrations import DT_S
from .kinematics import Kinematics, turn


@dataclass(frozen=True)
class PoseMeter:
    """Measures pose changes of the hand, ``(..., 3)`` or with rotation ``(..., 6)``.

    Attributes:
        kinematics: The arm.
        rotation_weight_m: Metres per radian; 0 leaves rotation out.
        unit_m: One unit of the result.
    """

    kinematics: Kinematics
    rotation_weight_m: float
    unit_m: float = 1.0

    def change(self, before: JointPositions, after: JointPositions) -> PoseChange:
        """From one state to another, both in [rad]."""
        start, end = self.kinematics.hand_pose(before), self.kinematics.hand_pose(after)
        change: np.ndarray = end.position - start.position
        if self.rotation_weight_m > 0.0:
            turned = self.rotation_weight_m * turn(start.rotation, end.rotation)
            change = np.concatenate([change, turned], axis=-1)
        return change / self.unit_m

    def change_torch(self, before: JointTensor, after: JointTensor) -> PoseChangeTensor:
        """The same, differentiable."""
        start, start_rotation = self.kinematics.hand_pose_torch(before)
        end, end_rotation = self.kinematics.hand_pose_torch(after)
        change: Tensor = end - start
        if self.rotation_weight_m > 0.0:
            product = end_rotation @ start_rotation.transpose(-1, -2)
            skew = 0.5 * (product - product.transpose(-1, -2))
            turned = torch.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], dim=-1)
            change = torch.cat([change, self.rotation_weight_m * turned], dim=-1)
        return change / self.unit_m

    def per_latent(self, controller: LatentController, s: JointPositions) -> np.ndarray:
        """The matrix B with change = B z for one step from ``s``, ``(..., 3 or 6, 2)``."""
        jacobian = self.kinematics.jacobian(s)
        if self.rotation_weight_m > 0.0:
            jacobian[..., 3:, :] *= self.rotation_weight_m
        else:
            jacobian = jacobian[..., :3, :]
        linear: np.ndarray = jacobian @ controller.secant(s) * (DT_S / self.unit_m)
        return linear


def root_mean_square(changes: PoseChange) -> float:
    """The RMS length of pose changes."""
    squares: Scalars = np.sum(changes**2, axis=-1)
    return float(np.sqrt(np.mean(squares)))
