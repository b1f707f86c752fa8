"""The alignment z = f(h, s): what one person's stick means to the controller (section III-A)."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from jaxtyping import Float

from .arrays import HumanInput, JointPositions, LatentAction
from .errors import InputError, ShapeError
from .network import Mlp
from .panda import N_JOINTS

HIDDEN = 64  # two hidden layers, as in the paper


@dataclass(frozen=True)
class PriorWeights:
    """How much each prior counts beside the labels (lambda 1, 2, 3 of equation 5)."""

    proportionality: float = 0.0
    reversibility: float = 0.0
    consistency: float = 0.0


Kind = Literal["identity", "affine", "network", "task-space"]


@dataclass(frozen=True)
class Strategy:
    """A way to come by an alignment.

    Attributes:
        name: The word in files and addresses.
        title: The word for people.
        kind: What the alignment is made of.
        weights: Of the priors, where a network is learned.
        needs_everything: Whether it is given what nobody has: an exact label for every state.
    """

    name: str
    title: str
    kind: Kind
    weights: PriorWeights = PriorWeights()
    needs_everything: bool = False


# Chosen on simulated people of all three tasks, with seeds from 100 to 105.
_PROPORTIONALITY = 0.5
_REVERSIBILITY = 0.5
_CONSISTENCY = 3.0

STRATEGIES = MappingProxyType(
    {
        strategy.name: strategy
        for strategy in (
            Strategy("no-align", "No alignment", "identity"),
            Strategy("manual-align", "Best affine map", "affine", needs_everything=True),
            Strategy("no-priors", "Answers only", "network"),
            Strategy(
                "proportionality",
                "Answers and proportionality",
                "network",
                PriorWeights(proportionality=_PROPORTIONALITY),
            ),
            Strategy(
                "reversibility",
                "Answers and reversibility",
                "network",
                PriorWeights(reversibility=_REVERSIBILITY),
            ),
            Strategy(
                "consistency",
                "Answers and consistency",
                "network",
                PriorWeights(consistency=_CONSISTENCY),
            ),
            Strategy(
                "all-priors",
                "Answers and priors",
                "network",
                PriorWeights(_PROPORTIONALITY, _REVERSIBILITY, _CONSISTENCY),
            ),
            Strategy("ideal-align", "Every answer", "network", needs_everything=True),
            Strategy("task-space", "Preference and known arm", "task-space"),
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


class Alignment(ABC):
    """A z = f(h, s), learned by a strategy for one controller."""

    strategy: str
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
        """The network's output."""
        check_batch(h, s)
        return self.mlp(np.concatenate([h, (s - self.s_mean) / self.s_scale], axis=-1))

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        return {"s_mean": self.s_mean, "s_scale": self.s_scale, **self.mlp.to_arrays("mlp")}


@dataclass(frozen=True)
class AffineAlignment(Alignment):
    """One affine map for all states: z = matrix h + offset (the paper's "manual align")."""

    strategy: str
    matrix: Float[np.ndarray, "2 2"]
    offset: Float[np.ndarray, "2"]
    controller_hash: str

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The same wherever the arm is."""
        check_batch(h, s)
        z: np.ndarray = h @ self.matrix.T + self.offset
        return z

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        return {"matrix": self.matrix, "offset": self.offset}


def fit_affine(h: HumanInput, z: LatentAction, strategy: str, controller_hash: str) -> Alignment:
    """The affine map that fits sticks ``(n, 2)`` to latent actions ``(n, 2)`` best."""
    inputs = np.concatenate([h, np.ones((len(h), 1))], axis=1)
    solution = np.linalg.lstsq(inputs, z, rcond=None)[0]
    return AffineAlignment(strategy, solution[:2].T.copy(), solution[2].copy(), controller_hash)


def check_batch(h: HumanInput, s: JointPositions) -> None:
    """Refuse sticks and states that do not go together.

    Raises:
        ShapeError: If h and s disagree on the batch.
    """
    if h.shape[:-1] != s.shape[:-1]:
        raise ShapeError(f"{h.shape} stick inputs do not go with {s.shape} states.")
