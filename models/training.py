"""Learning an alignment from a few answers and the priors, in a fraction of a second.

The loss is equation 5 of the paper over a controller expanded once (:mod:`fast_loss`), in units of
the controller's RMS step; Adam with a cosine. :mod:`reference_training` is the same without the
expansion, a hundred times slower.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .alignment import HIDDEN, NetworkAlignment, PriorWeights, Strategy, get_strategy
from .arrays import HumanInput, JointPositions
from .controller import LatentController
from .errors import InputError, ShapeError, TooFewLabelsError
from .fast_loss import AlignmentParameters, Labelled, States, Unlabelled, losses
from .kinematics import Kinematics
from .motion import PoseMeter, root_mean_square
from .network import Mlp
from .panda import N_JOINTS
from .priors import ConsistencyForm, SupervisedForm
from .queries import QueryPool
from .tasks import Task

# Two directions are the least that can tell a rotation from a mirror.
MIN_LABELS = 2
_RECORDED = 60  # points of the learning curve
# Adam (Kingma & Ba 2015). In a thousand steps slopes are better averaged over more of them, and
# their squares over fewer, than the authors' 0.9 and 0.999 do.
BETAS = (0.95, 0.98)
_TINY = 1e-8


@dataclass(frozen=True)
class TrainingSettings:
    """How an alignment is learned.

    Attributes:
        steps: Of gradient descent.
        batch: Unlabelled states (and pairs of them) a step.
        learning_rate: Adam's, at the beginning; it ends at zero along a cosine.
        gamma: Of the consistency prior, in [1/rad].
        neighbours: Share of the pool that a state's partner in the consistency prior is drawn
            from, nearest first; 1 is any of them. Where the stick's meaning changes with the
            motion, states far apart would be made alike at the price of not moving at all.
        supervised: Form of the supervised loss.
        consistency: Form of the consistency prior.
    """

    steps: int = 1000
    batch: int = 32
    learning_rate: float = 2e-2
    gamma: float = 1.0
    neighbours: float = 1.0
    supervised: SupervisedForm = "unsquared"
    consistency: ConsistencyForm = "scale-free"


def settings_for(task: Task, strategy: Strategy) -> TrainingSettings:
    """The settings that suit a task; with an exact label for every state, longer."""
    one_motion = len(task.motions) == 1
    return TrainingSettings(
        steps=1500 if strategy.needs_everything else 1000 if one_motion else 800,
        neighbours=1.0 if one_motion else 0.1,
    )


@dataclass(frozen=True)
class Labels:
    """A person's answers: states ``(k, 7)``, sticks ``(k, 2)``, intended next states ``(k, 7)``.

    Raises:
        ShapeError: If their numbers disagree.
        InputError: If a number is not finite, or a stick outside [-1, 1]^2.
    """

    states: JointPositions
    human_inputs: HumanInput
    next_states: JointPositions

    def __post_init__(self) -> None:
        """Check the answers."""
        k = len(self.states)
        shapes = self.states.shape, self.human_inputs.shape, self.next_states.shape
        if shapes != ((k, N_JOINTS), (k, 2), (k, N_JOINTS)):
            raise ShapeError(f"Labels of shapes {shapes} do not belong together.")
        arrays = self.states, self.human_inputs, self.next_states
        if not all(np.isfinite(array).all() for array in arrays):
            raise InputError("An answer holds something that is not a number.")
        if np.any(np.abs(self.human_inputs) > 1.0):
            raise InputError("A stick input is outside [-1, 1].")

    def __len__(self) -> int:
        """How many answers."""
        return len(self.states)


@dataclass(frozen=True)
class Progress:
    """How far a training is: ``fraction`` of its ``steps``, and its losses at ``step``."""

    step: int
    steps: int
    losses: dict[str, float]

    @property
    def fraction(self) -> float:
        """From 0 to 1."""
        return self.step / self.steps


@dataclass(frozen=True)
class History:
    """The learning curve: losses by name, unweighted, each as long as ``steps``."""

    steps: tuple[int, ...]
    losses: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Fit:
    """What a training gives.

    Attributes:
        alignment: The result.
        history: The learning curve.
        snapshots: The alignment when 0, half and all of the steps were done.
    """

    alignment: NetworkAlignment
    history: History
    snapshots: tuple[tuple[float, NetworkAlignment], ...]


def fit_alignment(
    strategy: Strategy | str,
    controller: LatentController,
    kinematics: Kinematics,
    task: Task,
    labels: Labels,
    pool: QueryPool,
    settings: TrainingSettings,
    seed: int,
    on_progress: Callable[[Progress], None] | None = None,
) -> Fit:
    """Learn z = f(h, s) from answers and, if the strategy wants them, the priors.

    Args:
        strategy: Which priors.
        controller: What z is for; it stays as it is.
        kinematics: The arm.
        task: Says whether rotation counts.
        labels: The person's answers.
        pool: Unlabelled states, on which the priors hold.
        settings: How.
        seed: All chance: same seed, same bits.
        on_progress: Told now and then, in the calling thread.

    Raises:
        InputError: If nothing is learned in this strategy.
        TooFewLabelsError: If there are fewer than two answers.
    """
    strategy = get_strategy(strategy) if isinstance(strategy, str) else strategy
    if strategy.kind != "network":
        raise InputError(f"With '{strategy.name}' there is nothing to learn.")
    if len(labels) < MIN_LABELS:
        raise TooFewLabelsError(f"{len(labels)} answers are too few to learn from.")
    problem = expanded_problem(controller, kinematics, task, labels, pool)
    rng = np.random.default_rng(seed)
    parameters = AlignmentParameters.random(HIDDEN, np.float32, rng)
    recorder = _Recorder(settings.steps, on_progress)
    snapshots = [(0.0, problem.alignment(strategy, controller, parameters))]
    for step, terms in _descend(parameters, problem, strategy.weights, settings, rng):
        recorder.note(step, terms)
        if step in (settings.steps // 2, settings.steps):
            alignment = problem.alignment(strategy, controller, parameters)
            snapshots.append((0.5 if step < settings.steps else 1.0, alignment))
    return Fit(snapshots[-1][1], recorder.history(), tuple(snapshots))


@dataclass(frozen=True)
class ExpandedProblem:
    """Answers and pool with all that depends on states worked out."""

    labelled: Labelled
    pool: States
    pool_q: JointPositions
    s_mean: np.ndarray
    s_scale: np.ndarray
    unit_m: float

    def alignment(
        self, strategy: Strategy, controller: LatentController, parameters: AlignmentParameters
    ) -> NetworkAlignment:
        """The alignment with these parameters, in double precision and on its own memory."""
        layers = tuple(
            (weight.astype(np.float64), bias.astype(np.float64))
            for weight, bias in parameters.layers
        )
        return NetworkAlignment(
            strategy=strategy.name,
            mlp=Mlp(layers, "silu"),
            s_mean=self.s_mean,
            s_scale=self.s_scale,
            controller_hash=controller.content_hash,
        )


def expanded_problem(
    controller: LatentController,
    kinematics: Kinematics,
    task: Task,
    labels: Labels,
    pool: QueryPool,
    dtype: type[np.floating] = np.float32,
) -> ExpandedProblem:
    """Expand the controller at every state, in units of the pool's RMS step."""
    metres = PoseMeter(kinematics, task.rotation_weight_m)
    unit_m = root_mean_square(metres.change(pool.states, pool.next_states))
    meter = PoseMeter(kinematics, task.rotation_weight_m, unit_m)
    s_mean, s_scale = pool.states.mean(axis=0), pool.states.std(axis=0)

    def states(q: JointPositions) -> States:
        normalised = (q - s_mean) / s_scale
        return States(normalised.astype(dtype), meter.per_monomial(controller, q).astype(dtype))

    labelled = Labelled(
        h=labels.human_inputs.astype(dtype),
        states=states(labels.states),
        intended=meter.change(labels.states, labels.next_states).astype(dtype),
    )
    return ExpandedProblem(labelled, states(pool.states), pool.states, s_mean, s_scale, unit_m)


def draw_unlabelled(
    problem: ExpandedProblem,
    settings: TrainingSettings,
    shape: tuple[int, int],
    rng: np.random.Generator,
) -> Unlabelled:
    """All draws of a training at once, ``(steps, batch)`` of each.

    The stick is uniform in its disc, alpha in [-1, 1].
    """
    dtype = problem.pool.normalised.dtype
    radius, angle = np.sqrt(rng.uniform(size=shape)), rng.uniform(0.0, 2 * np.pi, shape)
    h = (radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).astype(dtype)
    alpha = rng.uniform(-1.0, 1.0, shape).astype(dtype)
    rows = rng.integers(len(problem.pool_q), size=shape)
    other_rows = _partners(problem.pool_q, rows, settings.neighbours, rng)
    apart = np.linalg.norm(problem.pool_q[rows] - problem.pool_q[other_rows], axis=-1)
    nearness = np.exp(-settings.gamma * apart).astype(dtype)
    return Unlabelled(h, alpha, problem.pool.at(rows), problem.pool.at(other_rows), nearness)


def _partners(
    q: JointPositions, rows: np.ndarray, share: float, rng: np.random.Generator
) -> np.ndarray:
    """Another state for each of ``rows``, among the nearest ``share`` of all."""
    if share >= 1.0:
        return np.asarray(rng.integers(len(q), size=rows.shape))
    near = max(1, round(share * len(q)))
    nearest = np.asarray(cKDTree(q).query(q, near + 1)[1])[:, 1:]
    partners: np.ndarray = nearest[rows, rng.integers(near, size=rows.shape)]
    return partners


def _descend(
    parameters: AlignmentParameters,
    problem: ExpandedProblem,
    weights: PriorWeights,
    settings: TrainingSettings,
    rng: np.random.Generator,
) -> Iterator[tuple[int, dict[str, float]]]:
    """Adam; yields the step just done (from 1) and the losses before it."""
    beta_1, beta_2 = BETAS
    use_priors = any((weights.proportionality, weights.reversibility, weights.consistency))
    vector = parameters.vector
    gradient = AlignmentParameters(np.zeros_like(vector), parameters.hidden)
    mean, square = np.zeros_like(vector), np.zeros_like(vector)
    scratch = np.empty_like(vector)
    if use_priors:
        draws = draw_unlabelled(problem, settings, (settings.steps, settings.batch), rng)
    for step in range(1, settings.steps + 1):
        terms = losses(
            parameters,
            gradient,
            problem.labelled,
            draws.at(step - 1) if use_priors else None,
            weights,
            settings.supervised,
            settings.consistency,
        )
        rate = (
            settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * (step - 1) / settings.steps))
        )
        slope = gradient.vector
        mean *= beta_1
        mean += np.multiply(slope, 1.0 - beta_1, out=scratch)
        square *= beta_2
        np.multiply(slope, slope, out=scratch)
        scratch *= 1.0 - beta_2
        square += scratch
        np.sqrt(square, out=scratch)
        scratch *= 1.0 / math.sqrt(1.0 - beta_2**step)
        scratch += _TINY
        np.divide(mean, scratch, out=scratch)
        scratch *= rate / (1.0 - beta_1**step)
        vector -= scratch
        yield step, terms


class _Recorder:
    """Keeps the learning curve and tells who listens."""

    def __init__(self, steps: int, on_progress: Callable[[Progress], None] | None) -> None:
        self._steps = steps
        self._every = max(1, steps // _RECORDED)
        self._on_progress = on_progress
        self._at: list[int] = []
        self._losses: dict[str, list[float]] = {}

    def note(self, step: int, terms: dict[str, float]) -> None:
        if step % self._every and step not in (1, self._steps):
            return
        self._at.append(step)
        for name, loss in terms.items():
            self._losses.setdefault(name, []).append(loss)
        if self._on_progress is not None:
            self._on_progress(Progress(step, self._steps, terms))

    def history(self) -> History:
        curves = {name: tuple(curve) for name, curve in self._losses.items()}
        return History(tuple(self._at), curves)
