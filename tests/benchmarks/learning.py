"""How long learning takes: each method's fit, and the paper's whole grid."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from rich.progress import track

from app.texts import title_of
from models.checkpoints import load_controller
from models.controller import AutoencoderController, LatentController
from models.experiment import PAPER_LABELS, PAPER_TASKS, PAPER_UNLABELLED
from models.fitting import FitProblem, Labels
from models.kinematics import Kinematics
from models.panda_pack import default_folder, open_pack
from models.preferences import rotated
from models.queries import QueryPool, choose_queries, sample_pool
from models.reference_training import fit_reference
from models.simulated_human import SimulatedHuman, sensitivity
from models.strategies import get_strategy
from models.task_space import fit_task_space, survey
from models.tasks import Task, get_task
from models.training import NetworkMethod, TrainingSettings, settings_for

FITS = 7
REFITS = 30
REFERENCE_STEPS = 8  # of the straightforward version; its time grows with its steps

Row = tuple[str, str, str, str]


def rows() -> Iterator[Row]:
    """What, median, worst, aim."""
    for strategy in ("no-priors", "all-priors"):
        fast, slow = training_times(strategy)
        aim = "≤ 0.5 s" if strategy == "all-priors" else ""
        yield f"training {strategy}", f"{np.median(fast):.2f} s", f"{max(fast):.2f} s", aim
        yield f"training {strategy}, straightforward", f"{slow:.1f} s", "", ""
        aim = "≥ 50 ×" if strategy == "all-priors" else ""
        yield f"training {strategy}, ratio", f"{slow / np.median(fast):.0f} ×", "", aim
    for task in PAPER_TASKS:
        refits_ms = 1000 * np.array(refit_times(task))
        what = f"task-space refit, {title_of(task)}, {PAPER_LABELS[task]} labels"
        yield what, f"{np.median(refits_ms):.0f} ms", f"{refits_ms.max():.0f} ms", "≤ 20 ms"
    yield "the paper's grid, on every core", f"{grid_time() / 60:.1f} min", "", "≤ 10 min"


@dataclass(frozen=True)
class _Lab:
    task: Task
    controller: LatentController
    kinematics: Kinematics
    pool: QueryPool
    labels: Labels


@cache
def _lab(name: str) -> _Lab:
    task, controller = get_task(name), load_controller(name)
    kinematics = Kinematics.from_urdf(open_pack(default_folder()).urdf)
    rng = np.random.default_rng(1)
    pool = sample_pool(task, controller, kinematics, PAPER_UNLABELLED[name], rng)
    chosen = choose_queries(pool, PAPER_LABELS[name], rng, min_length_m=0.005)
    kappa = sensitivity(task, kinematics, pool)
    person = SimulatedHuman(task, rotated(40.0), kappa, noise_cv=0.1)
    s, next_s = pool.states[chosen], pool.next_states[chosen]
    h = person.label(kinematics.hand_pose(s), kinematics.hand_pose(next_s), rng)
    return _Lab(task, controller, kinematics, pool, Labels(s, h, next_s))


def training_times(strategy: str) -> tuple[list[float], float]:
    """Fast fits, and one straightforward fit worked out from its first steps, in [s]."""
    lab = _lab("plane")
    method = get_strategy(strategy).method
    assert isinstance(method, NetworkMethod)
    assert isinstance(lab.controller, AutoencoderController)
    problem = FitProblem(lab.task, lab.kinematics, lab.controller, lab.labels, lab.pool)
    fast = []
    for seed in track(range(FITS), description=f"fits of {strategy}"):
        began_s = time.perf_counter()
        method.fit(problem, seed)
        fast.append(time.perf_counter() - began_s)
    few, steps = TrainingSettings(steps=REFERENCE_STEPS), settings_for(lab.task).steps
    for _ in range(2):  # the first time warms up
        began_s = time.perf_counter()
        fit_reference(
            method.weights, lab.controller, lab.kinematics, lab.task, lab.labels, lab.pool, few, 1
        )
        slow = (time.perf_counter() - began_s) / REFERENCE_STEPS * steps
    return fast, slow


def refit_times(task: str) -> list[float]:
    """Understanding the same person again, as after every answer, in [s]."""
    lab = _lab(task)
    seen = survey(lab.task, lab.kinematics, lab.pool)
    found = []
    for _ in range(REFITS):
        began_s = time.perf_counter()
        fit_task_space(lab.controller, lab.kinematics, lab.task, lab.labels, seen)
        found.append(time.perf_counter() - began_s)
    return found


def grid_time() -> float:
    """``joymap simulate`` with its defaults, from nothing to the figure, in [s]."""
    with tempfile.TemporaryDirectory() as folder:
        began_s = time.perf_counter()
        command = [sys.executable, "-m", "app.cli", "simulate", "--out", folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - began_s
