"""One arm, one task, one controller and one person's answers, for every test of the core."""

from dataclasses import dataclass

import numpy as np
import pytest

from models.checkpoints import load_controller
from models.controller import LatentController
from models.fitting import Fit, FitProblem, Labels, Progress
from models.kinematics import Kinematics
from models.mapping import Mapping
from models.panda import Q_MAX, Q_MIN
from models.panda_pack import PandaPack
from models.preferences import mirrored, rotated
from models.queries import QueryPool, choose_queries, make_query, sample_pool
from models.simulated_human import SimulatedHuman, sensitivity
from models.strategies import get_strategy
from models.tasks import Task, get_task


@pytest.fixture(scope="session")
def kinematics(pack: PandaPack) -> Kinematics:
    return Kinematics.from_urdf(pack.urdf)


@pytest.fixture(scope="session")
def plane() -> Task:
    return get_task("plane")


@pytest.fixture(scope="session")
def controller() -> LatentController:
    return load_controller("plane")


@pytest.fixture(scope="session")
def pool(plane: Task, controller: LatentController, kinematics: Kinematics) -> QueryPool:
    return sample_pool(plane, controller, kinematics, 200, np.random.default_rng(1))


@dataclass(frozen=True)
class Person:
    """Somebody with an unusual preference, what they answered, and what was learned from it."""

    human: SimulatedHuman
    labels: Labels
    problem: FitProblem
    fit: Fit
    told: tuple[Progress, ...]
    mapping: Mapping


@pytest.fixture(scope="session")
def person(
    plane: Task, controller: LatentController, kinematics: Kinematics, pool: QueryPool
) -> Person:
    preference = mirrored(rotated(140.0))
    human = SimulatedHuman(plane, preference, sensitivity(plane, kinematics, pool))
    labels = answers(human, controller, kinematics, pool, k=7)
    problem = FitProblem(plane, kinematics, controller, labels, pool)
    told: list[Progress] = []
    fit = get_strategy("all-priors").method.fit(problem, 3, told.append)
    return Person(human, labels, problem, fit, tuple(told), Mapping(controller, fit.alignment))


def answers(
    human: SimulatedHuman,
    controller: LatentController,
    kinematics: Kinematics,
    pool: QueryPool,
    k: int,
) -> Labels:
    """Ask a simulated person about ``k`` moves."""
    rng = np.random.default_rng(2)
    chosen = choose_queries(pool, k, rng, min_length_m=0.007)
    queries = [make_query(controller, pool.states[i], pool.latents[i], 10) for i in chosen]
    states = np.stack([query.s for query in queries])
    next_states = np.stack([query.next_s for query in queries])
    h = human.label(kinematics.hand_pose(states), kinematics.hand_pose(next_states), rng)
    return Labels(states, h, next_states)


def random_joints(rng: np.random.Generator, n: int) -> np.ndarray:
    """Joint positions anywhere within the limits, ``(n, 7)``."""
    return rng.uniform(Q_MIN, Q_MAX, (n, 7))
