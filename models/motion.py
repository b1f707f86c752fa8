"""How far the hand got, in the units that losses are made of; exactly, and expanded in z.

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
from .monomials import SQUARES
from .panda import N_JOINTS


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

    def per_monomial(self, controller: LatentController, s: JointPositions) -> np.ndarray:
        """The polynomial in z that one step from ``s`` is, ``(..., 3 or 6, 9)``.

        The controller is expanded to the third degree, the arm's kinematics to the second.
        """
        jacobian = self.kinematics.jacobian(s)
        step = controller.expand(s) * DT_S  # (..., 7, 9)
        change = jacobian @ step
        change[..., SQUARES] += _bend(jacobian, step[..., :2])
        if self.rotation_weight_m > 0.0:
            change[..., 3:, :] *= self.rotation_weight_m
        else:
            change = change[..., :3, :]
        expanded: np.ndarray = change / self.unit_m
        return expanded


def _bend(jacobian: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Half the second derivative of the hand's pose along a step that is linear in z.

    Joint i turns what joint j does if it comes before it: the axis of the one crosses the
    displacement of the other. Returns the coefficients of x^2, xy, y^2, ``(..., 6, 3)``.
    """
    axes, moves = jacobian[..., 3:, :], jacobian[..., :3, :]
    # Of every pair of joints once, the one nearer to the base first; a joint with itself is half.
    first, second = np.triu_indices(N_JOINTS)
    share = np.where(first == second, 0.5, 1.0)
    bent = [
        share * np.cross(axes[..., first], moves[..., second], axis=-2),
        0.5 * np.cross(axes[..., first], axes[..., second], axis=-2),
    ]
    x, y = step[..., 0], step[..., 1]
    pairs = np.stack(
        [
            x[..., first] * x[..., second],
            x[..., first] * y[..., second] + y[..., first] * x[..., second],
            y[..., first] * y[..., second],
        ],
        axis=-1,
    )
    half: np.ndarray = np.concatenate(bent, axis=-2) @ pairs
    return half


def root_mean_square(changes: PoseChange) -> float:
    """The RMS length of pose changes."""
    squares: Scalars = np.sum(changes**2, axis=-1)
    return float(np.sqrt(np.mean(squares)))
