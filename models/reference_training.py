"""The same training without a short cut: kinematics and decoder in the loop, the whole pool a step.

Straightforward and slow. It is what :mod:`training` is measured against, for speed and for
correctness.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from .alignment import HIDDEN, NetworkAlignment
from .arrays import JointTensor, PlaneTensor
from .controller import AutoencoderController
from .demonstrations import DT_S
from .fitting import Labels
from .kinematics import Kinematics
from .motion import PoseMeter, root_mean_square
from .network import Mlp
from .priors import (
    Displacement,
    PriorWeights,
    consistency_loss,
    nearness,
    proportionality_loss,
    reversibility_loss,
    supervised_loss,
)
from .queries import QueryPool
from .tasks import Task
from .training import BETAS, TrainingSettings


@dataclass(frozen=True)
class ExactProblem:
    """Answers and pool, with the arm and the controller as they are."""

    controller: AutoencoderController
    meter: PoseMeter
    labels: Labels
    pool: QueryPool
    s_mean: np.ndarray
    s_scale: np.ndarray

    @classmethod
    def build(
        cls,
        controller: AutoencoderController,
        kinematics: Kinematics,
        task: Task,
        labels: Labels,
        pool: QueryPool,
    ) -> "ExactProblem":
        """In units of the pool's RMS step, as :func:`training.expanded_problem`."""
        metres = PoseMeter(kinematics, task.rotation_weight_m)
        unit_m = root_mean_square(metres.change(pool.states, pool.next_states))
        meter = PoseMeter(kinematics, task.rotation_weight_m, unit_m)
        s_mean, s_scale = pool.states.mean(axis=0), pool.states.std(axis=0)
        return cls(controller, meter, labels, pool, s_mean, s_scale)

    def displacement(self, network: nn.Sequential) -> Displacement:
        """T and the hand's pose change for an alignment network under training."""
        mean, scale = torch.from_numpy(self.s_mean), torch.from_numpy(self.s_scale)

        def displace(h: PlaneTensor, s: JointTensor) -> tuple[Tensor, Tensor]:
            z = network(torch.cat([h, (s - mean) / scale], dim=-1))
            there = s + decode_torch(self.controller, z, s) * DT_S
            return there, self.meter.change_torch(s, there)

        return displace

    def losses(
        self,
        network: nn.Sequential,
        settings: TrainingSettings,
        rng: np.random.Generator,
        *,
        with_priors: bool,
    ) -> dict[str, Tensor]:
        """Every term of equation 5, over all answers and the whole pool, before weighting."""
        displace = self.displacement(network)
        labels = self.labels
        intended = self.meter.change(labels.states, labels.next_states)
        terms = {
            "supervised": supervised_loss(
                displace,
                torch.from_numpy(labels.human_inputs),
                torch.from_numpy(labels.states),
                torch.from_numpy(intended),
                settings.supervised,
            )
        }
        if with_priors:
            n = len(self.pool)
            s = torch.from_numpy(self.pool.states)
            others = s[torch.from_numpy(rng.permutation(n))]
            h = torch.from_numpy(rng.uniform(-1.0, 1.0, (n, 2)))
            alpha = torch.from_numpy(rng.uniform(-1.0, 1.0, n))
            near = nearness(s, others, settings.gamma)
            terms["proportionality"] = proportionality_loss(displace, h, alpha, s)
            terms["reversibility"] = reversibility_loss(displace, h, s)
            terms["consistency"] = consistency_loss(
                displace, h, s, others, near, settings.consistency
            )
        return terms


def fit_reference(
    weights: PriorWeights,
    controller: AutoencoderController,
    kinematics: Kinematics,
    task: Task,
    labels: Labels,
    pool: QueryPool,
    settings: TrainingSettings,
    seed: int,
) -> NetworkAlignment:
    """Learn by gradient descent on the exact losses; ``settings.batch`` is not used."""
    problem = ExactProblem.build(controller, kinematics, task, labels, pool)
    rng = np.random.default_rng(seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = _network()
    optimiser = torch.optim.Adam(network.parameters(), lr=settings.learning_rate, betas=BETAS)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, settings.steps)
    factors = {
        "supervised": 1.0,
        "proportionality": weights.proportionality,
        "reversibility": weights.reversibility,
        "consistency": weights.consistency,
    }
    with_priors = any(factor > 0.0 for name, factor in factors.items() if name != "supervised")
    for _ in range(settings.steps):
        terms = problem.losses(network, settings, rng, with_priors=with_priors)
        total = torch.stack([factors[name] * term for name, term in terms.items()]).sum()
        optimiser.zero_grad()
        total.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
    return NetworkAlignment(
        mlp=_to_mlp(network),
        s_mean=problem.s_mean,
        s_scale=problem.s_scale,
        controller_hash=controller.content_hash,
    )


def exact_losses(
    alignment: NetworkAlignment, problem: ExactProblem, settings: TrainingSettings, seed: int
) -> dict[str, float]:
    """Every term of equation 5 for a finished alignment, exactly."""
    with torch.no_grad():
        network = _from_mlp(alignment.mlp)
        terms = problem.losses(network, settings, np.random.default_rng(seed), with_priors=True)
    return {name: float(term) for name, term in terms.items()}


def decode_torch(controller: AutoencoderController, z: Tensor, s: Tensor) -> Tensor:
    """:meth:`AutoencoderController.decode`, differentiable."""
    state = (s - torch.from_numpy(controller.s_mean)) / torch.from_numpy(controller.s_scale)
    raw = z * torch.from_numpy(controller.z_scale)
    with_z = _apply(controller.decoder, torch.cat([raw, state], dim=-1))
    without_z = _apply(controller.decoder, torch.cat([torch.zeros_like(raw), state], dim=-1))
    return (with_z - without_z) * controller.a_scale


def _apply(mlp: Mlp, x: Tensor) -> Tensor:
    *hidden, (last_weight, last_bias) = mlp.layers
    for weight, bias in hidden:
        x = x @ torch.from_numpy(weight) + torch.from_numpy(bias)
        x = torch.tanh(x) if mlp.activation == "tanh" else nn.functional.silu(x)
    return x @ torch.from_numpy(last_weight) + torch.from_numpy(last_bias)


def _network() -> nn.Sequential:
    sizes = (9, HIDDEN, HIDDEN, 2)
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        layers += [nn.Linear(inputs, outputs, dtype=torch.float64), nn.SiLU()]
    return nn.Sequential(*layers[:-1])


def _from_mlp(mlp: Mlp) -> nn.Sequential:
    network = _network()
    with torch.no_grad():
        for layer, (weight, bias) in zip(_linear(network), mlp.layers, strict=True):
            layer.weight.copy_(torch.from_numpy(weight.T.copy()))
            layer.bias.copy_(torch.from_numpy(bias))
    return network


def _to_mlp(network: nn.Sequential) -> Mlp:
    layers = tuple(
        (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy())
        for layer in _linear(network)
    )
    return Mlp(layers, "silu")


def _linear(network: nn.Sequential) -> list[nn.Linear]:
    return [layer for layer in network if isinstance(layer, nn.Linear)]
