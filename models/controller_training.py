"""Fitting the controller: a conditional autoencoder on demonstrations, and how good it became."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from .arrays import JointPositions
from .controller import (
    AutoencoderController,
    LatentController,
    LinearController,
    WarpedController,
)
from .demonstrations import DT_S, MAX_SPEED_M_S, Demonstrations
from .kinematics import Kinematics
from .network import Mlp
from .panda import N_JOINTS
from .tasks import Task

_REPORT_EVERY = 100
_SPANNING_CONDITION = 5.0
_SPANNING_SPEED_M_S = 0.2 * MAX_SPEED_M_S
_LATENT_QUANTILE = 0.98
# How far a warped controller's latent turns: the standard deviation over the demonstrations.
_WARP_RAD = 1.2


@dataclass(frozen=True)
class ControllerSettings:
    """How the autoencoder is trained."""

    hidden: int = 64
    steps: int = 10_000
    batch: int = 256
    learning_rate: float = 2e-3
    held_out: float = 1 / 6


@dataclass(frozen=True)
class ControllerQuality:
    """What a controller is worth, on trajectories that it was not trained on.

    Attributes:
        reconstruction_error: RMS error of the decoded action over the RMS action.
        share_spanning: Share of states where z moves the hand well in both degrees of freedom:
            d(dof)/dz has a condition below 5 and gives at least a fifth of the full speed.
        off_task_motion: RMS of what the hand does outside the task over what it does inside, where
            nothing is to be corrected; a radian counts as a lever's length, 0.25 m.
        nonlinearity: RMS of what a = B z misses over the RMS action, z uniform in the unit disc.
        condition_median: Condition of d(dof)/dz, median.
        condition_p95: The same, 95th percentile.
    """

    reconstruction_error: float
    share_spanning: float
    off_task_motion: float
    nonlinearity: float
    condition_median: float
    condition_p95: float


class ConditionalAutoencoder(nn.Module):
    """Action and state to latent (2) and back, with nothing left for the latent 0 to do."""

    def __init__(self, hidden: int, *, is_linear: bool = False) -> None:
        """Two hidden layers each way; the way out through a matrix of the state if linear."""
        super().__init__()
        self.is_linear = is_linear
        self.encoder = _tanh_layers(2 * N_JOINTS, hidden, 2)
        sizes = (N_JOINTS, 2 * N_JOINTS) if is_linear else (2 + N_JOINTS, N_JOINTS)
        self.decoder = _tanh_layers(sizes[0], hidden, sizes[1])

    def encode(self, a: Tensor, s: Tensor) -> Tensor:
        """The raw latent of an action at a state, both normalised; in (-1, 1)^2."""
        return torch.tanh(self.encoder(torch.cat([a, s], dim=-1)))

    def decode(self, z: Tensor, s: Tensor) -> Tensor:
        """The normalised action D(z, s) - D(0, s), or D(s) z."""
        if self.is_linear:
            matrix = self.decoder(s).reshape(-1, N_JOINTS, 2)
            linear: Tensor = (matrix @ z[..., None])[..., 0]
            return linear
        at_rest = torch.zeros_like(z)
        action: Tensor = self.decoder(torch.cat([z, s], dim=-1))
        action_at_rest: Tensor = self.decoder(torch.cat([at_rest, s], dim=-1))
        return action - action_at_rest

    def forward(self, a: Tensor, s: Tensor) -> Tensor:
        """The action after its way through the latent."""
        return self.decode(self.encode(a, s), s)


def fit_controller(
    task: Task,
    kinematics: Kinematics,
    demonstrations: Demonstrations,
    settings: ControllerSettings,
    seed: int,
    on_progress: Callable[[int, float], None] | None = None,
    *,
    is_linear: bool = False,
) -> tuple[LatentController, ControllerQuality]:
    """Train the autoencoder and keep its decoder.

    Args:
        task: What the demonstrations demonstrate.
        kinematics: The arm.
        demonstrations: What to learn from; the last trajectories are held out.
        settings: How.
        seed: All chance: same seed, same weights.
        on_progress: Told the step and the loss, now and then.
        is_linear: Whether the decoder is linear in z.
    """
    training, held_out = demonstrations.split(settings.held_out)
    states, actions = training.pairs()
    s_mean, s_scale, a_scale = _normalisation(states, actions)
    s = torch.from_numpy((states - s_mean) / s_scale).float()
    a = torch.from_numpy(actions / a_scale).float()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = ConditionalAutoencoder(settings.hidden, is_linear=is_linear)
        _train(network, a, s, settings, on_progress)
    with torch.no_grad():
        raw = network.encode(a, s).numpy()
    z_scale = np.quantile(np.abs(raw), _LATENT_QUANTILE, axis=0).astype(np.float64)
    decoder = _to_mlp(network.decoder)
    controller: LatentController
    if is_linear:
        controller = LinearController(decoder, s_mean, s_scale, z_scale, a_scale)
    else:
        controller = AutoencoderController(decoder, s_mean, s_scale, z_scale, a_scale)
    states, actions = held_out.pairs()
    with torch.no_grad():
        s = torch.from_numpy((states - s_mean) / s_scale).float()
        a = torch.from_numpy(actions / a_scale).float()
        missed = _rms((network(a, s) - a).numpy()) / _rms(a.numpy())
    return controller, judge(task, kinematics, controller, missed, np.random.default_rng(seed))


def principal_components(
    task: Task, kinematics: Kinematics, demonstrations: Demonstrations, held_out: float, seed: int
) -> tuple[LatentController, ControllerQuality]:
    """The two directions that the demonstrated actions lie in most, whatever the state."""
    training, rest = demonstrations.split(held_out)
    states, actions = training.pairs()
    s_mean, s_scale, a_scale = _normalisation(states, actions)
    # Not centred: no action is what no input asks for.
    components = np.linalg.svd(actions, full_matrices=False)[2][:2]
    raw = actions @ components.T / a_scale
    controller = LinearController(
        matrix=Mlp(((np.zeros((N_JOINTS, 2 * N_JOINTS)), components.T.ravel().copy()),), "tanh"),
        s_mean=s_mean,
        s_scale=s_scale,
        z_scale=np.quantile(np.abs(raw), _LATENT_QUANTILE, axis=0),
        a_scale=a_scale,
        form="principal",
    )
    _, actions = rest.pairs()
    missed = _rms(actions - actions @ components.T @ components) / _rms(actions)
    return controller, judge(task, kinematics, controller, missed, np.random.default_rng(seed))


def warp(
    task: Task,
    kinematics: Kinematics,
    controller: AutoencoderController,
    quality: ControllerQuality,
    demonstrations: Demonstrations,
    seed: int,
) -> tuple[LatentController, ControllerQuality]:
    """Turn a controller's latent with the state, along where states differ most."""
    states, _ = demonstrations.pairs()
    normalised = (states - controller.s_mean) / controller.s_scale
    main = np.linalg.svd(normalised, full_matrices=False)[2][0]
    main *= np.sign(main[np.argmax(np.abs(main))])
    turns = _WARP_RAD / np.std(normalised @ main) * main / controller.s_scale
    warped = WarpedController(controller, turns)
    rng = np.random.default_rng(seed)
    return warped, judge(task, kinematics, warped, quality.reconstruction_error, rng)


def _normalisation(
    states: JointPositions, actions: JointPositions
) -> tuple[np.ndarray, np.ndarray, float]:
    return states.mean(axis=0), states.std(axis=0), float(np.sqrt(np.mean(actions**2)))


def _train(
    network: ConditionalAutoencoder,
    a: Tensor,
    s: Tensor,
    settings: ControllerSettings,
    on_progress: Callable[[int, float], None] | None,
) -> None:
    optimiser = torch.optim.Adam(network.parameters(), lr=settings.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, settings.steps)
    for step in range(settings.steps):
        rows = torch.randint(len(s), (settings.batch,))
        loss = torch.mean((network(a[rows], s[rows]) - a[rows]) ** 2)
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
        if on_progress is not None and (step + 1) % _REPORT_EVERY == 0:
            on_progress(step + 1, float(loss.detach()))


def judge(
    task: Task,
    kinematics: Kinematics,
    controller: LatentController,
    reconstruction_error: float,
    rng: np.random.Generator,
) -> ControllerQuality:
    """What a controller does over the task, at states that are on it."""
    s, _ = task.demonstrations(kinematics, rng, trajectories=40, steps=50).pairs()
    before = kinematics.hand_pose(s)
    radius, angle = np.sqrt(rng.uniform(size=len(s))), rng.uniform(0, 2 * np.pi, len(s))
    z = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    a = controller.decode(z, s)
    after = kinematics.hand_pose(controller.next_state(z, s, DT_S))
    off = task.off_task_change(before, after)
    inside = task.dof_change(before, after)
    linear = (controller.secant(s) @ z[..., None])[..., 0]
    columns = []
    for step in 0.02 * np.eye(2):
        z_step = np.broadcast_to(step, (len(s), 2))
        there = kinematics.hand_pose(controller.next_state(z_step, s, DT_S))
        back = kinematics.hand_pose(controller.next_state(-z_step, s, DT_S))
        columns.append(task.dof_change(back, there) / (2 * 0.02 * DT_S))
    singular = np.linalg.svd(np.stack(columns, axis=-1), compute_uv=False)
    condition = singular[:, 0] / singular[:, 1]
    spanning = (condition < _SPANNING_CONDITION) & (singular[:, 1] > _SPANNING_SPEED_M_S)
    return ControllerQuality(
        reconstruction_error=reconstruction_error,
        share_spanning=float(np.mean(spanning)),
        off_task_motion=_rms(off) / _rms(inside),
        nonlinearity=_rms(a - linear) / _rms(a),
        condition_median=float(np.median(condition)),
        condition_p95=float(np.quantile(condition, 0.95)),
    )


def _rms(rows: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=-1))))


def _tanh_layers(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, hidden),
        nn.Tanh(),
        nn.Linear(hidden, hidden),
        nn.Tanh(),
        nn.Linear(hidden, outputs),
    )


def _to_mlp(layers: nn.Sequential) -> Mlp:
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    return Mlp(
        tuple(
            (
                layer.weight.detach().double().numpy().T.copy(),
                layer.bias.detach().double().numpy().copy(),
            )
            for layer in linear
        ),
        "tanh",
    )
