"""Learning an alignment from a few answers and the priors, in a fraction of a second.

The loss is equation 5 of the paper over a controller expanded once (:mod:`fast_loss`), in units of
the controller's RMS step; Adam with a cosine. :mod:`reference_training` is the same without the
expansion, a hundred times slower.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree

from .alignment import HIDDEN, NetworkAlignment
from .arrays import JointPositions
from .controller import LatentController
from .errors import TooFewLabelsError
from .fast_loss import AlignmentParameters, Labelled, States, Unlabelled, losses
from .fitting import (
    MIN_LABELS,
    AlignmentContext,
    Fit,
    FitProblem,
    Labels,
    Method,
    Progress,
    Report,
    no_report,
)
from .kinematics import Kinematics
from .motion import PoseMeter, root_mean_square
from .network import Mlp
from .priors import ConsistencyForm, PriorWeights, SupervisedForm
from .queries import QueryPool
from .tasks import Task

_RECORDED = 60  # times that progress is reported
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


def settings_for(task: Task) -> TrainingSettings:
    """The settings that suit a task."""
    one_motion = len(task.motions) == 1
    return TrainingSettings(
        steps=1000 if one_motion else 800, neighbours=1.0 if one_motion else 0.1
    )


@dataclass(frozen=True)
class NetworkMethod(Method):
    """The paper's: a network learns from the answers and, if they have weight, from the priors.

    Attributes:
        weights: Of the priors.
        settings: How it is trained; None: as suits the task.
    """

    weights: PriorWeights = field(default_factory=PriorWeights)
    settings: TrainingSettings | None = None

    def fit(self, problem: FitProblem, seed: int, report: Report = no_report) -> Fit:
        """Learn by gradient descent; snapshots are of the beginning, the middle and the end.

        Raises:
            TooFewLabelsError: If there are fewer than two answers.
        """
        if len(problem.labels) < MIN_LABELS:
            raise TooFewLabelsError(f"{len(problem.labels)} answers are too few to learn from.")
        settings = self.settings or settings_for(problem.task)
        if problem.steps is not None:
            settings = replace(settings, steps=problem.steps)
        expanded = expanded_problem(
            problem.controller, problem.kinematics, problem.task, problem.labels, problem.pool
        )
        controller_hash = problem.controller.content_hash
        rng = np.random.default_rng(seed)
        parameters = AlignmentParameters.random(HIDDEN, np.float32, rng)
        snapshots = [(0.0, expanded.alignment(controller_hash, parameters))]
        every = max(1, settings.steps // _RECORDED)
        for step, terms in _descend(parameters, expanded, self.weights, settings, rng):
            if step % every == 0 or step in (1, settings.steps):
                report(Progress(step, settings.steps, terms))
            if step in (settings.steps // 2, settings.steps):
                fraction = 0.5 if step < settings.steps else 1.0
                snapshots.append((fraction, expanded.alignment(controller_hash, parameters)))
        return Fit(snapshots[-1][1], tuple(snapshots), asdict(settings))

    def from_arrays(
        self, arrays: Mapping[str, np.ndarray], context: AlignmentContext
    ) -> NetworkAlignment:
        """The inverse of :meth:`NetworkAlignment.to_arrays`.

        Raises:
            ShapeError: If the numbers are not those of an alignment's network.
        """
        return NetworkAlignment.from_arrays(arrays, context.controller.content_hash)


@dataclass(frozen=True)
class ExpandedProblem:
    """Answers and pool with all that depends on states worked out."""

    labelled: Labelled
    pool: States
    pool_q: JointPositions
    s_mean: np.ndarray
    s_scale: np.ndarray
    unit_m: float

    def alignment(self, controller_hash: str, parameters: AlignmentParameters) -> NetworkAlignment:
        """The alignment with these parameters, in double precision and on its own memory."""
        layers = tuple(
            (weight.astype(np.float64), bias.astype(np.float64))
            for weight, bias in parameters.layers
        )
        return NetworkAlignment(
            mlp=Mlp(layers, "silu"),
            s_mean=self.s_mean,
            s_scale=self.s_scale,
            controller_hash=controller_hash,
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


def learning_rate(settings: TrainingSettings, step: int) -> float:
    """Of a step, counted from 1: a cosine from the whole rate to zero."""
    return settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * (step - 1) / settings.steps))


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
        rate = learning_rate(settings, step)
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
