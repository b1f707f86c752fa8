r"""What people expect of any mapping, and what they answered, as losses (section III-B).

Every function sees the mapping only through a *displacement*: it takes a stick h and a state s and
gives the next state :math:`T_\theta(h, s)` and the hand's pose change
:math:`\Delta x = \Psi(T_\theta(h, s)) - \Psi(s)`, in units of the controller's RMS step. States are
whatever the displacement takes: joint positions where kinematics are in the loop, rows of a table
where everything that depends on the state was worked out before.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from .arrays import PlaneTensor, ScalarTensor

Displacement = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
Pairs = Float[Tensor, "n"]
ConsistencyForm = Literal["scale-free", "raw"]
SupervisedForm = Literal["unsquared", "squared"]

# Keeps the scale-free form finite where nothing moves; in squared units of the RMS step.
STILL = 0.01
# Rounds the tip of the unsquared distance over a tenth of a step, squared: below that an answer is
# as noisy as people are, and its square is averaged better; above it may be wrong.
TIP = 0.1**2


@dataclass(frozen=True)
class PriorWeights:
    """How much each prior counts beside the labels (lambda 1, 2, 3 of equation 5)."""

    proportionality: float = 0.0
    reversibility: float = 0.0
    consistency: float = 0.0


def supervised_loss(
    displacement: Displacement,
    h: PlaneTensor,
    s: Tensor,
    intended: Float[Tensor, "n d"],
    form: SupervisedForm = "unsquared",
) -> ScalarTensor:
    r"""How far the hand ends from where the person meant it to: L_sup, equation 4.

    Unsquared is the paper's :math:`d(s_1, s_2) = \lVert s_1 - s_2 \rVert_2`, which forgives a wrong
    answer; squared is here for comparison.

    Args:
        displacement: The mapping.
        h: The answers, ``(n, 2)``.
        s: The states they were given at.
        intended: The pose change that was shown, ``(n, d)``.
        form: Of the distance.
    """
    _, change = displacement(h, s)
    square = torch.sum((change - intended) ** 2, dim=-1)
    return torch.mean(torch.sqrt(square + TIP) - TIP**0.5 if form == "unsquared" else square)


def proportionality_loss(
    displacement: Displacement, h: PlaneTensor, alpha: Pairs, s: Tensor
) -> ScalarTensor:
    r"""How far alpha times the stick is from alpha times the move: L_prop.

    .. math:: [\Psi(T_\theta(\alpha h, s)) - (\Psi(s) + \alpha \Delta x(s))]^2
    """
    _, change = displacement(h, s)
    _, scaled = displacement(alpha[:, None] * h, s)
    return torch.mean(torch.sum((scaled - alpha[:, None] * change) ** 2, dim=-1))


def reversibility_loss(displacement: Displacement, h: PlaneTensor, s: Tensor) -> ScalarTensor:
    r"""How far the opposite stick is from going back: L_reverse.

    .. math:: [\Psi(s) - \Psi(T_\theta(-h, T_\theta(h, s)))]^2
    """
    there, change = displacement(h, s)
    _, change_back = displacement(-h, there)
    return torch.mean(torch.sum((change + change_back) ** 2, dim=-1))


def consistency_loss(
    displacement: Displacement,
    h: PlaneTensor,
    s_1: Tensor,
    s_2: Tensor,
    nearness: Pairs,
    form: ConsistencyForm = "scale-free",
) -> ScalarTensor:
    r"""How differently the same stick moves the hand at states that are near: L_con.

    .. math:: \exp(-\gamma \lVert s_1 - s_2 \rVert) (\Delta x(s_1) - \Delta x(s_2))^2

    This raw form is also zero for an arm that never moves. The scale-free form divides by
    :math:`\Delta x(s_1)^2 + \Delta x(s_2)^2`, so that standing still earns nothing.

    Args:
        displacement: The mapping.
        h: The same stick for both states, ``(n, 2)``.
        s_1: States.
        s_2: Other states.
        nearness: ``exp(-gamma |s_1 - s_2|)``, see :func:`nearness`.
        form: Raw, as printed, or scale-free.
    """
    _, change_1 = displacement(h, s_1)
    _, change_2 = displacement(h, s_2)
    square = torch.sum((change_1 - change_2) ** 2, dim=-1)
    if form == "scale-free":
        size = torch.sum(change_1**2, dim=-1) + torch.sum(change_2**2, dim=-1)
        square = square / (size + STILL)
    return torch.mean(nearness * square)


def nearness(q_1: Float[Tensor, "n 7"], q_2: Float[Tensor, "n 7"], gamma: float) -> Pairs:
    """The weight of a pair of states in [rad], gamma in [1/rad]."""
    return torch.exp(-gamma * torch.linalg.norm(q_1 - q_2, dim=-1))
