"""The moves that a person is asked about: drawing (the paper's Steps 1-5) and showing them."""

from dataclasses import dataclass

import numpy as np

from .arrays import Indices, JointPath, JointPositions, LatentAction, Scalars
from .controller import LatentController
from .demonstrations import DT_S
from .errors import InputError, ShapeError
from .kinematics import Kinematics
from .panda import Q_MAX, Q_MIN
from .tasks import Task

# Demonstrations from which states are drawn.
_STEPS = 40
_SPARE = 2
_LONG_QUANTILE = 0.97
# The state hardly changes what z does within a step: each iteration gains a factor of ten.
_BACKWARD_ITERATIONS = 6
# A shown move is this long at most; only moves that keep to the workspace are shown.
SHOWN_STEPS = 10


@dataclass(frozen=True)
class QueryPool:
    """The unlabelled samples: n states, a random latent action at each, and where it leads.

    Attributes:
        states: s, ``(n, 7)`` in [rad].
        latents: z, ``(n, 2)``, uniform in the unit disc.
        next_states: s* after one step, ``(n, 7)`` in [rad].
        travel_m: How far that step takes the hand, ``(n,)``.
        length_m: How long that step is in the task's degrees of freedom, in which a turn counts,
            ``(n,)``.
        can_show: Whether a shown move through the state stays over the workspace, ``(n,)``.
    """

    states: JointPositions
    latents: LatentAction
    next_states: JointPositions
    travel_m: Scalars
    length_m: Scalars
    can_show: np.ndarray

    def __len__(self) -> int:
        """How many samples."""
        return len(self.states)


@dataclass(frozen=True)
class Query:
    """A move as it is shown, and the one step of it that an answer is about.

    Attributes:
        s: The state in the middle of the move, ``(7,)`` in [rad].
        z: The latent action, the same all the way, ``(2,)``.
        next_s: The state one step after ``s``.
        path: The whole move, ``(steps + 1, 7)``, one state every 0.1 s.
    """

    s: JointPositions
    z: LatentAction
    next_s: JointPositions
    path: JointPath


def sample_pool(
    task: Task,
    controller: LatentController,
    kinematics: Kinematics,
    n: int,
    rng: np.random.Generator,
) -> QueryPool:
    """Steps 1-4: draw states, a latent action at each, and see where it leads.

    Args:
        task: States are drawn from its demonstrations.
        controller: What moves the arm.
        kinematics: The arm.
        n: How many samples (the paper's N).
        rng: All chance.

    Raises:
        InputError: If ``n`` is not positive.
    """
    if n < 1:
        raise InputError(f"A pool of {n} samples cannot be drawn.")
    trajectories = -(-_SPARE * n // _STEPS)
    found, _ = task.demonstrations(kinematics, rng, trajectories, _STEPS).pairs()
    states = found[rng.choice(len(found), n, replace=False)]
    radius, angle = np.sqrt(rng.uniform(size=n)), rng.uniform(0.0, 2 * np.pi, n)
    latents = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    next_states = controller.next_state(latents, states, DT_S)
    before, after = kinematics.hand_pose(states), kinematics.hand_pose(next_states)
    change = task.dof_change(before, after)
    half = SHOWN_STEPS / 2 * change
    return QueryPool(
        states=states,
        latents=latents,
        next_states=next_states,
        travel_m=np.linalg.norm(after.position - before.position, axis=-1),
        length_m=np.linalg.norm(change, axis=-1),
        can_show=task.stays_inside(before, half) & task.stays_inside(before, -half),
    )


def long_step(task: Task, kinematics: Kinematics, pool: QueryPool) -> float:
    """A long step among the pool's, in [m] of the task: what full stick should reach."""
    before, after = kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    lengths = np.linalg.norm(task.dof_change(before, after), axis=-1)
    return float(np.quantile(lengths, _LONG_QUANTILE))


def choose_queries(
    pool: QueryPool, k: int, rng: np.random.Generator, min_length_m: float
) -> list[int]:
    """Step 5: which samples to ask about, at random and none twice.

    Only samples that can be shown inside the workspace and whose step is ``min_length_m`` long or
    longer: nobody can say what they would do for a move they cannot see.

    Raises:
        InputError: If the pool has fewer than ``k`` such samples.
    """
    fit = showable(pool, min_length_m)
    if not 0 < k <= len(fit):
        raise InputError(f"{k} questions were asked for; the pool has {len(fit)} that fit.")
    return [int(index) for index in rng.choice(fit, k, replace=False)]


def showable(pool: QueryPool, min_length_m: float) -> Indices:
    """Samples that stay in the workspace when shown and whose step is that long."""
    return np.flatnonzero(pool.can_show & (pool.length_m >= min_length_m))


def make_query(
    controller: LatentController, s: JointPositions, z: LatentAction, steps: int
) -> Query:
    """The move to show for a sample: driven with constant ``z`` for ``steps`` steps, through ``s``.

    The move begins half of the steps before ``s``, so that an answer given for the whole move is
    about its middle: the step from ``s`` to ``next_s``, which is the one that is learned from.

    Raises:
        ShapeError: If ``s`` or ``z`` is a batch.
        InputError: If there are no steps.
    """
    if s.ndim != 1 or z.ndim != 1:
        raise ShapeError("A query is made for one state and one latent action.")
    if steps < 1:
        raise InputError("A move has at least one step.")
    path = [s]
    for _ in range(steps // 2):
        path.insert(0, _state_before(controller, z, path[0]))
    while len(path) <= steps:
        path.append(controller.next_state(z, path[-1], DT_S))
    middle = steps // 2
    return Query(s=path[middle], z=z, next_s=path[middle + 1], path=np.stack(path))


def _state_before(controller: LatentController, z: LatentAction, s: JointPositions) -> np.ndarray:
    """The state from which one step with ``z`` leads to ``s``, by fixed-point iteration."""
    before = s
    for _ in range(_BACKWARD_ITERATIONS):
        before = np.clip(s - controller.decode(z, before) * DT_S, Q_MIN, Q_MAX)
    return before
