"""Where the hand is (the paper's Psi) and how it moves, for any batch of joint positions.

``T_world_hand`` maps hand coordinates to world coordinates; the world's origin is the arm's base,
z up. The hand is the frame between the finger tips, ``panda.HAND_FRAME``.
"""

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytorch_kinematics
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from .arrays import (
    HandJacobian,
    HandPosition,
    HandRotation,
    JointPositions,
    JointTensor,
    PositionTensor,
    RotationTensor,
)
from .errors import PandaPackError
from .panda import HAND_FRAME, N_JOINTS


@dataclass(frozen=True)
class HandPose:
    """Where the hand is: position in [m] and rotation ``R_world_hand``, over any batch."""

    position: HandPosition
    rotation: HandRotation


class Kinematics:
    """The arm as a serial chain, in double precision."""

    def __init__(self, chain: pytorch_kinematics.SerialChain) -> None:
        """Keep the chain; :meth:`from_urdf` makes one."""
        self._chain = chain

    @classmethod
    def from_urdf(cls, path: Path) -> "Kinematics":
        """Read the arm from its URDF.

        Raises:
            PandaPackError: If there is no such file, or the chain to the hand has not seven joints.
        """
        try:
            urdf = path.read_bytes()
        except OSError as error:
            raise PandaPackError(f"The arm's description cannot be read from {path}.") from error
        # The parser names every attribute it does not know on stderr.
        with contextlib.redirect_stderr(io.StringIO()):
            chain = pytorch_kinematics.build_serial_chain_from_urdf(urdf, HAND_FRAME)
        joints = len(chain.get_joint_parameter_names())
        if joints != N_JOINTS:
            raise PandaPackError(f"The arm should have {N_JOINTS} joints; {path} has {joints}.")
        return cls(chain.to(dtype=torch.float64))

    def hand_pose(self, q: JointPositions) -> HandPose:
        """The hand's pose at joint positions ``q`` in [rad]."""
        with torch.no_grad():
            position, rotation = self.hand_pose_torch(_tensor(q))
        return HandPose(position.numpy(), rotation.numpy())

    def jacobian(self, q: JointPositions) -> HandJacobian:
        """The hand's velocity per joint velocity, in the world: linear rows above angular ones."""
        with torch.no_grad():
            rows = _tensor(q).reshape(-1, N_JOINTS)
            jacobian: np.ndarray = self._chain.jacobian_tensor(rows).numpy()
        return jacobian.reshape(*q.shape[:-1], 6, N_JOINTS)

    def hand_pose_torch(self, q: JointTensor) -> tuple[PositionTensor, RotationTensor]:
        """The hand's position in [m] and rotation, differentiable in ``q`` (double precision)."""
        frames: Tensor = self._chain.forward_kinematics_tensor(q.reshape(-1, N_JOINTS))
        hand = frames[self._chain.frame_to_idx[HAND_FRAME]]
        batch = q.shape[:-1]
        return hand[:, :3, 3].reshape(*batch, 3), hand[:, :3, :3].reshape(*batch, 3, 3)


def turn(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The turn from one rotation to another: its axis in the world times sin(angle), ``(..., 3)``.

    Equal to the rotation vector up to the third order; smooth at zero.
    """
    change: np.ndarray = after @ np.swapaxes(before, -1, -2)
    skew: np.ndarray = 0.5 * (change - np.swapaxes(change, -1, -2))
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def rotated(rotation: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The rotation after a turn about ``change``, ``(..., 3)`` in [rad], an axis in the world."""
    turned: np.ndarray = Rotation.from_rotvec(change).as_matrix() @ rotation
    return turned


def _tensor(q: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(q, dtype=np.float64))
