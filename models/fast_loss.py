"""The losses of :mod:`priors` and their gradient, by hand, for a controller expanded in z.

One step of the arm is short: where it takes the hand is a polynomial in z very nearly, worked out
once for every state. What is left to differentiate is the alignment network alone, in plain numpy.
The way back of the reversibility prior is taken to start where it ends: a step changes the state,
and with it the polynomial, but little.

``tests/models/test_fast_loss.py`` holds this file against automatic differentiation.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .monomials import monomials, pull_back
from .priors import STILL, TIP, ConsistencyForm, PriorWeights, SupervisedForm

Rows = Float[np.ndarray, "rows _"]


class AlignmentParameters:
    """Weights and biases of a network 9 - hidden - hidden - 2 as views into one vector."""

    def __init__(self, vector: np.ndarray, hidden: int) -> None:
        """Lay the network over ``vector``."""
        self.vector = vector
        self.hidden = hidden
        self.layers: list[tuple[np.ndarray, np.ndarray]] = []
        start = 0
        for inputs, outputs in _sizes(hidden):
            middle, end = start + inputs * outputs, start + (inputs + 1) * outputs
            weight = vector[start:middle].reshape(inputs, outputs)
            self.layers.append((weight, vector[middle:end]))
            start = end

    @classmethod
    def zeros(cls, hidden: int, dtype: type[np.floating]) -> "AlignmentParameters":
        """All zero."""
        size = sum((inputs + 1) * outputs for inputs, outputs in _sizes(hidden))
        return cls(np.zeros(size, dtype=dtype), hidden)

    @classmethod
    def random(
        cls, hidden: int, dtype: type[np.floating], rng: np.random.Generator
    ) -> "AlignmentParameters":
        """Uniform within one over the root of the number of inputs, as torch begins."""
        parameters = cls.zeros(hidden, dtype)
        for weight, bias in parameters.layers:
            bound = 1.0 / np.sqrt(len(weight))
            weight[:] = rng.uniform(-bound, bound, weight.shape)
            bias[:] = rng.uniform(-bound, bound, bias.shape)
        return parameters


@dataclass(frozen=True)
class States:
    """What the network and the losses need to know of states: no kinematics are left.

    Attributes:
        normalised: Joint positions as the network sees them, ``(n, 7)``.
        per_monomial: The hand's pose change per monomial of z, ``(n, d, 9)``.
    """

    normalised: np.ndarray
    per_monomial: np.ndarray

    def at(self, rows: np.ndarray) -> "States":
        """Some of them."""
        return States(self.normalised[rows], self.per_monomial[rows])


@dataclass(frozen=True)
class Labelled:
    """Answers ``(k, 2)``, where they were given, and the pose change shown ``(k, d)``."""

    h: np.ndarray
    states: States
    intended: np.ndarray


@dataclass(frozen=True)
class Unlabelled:
    """Sticks ``(n, 2)`` and scales ``(n,)`` at one state, and at another with its nearness."""

    h: np.ndarray
    alpha: np.ndarray
    states: States
    others: States
    nearness: np.ndarray

    def at(self, index: int) -> "Unlabelled":
        """One step's, where all steps' were drawn at once."""
        return Unlabelled(
            self.h[index],
            self.alpha[index],
            States(self.states.normalised[index], self.states.per_monomial[index]),
            States(self.others.normalised[index], self.others.per_monomial[index]),
            self.nearness[index],
        )


def losses(
    parameters: AlignmentParameters,
    gradient: AlignmentParameters,
    labelled: Labelled,
    unlabelled: Unlabelled | None,
    weights: PriorWeights,
    supervised_form: SupervisedForm,
    consistency_form: ConsistencyForm,
) -> dict[str, float]:
    """Equation 5, term by term before weighting; its gradient goes into ``gradient``."""
    k = len(labelled.h)
    if unlabelled is None:
        x = np.concatenate([labelled.h, labelled.states.normalised], axis=1)
        per_monomial = labelled.states.per_monomial
    else:
        h, here = unlabelled.h, unlabelled.states
        # One pass through the network for everything; in this order below.
        sticks = (labelled.h, h, unlabelled.alpha[:, None] * h, -h, h)
        places = (labelled.states, here, here, here, unlabelled.others)
        x = np.empty((k + 4 * len(h), 9), dtype=h.dtype)
        np.concatenate(sticks, out=x[:, :2])
        np.concatenate([place.normalised for place in places], out=x[:, 2:])
        per_monomial = np.concatenate([place.per_monomial for place in places])
    hidden, z = _forward(parameters, x)
    powers = monomials(z)
    change = (per_monomial @ powers[..., None])[..., 0]
    pull = np.zeros_like(change)  # the loss's derivative in each pose change
    terms = {"supervised": _supervised(change[:k], labelled.intended, pull[:k], supervised_form)}
    if unlabelled is not None:
        terms |= _priors(
            change[k:].reshape(4, len(unlabelled.h), -1),
            pull[k:].reshape(4, len(unlabelled.h), -1),
            unlabelled,
            weights,
            consistency_form,
        )
    powers_pull = (pull[:, None, :] @ per_monomial)[:, 0]
    _backward(parameters, gradient, x, hidden, pull_back(z, powers, powers_pull))
    return terms


def _supervised(change: Rows, intended: Rows, pull: np.ndarray, form: SupervisedForm) -> float:
    missed = change - intended
    square = _squares(missed)
    if form == "squared":
        pull += missed * (2.0 / len(missed))
        return _mean(square)
    distance = np.sqrt(square + TIP)
    pull += missed / (distance[:, None] * len(missed))
    return _mean(distance) - math.sqrt(TIP)


def _priors(
    change: np.ndarray,
    pull: np.ndarray,
    unlabelled: Unlabelled,
    weights: PriorWeights,
    form: ConsistencyForm,
) -> dict[str, float]:
    plain, scaled, opposite, elsewhere = change
    alpha = unlabelled.alpha[:, None]
    n = len(plain)

    unlike = scaled - alpha * plain
    step = (2.0 * weights.proportionality / n) * unlike
    pull[1] += step
    pull[0] -= alpha * step

    left_over = plain + opposite
    step = (2.0 * weights.reversibility / n) * left_over
    pull[0] += step
    pull[2] += step

    apart = plain - elsewhere
    square = _squares(apart)
    share = unlabelled.nearness
    if form == "scale-free":
        size = _squares(plain) + _squares(elsewhere) + STILL
        ratio = square / size
        share = share / size
        inward = (2.0 * weights.consistency / n) * (share * ratio)[:, None]
        pull[0] -= inward * plain
        pull[3] -= inward * elsewhere
    else:
        ratio = square
    step = (2.0 * weights.consistency / n) * share[:, None] * apart
    pull[0] += step
    pull[3] -= step

    return {
        "proportionality": _mean(_squares(unlike)),
        "reversibility": _mean(_squares(left_over)),
        "consistency": _mean(unlabelled.nearness * ratio),
    }


def _forward(
    parameters: AlignmentParameters, x: Rows
) -> tuple[list[tuple[np.ndarray, np.ndarray]], Rows]:
    """The network's output, and for each hidden layer its value and its slope."""
    hidden = []
    *inner, (last_weight, last_bias) = parameters.layers
    value = x
    for weight, bias in inner:
        total = value @ weight
        total += bias
        # One over 1 + exp(-t); capped where exp would overflow in single precision.
        sigmoid = np.minimum(-total, 80.0)
        np.exp(sigmoid, out=sigmoid)
        sigmoid += 1.0
        np.reciprocal(sigmoid, out=sigmoid)
        value = total * sigmoid
        # d/dt t sigma(t) = sigma + t sigma (1 - sigma)
        slope = 1.0 - sigmoid
        slope *= value
        slope += sigmoid
        hidden.append((value, slope))
    z = value @ last_weight
    z += last_bias
    return hidden, z


def _backward(
    parameters: AlignmentParameters,
    gradient: AlignmentParameters,
    x: Rows,
    hidden: list[tuple[np.ndarray, np.ndarray]],
    flow: np.ndarray,
) -> None:
    values = [x, *(value for value, _ in hidden)]
    for index in range(len(parameters.layers) - 1, -1, -1):
        weight, _ = parameters.layers[index]
        weight_gradient, bias_gradient = gradient.layers[index]
        np.matmul(values[index].T, flow, out=weight_gradient)
        np.add.reduce(flow, axis=0, out=bias_gradient)
        if index > 0:
            flow = flow @ weight.T
            flow *= hidden[index - 1][1]


def _squares(rows: Rows) -> np.ndarray:
    squares: np.ndarray = np.einsum("nd,nd->n", rows, rows)
    return squares


def _mean(row: np.ndarray) -> float:
    # np.mean looks at its arguments for longer than it adds.
    return float(np.add.reduce(row)) / len(row)


def _sizes(hidden: int) -> tuple[tuple[int, int], ...]:
    return (9, hidden), (hidden, hidden), (hidden, 2)
