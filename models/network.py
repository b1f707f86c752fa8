"""The multi-layer perceptron in use: plain numpy, light enough for the control loop."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from .errors import ShapeError

Activation = Literal["tanh", "silu"]
Layer = tuple[np.ndarray, np.ndarray]  # weight (inputs, outputs) and bias (outputs,)


@dataclass(frozen=True)
class Mlp:
    """Layers of ``x @ weight + bias`` with an activation between them.

    Raises:
        ShapeError: If neighbouring layers do not fit.
    """

    layers: tuple[Layer, ...]
    activation: Activation

    def __post_init__(self) -> None:
        """Check that the layers fit."""
        width = self.inputs
        for weight, bias in self.layers:
            if weight.shape != (width, len(bias)):
                raise ShapeError(f"A layer of shape {weight.shape} cannot follow {width} numbers.")
            width = len(bias)

    @property
    def inputs(self) -> int:
        """How many numbers go in."""
        return int(self.layers[0][0].shape[0])

    @property
    def outputs(self) -> int:
        """How many numbers come out."""
        return len(self.layers[-1][1])

    def __call__(self, x: Float[np.ndarray, "*batch n"]) -> Float[np.ndarray, "*batch m"]:
        """The forward pass over any batch."""
        *hidden, (last_weight, last_bias) = self.layers
        is_tanh = self.activation == "tanh"
        for weight, bias in hidden:
            x = x @ weight
            x += bias
            x = np.tanh(x) if is_tanh else silu(x)
        y: np.ndarray = x @ last_weight
        y += last_bias
        return y

    def as_single(self) -> "Mlp":
        """The same network in single precision."""
        layers = [(w.astype(np.float32), b.astype(np.float32)) for w, b in self.layers]
        return Mlp(tuple(layers), self.activation)

    def to_arrays(self, prefix: str) -> dict[str, np.ndarray]:
        """The weights by name, for a file."""
        arrays = {}
        for index, (weight, bias) in enumerate(self.layers):
            arrays[f"{prefix}.{index}.weight"] = weight
            arrays[f"{prefix}.{index}.bias"] = bias
        return arrays

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], prefix: str, activation: Activation
    ) -> "Mlp":
        """The network whose weights :meth:`to_arrays` named.

        Raises:
            ShapeError: If there is no such network among the arrays, or its layers do not fit.
        """
        layers: list[Layer] = []
        while f"{prefix}.{len(layers)}.weight" in arrays:
            name = f"{prefix}.{len(layers)}"
            if f"{name}.bias" not in arrays:
                raise ShapeError(f"The file of weights lacks '{name}.bias'.")
            layers.append((arrays[f"{name}.weight"], arrays[f"{name}.bias"]))
        if not layers:
            raise ShapeError(f"The file of weights holds no network named '{prefix}'.")
        return cls(tuple(layers), activation)


def silu(x: np.ndarray) -> np.ndarray:
    """x times its sigmoid; the sigmoid by tanh, which does not overflow."""
    y: np.ndarray = np.tanh(0.5 * x)
    y += 1.0
    y *= x
    y *= 0.5
    return y
