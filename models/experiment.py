"""The paper's simulation experiments, one run at a time (section "Simulation Experiments").

A simulated person labels a few moves, a method learns from them, and the person then asks for moves
that neither the controller nor the method has seen.
"""

import time
from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np

from .checkpoints import CONTROLLERS, load_controller
from .controller import LatentController
from .designed_queries import design_queries
from .errors import InputError
from .evaluation import judge_moves
from .fitting import FitProblem, Labels
from .kinematics import Kinematics
from .mapping import Mapping
from .panda_pack import open_pack
from .preferences import parse_preference
from .queries import QueryPool, sample_pool
from .simulated_human import SimulatedHuman, make_wrong, sensitivity
from .strategies import PAPER, STRATEGIES, get_strategy
from .tasks import get_task

METHODS = tuple(STRATEGIES)  # in the order of the figure
PAPER_METHODS = tuple(strategy.name for strategy in PAPER)
QUERIES = ("random", "designed")
PAPER_NOISES = (0.0, 0.1, 0.5)
PAPER_TASKS = ("plane", "pour", "reach-and-pour")
# Those of the paper's simulations, and those of its user study.
PAPER_LABELS = {
    "plane": 10,
    "pour": 10,
    "reach-and-pour": 20,
    "avoid": 7,
    "pour-cup": 10,
    "fetch-and-pour": 30,
}
PAPER_UNLABELLED = {
    "plane": 1000,
    "pour": 1000,
    "reach-and-pour": 2000,
    "avoid": 1000,
    "pour-cup": 1000,
    "fetch-and-pour": 2000,
}
ROTATION_WEIGHT = 10.0
_TEST_MOVES = 500
# The streams of chance of one seed: none depends on how much another was used.
_POOL, _TEST, _PERSON, _QUESTIONS, _NOISE, _WRONG = range(6)


@dataclass(frozen=True)
class Cell:
    """One run; every field decides the result.

    Attributes:
        task: Name of the task.
        method: Name of the strategy.
        noise: Coefficient of variation of the labels.
        seed: All chance: the person, the moves, their noise, the test.
        labels: K.
        unlabelled: N.
        preference: See :func:`parse_preference`.
        queries: How the K moves are chosen.
        controller: What moves the arm, one of :data:`CONTROLLERS`.
        wrong_answers: Share of answers that are plainly wrong.
        rotation_weight: Alignment error per rotation error, in [1/rad].
    """

    task: str
    method: str
    noise: float
    seed: int
    labels: int
    unlabelled: int
    preference: str = "random"
    queries: str = "random"
    controller: str = "autoencoder"
    wrong_answers: float = 0.0
    rotation_weight: float = ROTATION_WEIGHT

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: If a field is out of range; the message is one sentence.
            UnknownTaskError: If there is no such task.
        """
        get_task(self.task)
        get_strategy(self.method)
        parse_preference(self.preference, np.random.default_rng(0))
        _one_of("queries", self.queries, QUERIES)
        _one_of("controller", self.controller, CONTROLLERS)
        _within("noise", self.noise, 0.0, 2.0)
        _within("wrong-answers", self.wrong_answers, 0.0, 1.0)
        _within("rotation-weight", self.rotation_weight, 0.0, 1e6)
        _within("labels", float(self.labels), 2.0, 1000.0)
        _within("unlabelled", float(self.unlabelled), 20.0, 1e5)
        _within("seed", float(self.seed), 0.0, 2.0**32 - 1.0)
        if self.labels > self.unlabelled // 2:
            raise InputError("At most half of the unlabelled samples can be labelled.")


@dataclass(frozen=True)
class Row:
    """A run and what came of it.

    Attributes:
        position_error: Mean relative distance error E_d over test moves that travel.
        rotation_error: Mean E_r over all test moves, in [rad].
        alignment_error: Their weighted sum.
        motion_gain: Mean length of the moves made over that of the moves meant.
        training_seconds: Wall clock of the learning alone.
    """

    task: str
    method: str
    noise: float
    seed: int
    labels: int
    unlabelled: int
    preference: str
    queries: str
    controller: str
    wrong_answers: float
    position_error: float
    rotation_error: float
    alignment_error: float
    motion_gain: float
    training_seconds: float


def run_cell(cell: Cell) -> Row:
    """Run one experiment: same cell, same bits on the same machine, but for the time it takes.

    Raises:
        InputError: If the cell cannot be run.
        UnknownTaskError: If there is no such task.
    """
    cell.check()
    world = _world(cell.task, cell.controller, cell.unlabelled, cell.seed)
    preference = parse_preference(cell.preference, _chance(cell.seed, _PERSON))
    person = SimulatedHuman(get_task(cell.task), preference, world.kappa, cell.noise)
    strategy = get_strategy(cell.method)
    labels = _every_label(world, person) if strategy.needs_everything else _ask(cell, world, person)
    problem = FitProblem(person.task, world.kinematics, world.controller, labels, world.pool)
    began_s = time.perf_counter()
    alignment = strategy.method.fit(problem, cell.seed).alignment
    seconds = time.perf_counter() - began_s
    mapping = Mapping(world.controller, alignment)
    judged = judge_moves(mapping, person, world.kinematics, world.test)
    chosen = {name: value for name, value in asdict(cell).items() if name != "rotation_weight"}
    return Row(
        **chosen,
        position_error=judged.position_error,
        rotation_error=judged.rotation_error,
        alignment_error=judged.position_error + cell.rotation_weight * judged.rotation_error,
        motion_gain=judged.motion_gain,
        training_seconds=seconds,
    )


@dataclass(frozen=True)
class _World:
    """What does not depend on the person."""

    kinematics: Kinematics
    controller: LatentController
    pool: QueryPool
    test: QueryPool
    kappa: np.ndarray


@lru_cache(maxsize=8)
def _world(task_name: str, form: str, unlabelled: int, seed: int) -> _World:
    task, kinematics, controller = get_task(task_name), _kinematics(), _controller(task_name, form)
    pool = sample_pool(task, controller, kinematics, unlabelled, _chance(seed, _POOL))
    test = sample_pool(task, controller, kinematics, _TEST_MOVES, _chance(seed, _TEST))
    return _World(kinematics, controller, pool, test, sensitivity(task, kinematics, pool))


@lru_cache(maxsize=1)
def _kinematics() -> Kinematics:
    return Kinematics.from_urdf(open_pack().urdf)


@lru_cache(maxsize=16)
def _controller(task_name: str, form: str) -> LatentController:
    return load_controller(task_name, form)


def _ask(cell: Cell, world: _World, person: SimulatedHuman) -> Labels:
    """Steps 5 and 6: choose the moves and have them labelled."""
    task, pool = get_task(cell.task), world.pool
    before = world.kinematics.hand_pose(pool.states)
    after = world.kinematics.hand_pose(pool.next_states)
    # Full stick is the controller's long step: nobody is asked for a longer one.
    fit = np.flatnonzero(np.linalg.norm(task.dof_change(before, after), axis=-1) <= world.kappa[0])
    chance = _chance(cell.seed, _QUESTIONS)
    if cell.queries == "designed":
        rows = np.array(
            design_queries(task, world.kinematics, pool, cell.labels, chance, allowed=fit)
        )
    else:
        rows = chance.choice(fit, cell.labels, replace=False)
    states, next_states = pool.states[rows], pool.next_states[rows]
    h = person.label(
        world.kinematics.hand_pose(states),
        world.kinematics.hand_pose(next_states),
        _chance(cell.seed, _NOISE),
    )
    h = make_wrong(h, cell.wrong_answers, _chance(cell.seed, _WRONG))
    return Labels(states, h, next_states)


def _every_label(world: _World, person: SimulatedHuman) -> Labels:
    """What the person would answer without noise for every sample that is within their reach."""
    pool = world.pool
    before, after = (world.kinematics.hand_pose(q) for q in (pool.states, pool.next_states))
    h = person.answer(person.task.dof_change(before, after), before)
    rows = np.flatnonzero(np.linalg.norm(h, axis=-1) <= 1.0)
    return Labels(pool.states[rows], h[rows], pool.next_states[rows], pool.latents[rows])


def _chance(seed: int, stream: int) -> np.random.Generator:
    return np.random.default_rng([seed, stream])


def _one_of(name: str, value: str, offered: tuple[str, ...]) -> None:
    if value not in offered:
        raise InputError(f"There is no {name} '{value}'; choose one of: {', '.join(offered)}.")


def _within(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise InputError(f"{name} must lie between {low:g} and {high:g}, not {value:g}.")
