"""The alignment z = f(h, s): what one person's stick means to the controller (section III-A)."""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from .arrays import HumanInput, JointPositions, LatentAction
from .errors import InputError, ShapeError
from .network import Mlp
from .panda import N_JOINTS

HIDDEN = 64  # two hidden layers, as in the paper


@dataclass(frozen=True)
class PriorWeights:
    """How much each prior counts beside the labels (lambda 1, 2, 3 of equation 5)."""

    proportionality: float
    reversibility: float
    consistency: float


@dataclass(frozen=True)
class Strategy:
    """A way to come by an alignment.

    Attributes:
        name: The word in files and addresses.
        title: The word for people.
        weights: Of the priors; None where nothing is learned and z = h.
    """

    name: str
    title: str
    weights: PriorWeights | None


# Chosen on simulated people: answers without noise are met as well with a tenth of these weights,
# but only a firm prior outvotes one wrong answer in seven.
_ALL = PriorWeights(proportionality=3.0, reversibility=3.0, consistency=10.0)

STRATEGIES = MappingProxyType(
    {
        strategy.name: strategy
        for strategy in (
            Strategy("no-align", "No alignment", None),
            Strategy("no-priors", "Answers only", PriorWeights(0.0, 0.0, 0.0)),
            Strategy("all-priors", "Answers and priors", _ALL),
        )
    }
)


def get_strategy(name: str) -> Strategy:
    """The strategy of that name.

    Raises:
        InputError: If there is none.
    """
    if name not in STRATEGIES:
        raise InputError(f"There is no strategy '{name}'; choose one of: {', '.join(STRATEGIES)}.")
    return STRATEGIES[name]


@dataclass(frozen=True)
class Alignment:
    """A learned z = f(h, s).

    Attributes:
        strategy: Name of the strategy that it was learned by.
        mlp: From h and the normalised state (9) to z (2).
        s_mean: Subtracted from the state, ``(7,)`` in [rad].
        s_scale: The rest is divided by it, ``(7,)`` in [rad].
        controller_hash: Content hash of the controller that it was learned for.
    """

    strategy: str
    mlp: Mlp
    s_mean: np.ndarray
    s_scale: np.ndarray
    controller_hash: str

    def __post_init__(self) -> None:
        """Check that the parts fit."""
        if (self.mlp.inputs, self.mlp.outputs) != (2 + N_JOINTS, 2):
            raise ShapeError("An alignment's network takes 9 numbers and gives 2.")

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The latent action for stick ``h`` at state ``s`` in [rad].

        Raises:
            ShapeError: If h and s disagree on the batch.
        """
        if h.shape[:-1] != s.shape[:-1]:
            raise ShapeError(f"{h.shape} stick inputs do not go with {s.shape} states.")
        return self.mlp(np.concatenate([h, (s - self.s_mean) / self.s_scale], axis=-1))

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        return {"s_mean": self.s_mean, "s_scale": self.s_scale, **self.mlp.to_arrays("mlp")}
