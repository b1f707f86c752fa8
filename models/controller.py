"""The learned controller: latent action z and state s to joint velocities a (the paper's phi).

The paper's is the decoder of a conditional autoencoder (Losey et al. 2020, arXiv:1909.09674)
trained on demonstrations, less what it says for z = 0: a stick at rest never moves the arm.
Alignments need no more than :class:`LatentController` says, so that any other will do.
"""

import hashlib
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .arrays import JointPositions, JointVelocities, LatentAction, LatentJacobian, Scalars
from .errors import ShapeError
from .monomials import COUNT, monomials
from .network import Mlp
from .panda import N_JOINTS, Q_MAX, Q_MIN

# Where the expansion is fitted: over what a stick in the square may ask for.
_RINGS = ((0.6, 6, 0.0), (1.1, 10, 0.2))  # radius, points, first angle
_SAMPLES = np.concatenate(
    [
        radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        for radius, points, first in _RINGS
        for angle in [first + np.arange(points) * (2 * np.pi / points)]
    ]
)
_TO_MONOMIALS = np.linalg.pinv(monomials(_SAMPLES))  # (9, samples)
# Where the secant is fitted: a ring at the RMS radius of the unit disc. Opposite points cancel
# what is even in z.
_RING = np.arange(6) * (np.pi / 3)
_PROBES = np.sqrt(0.5) * np.stack([np.cos(_RING), np.sin(_RING)], axis=-1)
_TO_SECANT = np.linalg.pinv(_PROBES)  # (2, probes)


class LatentController(ABC):
    """Two numbers and a state in, joint velocities out. Zero exactly at z = 0."""

    @property
    @abstractmethod
    def form(self) -> str:
        """The word for what it is made of, in files and addresses."""

    @abstractmethod
    def decode(self, z: LatentAction, s: JointPositions) -> JointVelocities:
        """Joint velocities a, in [rad/s] (equation 1 of the paper).

        Raises:
            ShapeError: If z and s disagree on the batch.
        """

    @abstractmethod
    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the controller by name, for a file."""

    def next_state(self, z: LatentAction, s: JointPositions, dt_s: float) -> JointPositions:
        """The transition s' = s + a dt, kept inside the joint limits, in [rad]."""
        return np.clip(s + self.decode(z, s) * dt_s, Q_MIN, Q_MAX)

    def secant(self, s: JointPositions) -> LatentJacobian:
        """The matrix B with a = B z nearest over the unit disc, ``(..., 7, 2)`` in [rad/s].

        What :mod:`task_space` begins from when it looks for z.
        """
        z = np.broadcast_to(_PROBES, (*s.shape[:-1], *_PROBES.shape))
        states = np.broadcast_to(s[..., None, :], (*s.shape[:-1], len(_PROBES), N_JOINTS))
        secant: np.ndarray = np.swapaxes(_TO_SECANT @ self.decode(z, states), -1, -2)
        return secant

    def expand(self, s: JointPositions) -> Float[np.ndarray, "*batch 7 9"]:
        """The cubic in z nearest to the decoder, in [rad/s] per :func:`monomials`.

        The fast training uses it in place of the decoder.
        """
        z = np.broadcast_to(_SAMPLES, (*s.shape[:-1], *_SAMPLES.shape))
        states = np.broadcast_to(s[..., None, :], (*s.shape[:-1], len(_SAMPLES), N_JOINTS))
        expanded: np.ndarray = _TO_MONOMIALS @ self.decode(z, states)
        return np.swapaxes(expanded, -1, -2)

    @property
    def content_hash(self) -> str:
        """SHA-256 of every number."""
        digest = hashlib.sha256()
        for name, array in sorted(self.to_arrays().items()):
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True)
class AutoencoderController(LatentController):
    """The paper's: a = D(z, s) - D(0, s).

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

    @property
    def form(self) -> str:
        """An autoencoder's decoder."""
        return "autoencoder"

    def decode(self, z: LatentAction, s: JointPositions) -> JointVelocities:
        """Joint velocities a = D(z, s) - D(0, s), in [rad/s]."""
        batch = _batch(z, s)
        rows = np.empty((2, s.size // N_JOINTS, 2 + N_JOINTS))
        rows[0, :, :2] = (z * self.z_scale).reshape(-1, 2)
        rows[1, :, :2] = 0.0
        rows[:, :, 2:] = ((s - self.s_mean) / self.s_scale).reshape(-1, N_JOINTS)
        with_z, without_z = self.decoder(rows)
        with_z -= without_z
        with_z *= self.a_scale
        a: np.ndarray = with_z.reshape(*batch, N_JOINTS)
        return a

    def expand(self, s: JointPositions) -> Float[np.ndarray, "*batch 7 9"]:
        """As every controller's, in single precision: it is for many states at once."""
        z = np.concatenate([np.zeros((1, 2)), _SAMPLES])
        rows = np.empty((len(z), s.size // N_JOINTS, 2 + N_JOINTS), dtype=np.float32)
        rows[:, :, :2] = (z * self.z_scale)[:, None, :]
        rows[:, :, 2:] = ((s - self.s_mean) / self.s_scale).reshape(-1, N_JOINTS)
        raw = self.decoder.as_single()(rows)
        fit = (_TO_MONOMIALS * self.a_scale).astype(np.float32)
        expanded = np.tensordot(raw[1:] - raw[0], fit, axes=(0, 1))  # (n, 7, 9)
        return expanded.reshape(*s.shape, COUNT).astype(np.float64)

    def secant(self, s: JointPositions) -> LatentJacobian:
        """As every controller's, without the decoder's share at z = 0, which cancels."""
        rows = np.empty((len(_PROBES), s.size // N_JOINTS, 2 + N_JOINTS))
        rows[:, :, :2] = (_PROBES * self.z_scale)[:, None, :]
        rows[:, :, 2:] = ((s - self.s_mean) / self.s_scale).reshape(-1, N_JOINTS)
        secant: np.ndarray = np.einsum("zp,pnj->njz", _TO_SECANT, self.decoder(rows)) * self.a_scale
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


@dataclass(frozen=True)
class LinearController(LatentController):
    """Linear in z: a = D(s) z. Without hidden layers and states: two principal components.

    Attributes:
        matrix: From normalised state (7) to the rows of D (14), per unit of raw latent.
        s_mean: Mean state of the demonstrations, ``(7,)`` in [rad].
        s_scale: Standard deviation of the same, ``(7,)`` in [rad].
        z_scale: Raw latent per unit of z, ``(2,)``.
        a_scale: One unit of normalised action, in [rad/s].
        form: "linear" or "principal".
    """

    matrix: Mlp
    s_mean: np.ndarray
    s_scale: np.ndarray
    z_scale: np.ndarray
    a_scale: float
    form: str = "linear"

    def __post_init__(self) -> None:
        """Check that the parts fit."""
        if (self.matrix.inputs, self.matrix.outputs) != (N_JOINTS, 2 * N_JOINTS):
            raise ShapeError("A linear controller's network takes 7 numbers and gives 14.")

    def decode(self, z: LatentAction, s: JointPositions) -> JointVelocities:
        """Joint velocities a = D(s) z, in [rad/s]."""
        _batch(z, s)
        a: np.ndarray = (self.secant(s) @ z[..., None])[..., 0]
        return a

    def expand(self, s: JointPositions) -> Float[np.ndarray, "*batch 7 9"]:
        """D(s), and nothing of a higher degree."""
        expanded = np.zeros((*s.shape, COUNT))
        expanded[..., :2] = self.secant(s)
        return expanded

    def secant(self, s: JointPositions) -> LatentJacobian:
        """D(s) itself."""
        rows = self.matrix((s - self.s_mean) / self.s_scale)
        secant: np.ndarray = rows.reshape(*s.shape, 2) * self.z_scale * self.a_scale
        return secant

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the controller by name, for a file."""
        return {
            "s_mean": self.s_mean,
            "s_scale": self.s_scale,
            "z_scale": self.z_scale,
            "a_scale": np.array([self.a_scale]),
            **self.matrix.to_arrays("matrix"),
        }


@dataclass(frozen=True)
class WarpedController(LatentController):
    """Another controller whose latent turns with the state: one mapping cannot suit all states.

    Attributes:
        inner: The other controller; at its mean state nothing is turned.
        turns: How much the latent turns with each joint, ``(7,)`` in [rad/rad].
    """

    inner: AutoencoderController
    turns: np.ndarray

    @property
    def form(self) -> str:
        """A latent that turns with the state."""
        return "warped"

    def angle(self, s: JointPositions) -> Scalars:
        """By how much the latent is turned at a state, in [rad]."""
        angle: np.ndarray = (s - self.inner.s_mean) @ self.turns
        return angle

    def decode(self, z: LatentAction, s: JointPositions) -> JointVelocities:
        """Joint velocities of the inner controller for the turned z, in [rad/s]."""
        _batch(z, s)
        angle = self.angle(s)
        cos, sin = np.cos(angle), np.sin(angle)
        turned = np.stack(
            [cos * z[..., 0] - sin * z[..., 1], sin * z[..., 0] + cos * z[..., 1]], axis=-1
        )
        return self.inner.decode(turned, s)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the controller by name, for a file."""
        return {**self.inner.to_arrays(), "warp.turns": self.turns}


def _batch(z: LatentAction, s: JointPositions) -> tuple[int, ...]:
    if s.shape[:-1] != z.shape[:-1]:
        raise ShapeError(f"{z.shape} latent actions do not go with {s.shape} states.")
    return z.shape[:-1]
