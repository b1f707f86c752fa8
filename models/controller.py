"""The learned controller: latent action z and state s to joint velocities a (the paper's phi).

A conditional autoencoder (Losey et al. 2020, arXiv:1909.09674) is trained on demonstrations; its
decoder, less what it says for z = 0, is the controller. A stick at rest thus never moves the arm.
"""

import hashlib
from dataclasses import dataclass

import numpy as np

from .arrays import JointPositions, JointVelocities, LatentAction, LatentJacobian
from .errors import ShapeError
from .network import Mlp
from .panda import N_JOINTS, Q_MAX, Q_MIN

# Where the secant is fitted: a ring at the RMS radius of the unit disc. Opposite points cancel
# what is even in z.
_RING = np.arange(6) * (np.pi / 3)
_PROBES = np.sqrt(0.5) * np.stack([np.cos(_RING), np.sin(_RING)], axis=-1)
_DIFFERENCE = 1e-4


@dataclass(frozen=True)
class LatentController:
    """Two numbers and a state in, joint velocities out. Zero exactly at z = 0.

    Attributes:
        decoder: From raw latent and normalised state (9) to normalised action (7).
        s_mean: Mean state of the demonstrations, ``(7,)`` in [rad].
        s_scale: Standard deviation of the same, ``(7,)`` in [rad].
        z_scale: Raw latent per unit of z, ``(2,)``; symmetric, so that 0 stays 0.
        a_scale: One unit of normalised action, in [rad/s].
    """

    decoder: Mlp
    s_mean: np.ndarray
    s_scale: np.ndarray
    z_scale: np.ndarray
    a_scale: float

    def __post_init__(self) -> None:
        """Check that the parts fit."""
        if (self.decoder.inputs, self.decoder.outputs) != (2 + N_JOINTS, N_JOINTS):
            raise ShapeError("A controller's decoder takes 9 numbers and gives 7.")

    def decode(self, z: LatentAction, s: JointPositions) -> JointVelocities:
        """Joint velocities a = D(z, s) - D(0, s), in [rad/s] (equation 1 of the paper).

        Raises:
            ShapeError: If z and s disagree on the batch.
        """
        batch = z.shape[:-1]
        if s.shape[:-1] != batch:
            raise ShapeError(f"{z.shape} latent actions do not go with {s.shape} states.")
        rows = np.empty((2, s.size // N_JOINTS, 2 + N_JOINTS))
        rows[0, :, :2] = (z * self.z_scale).reshape(-1, 2)
        rows[1, :, :2] = 0.0
        rows[:, :, 2:] = ((s - self.s_mean) / self.s_scale).reshape(-1, N_JOINTS)
        with_z, without_z = self.decoder(rows)
        with_z -= without_z
        with_z *= self.a_scale
        a: np.ndarray = with_z.reshape(*batch, N_JOINTS)
        return a

    def next_state(self, z: LatentAction, s: JointPositions, dt_s: float) -> JointPositions:
        """The transition s' = s + a dt, kept inside the joint limits, in [rad]."""
        return np.clip(s + self.decode(z, s) * dt_s, Q_MIN, Q_MAX)

    def linearise(self, s: JointPositions) -> LatentJacobian:
        """da/dz at z = 0, ``(..., 7, 2)`` in [rad/s], by central differences."""
        columns = []
        for step in _DIFFERENCE * np.eye(2):
            z = np.broadcast_to(step, (*s.shape[:-1], 2))
            columns.append((self.decode(z, s) - self.decode(-z, s)) / (2 * _DIFFERENCE))
        return np.stack(columns, axis=-1)

    def secant(self, s: JointPositions) -> LatentJacobian:
        """The matrix B with a = B z nearest over the unit disc, ``(..., 7, 2)`` in [rad/s].

        The fast training uses it in place of the decoder.
        """
        fit = np.linalg.pinv(_PROBES)  # (2, probes)
        rows = np.empty((len(_PROBES), s.size // N_JOINTS, 2 + N_JOINTS))
        rows[:, :, :2] = (_PROBES * self.z_scale)[:, None, :]
        rows[:, :, 2:] = ((s - self.s_mean) / self.s_scale).reshape(-1, N_JOINTS)
        # The weights of the probes sum to zero, and D(0, s) with them.
        secant: np.ndarray = np.einsum("zp,pnj->njz", fit, self.decoder(rows)) * self.a_scale
        return secant.reshape(*s.shape, 2)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the controller by name, for a file."""
        return {
            "s_mean": self.s_mean,
            "s_scale": self.s_scale,
            "z_scale": self.z_scale,
            "a_scale": np.array([self.a_scale]),
            **self.decoder.to_arrays("decoder"),
        }

    @property
    def content_hash(self) -> str:
        """SHA-256 of every number."""
        digest = hashlib.sha256()
        for name, array in sorted(self.to_arrays().items()):
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()
