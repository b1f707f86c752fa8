"""The alignment z = f(h, s): what one person's stick means to the controller (section III-A)."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .arrays import HumanInput, JointPositions, LatentAction
from .errors import ShapeError
from .network import Mlp
from .panda import N_JOINTS

HIDDEN = 64  # two hidden layers, as in the paper


class Alignment(ABC):
    """A z = f(h, s) for one controller, whose content hash it holds."""

    controller_hash: str

    @abstractmethod
    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The latent action for stick ``h`` at state ``s`` in [rad].

        Raises:
            ShapeError: If h and s disagree on the batch.
        """

    @abstractmethod
    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""


@dataclass(frozen=True)
class NetworkAlignment(Alignment):
    """The paper's: a network.

    Attributes:
        mlp: From h and the normalised state (9) to z (2).
        s_mean: Subtracted from the state, ``(7,)`` in [rad].
        s_scale: The rest is divided by it, ``(7,)`` in [rad].
        controller_hash: Content hash of the controller that it was learned for.
    """

    mlp: Mlp
    s_mean: np.ndarray
    s_scale: np.ndarray
    controller_hash: str

    def __post_init__(self) -> None:
        """Check that the parts fit."""
        if (self.mlp.inputs, self.mlp.outputs) != (2 + N_JOINTS, 2):
            raise ShapeError("An alignment's network takes 9 numbers and gives 2.")

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The network's output."""
        check_batch(h, s)
        return self.mlp(np.concatenate([h, (s - self.s_mean) / self.s_scale], axis=-1))

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        return {"s_mean": self.s_mean, "s_scale": self.s_scale, **self.mlp.to_arrays("mlp")}

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], controller_hash: str
    ) -> "NetworkAlignment":
        """The inverse of :meth:`to_arrays`.

        Raises:
            ShapeError: If the numbers are not those of an alignment's network.
        """
        return cls(
            mlp=Mlp.from_arrays(arrays, "mlp", "silu"),
            s_mean=array_of(arrays, "s_mean", (N_JOINTS,)),
            s_scale=array_of(arrays, "s_scale", (N_JOINTS,)),
            controller_hash=controller_hash,
        )


def check_batch(h: HumanInput, s: JointPositions) -> None:
    """Refuse sticks and states that do not go together.

    Raises:
        ShapeError: If h and s disagree on the batch.
    """
    if h.shape[:-1] != s.shape[:-1]:
        raise ShapeError(f"{h.shape} stick inputs do not go with {s.shape} states.")


def array_of(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """The array of that name, if its shape is this one.

    Raises:
        ShapeError: If there is none of that name and shape.
    """
    if name not in arrays or arrays[name].shape != shape:
        raise ShapeError(f"The file of weights lacks '{name}' of shape {shape}.")
    return arrays[name]
