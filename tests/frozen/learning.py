"""Learning as the server and the simulations do it, from stored answers or from a cell.

What the frozen weights are compared with. :func:`train_as_worker` and :func:`fit_as_simulation` are
the only places here that call the insides of the program.
"""

import ctypes
import hashlib
import os
import platform
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import torch
from safetensors.numpy import load_file

from app.jobs import worker
from app.services.training import TrainingOrder
from models import experiment
from models.alignment import Alignment
from models.checkpoints import load_alignment, load_controller
from models.evaluation import judge_moves
from models.experiment import Cell
from models.fitting import AlignmentContext, FitProblem, Labels
from models.kinematics import Kinematics
from models.panda_pack import default_folder, open_pack
from models.tasks import get_task
from tests.frozen.made import LEARNING

# One motion, and two of them.
TASKS = ("plane", "reach-and-pour")
FROM_ANSWERS = (
    "no-priors",
    "proportionality",
    "reversibility",
    "consistency",
    "all-priors",
    "task-space",
)
FROM_EVERYTHING = ("manual-align", "ideal-align")
# Seed, and steps of the optimiser (None: the learning core's own). Of few steps all processors make
# nearly the same; over a thousand, rounding in single precision grows.
SHORT = 100
TRAININGS = ((1, None), (2, SHORT))
_UNLABELLED = 200
# The options of the old simulation.
GRID = {
    "--task": ",".join(TASKS),
    "--noise": "0,0.5",
    "--labels": "5",
    "--unlabelled": "100",
    "--seeds": "2",
    "--first-seed": "1",
}

Arrays = dict[str, np.ndarray]


def answers(task: str) -> Labels:
    """The stored answers to moves of a task."""
    arrays = load_file(LEARNING / f"answers-{task}.safetensors")
    return Labels(arrays["s"], arrays["h"], arrays["s_star"])


def probes(task: str) -> tuple[np.ndarray, np.ndarray]:
    """Sticks ``(16, 2)`` and states ``(16, 7)`` in [rad] at which alignments are compared."""
    arrays = load_file(LEARNING / f"probes-{task}.safetensors")
    return arrays["h"], arrays["s"]


def train_as_worker(
    folder: Path, task: str, strategies: tuple[str, ...], seed: int, steps: int | None
) -> dict[str, Path]:
    """Train on the stored answers; the stem of each strategy's checkpoint."""
    order = TrainingOrder(
        job_id=f"{task}-{seed}",
        attempt=1,
        task=task,
        strategies=strategies,
        pack_dir=default_folder(),
        folder=folder,
        pool_seed=seed,
        unlabelled=_UNLABELLED,
        steps=steps,
        seed=seed,
        data_hash="stored answers",
        labels=answers(task),
    )
    return {each.strategy: folder / each.file for each in worker.train(order).alignments}


def fit_as_simulation(task: str, method: str, steps: int) -> Alignment:
    """What a simulated person's alignment is in a run of the simulation experiments."""
    cell = Cell(task, method, noise=0.1, seed=1, labels=5, unlabelled=_UNLABELLED)
    shorter = partial(FitProblem, steps=steps)
    judging = mock.Mock(side_effect=judge_moves)
    with mock.patch.multiple(experiment, FitProblem=shorter, judge_moves=judging):
        experiment.run_cell(cell)
    found: Alignment = judging.call_args.args[0].alignment
    return found


def read_alignment(stem: Path, task: str) -> Alignment:
    """The alignment of a checkpoint."""
    context = AlignmentContext(get_task(task), _kinematics(), load_controller(task))
    return load_alignment(stem, context)


@cache
def _kinematics() -> Kinematics:
    return Kinematics.from_urdf(open_pack(default_folder()).urdf)


def sha256(arrays: Arrays) -> str:
    """Of all arrays: their names, kinds, shapes and bytes, in the order of the names."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def machine() -> dict[str, Any]:
    """What decides the last bits of a result: machines for which this is equal agree in all."""
    return {
        "blas": _blas_core(),
        "libc": " ".join(platform.libc_ver()),
        "processor": platform.machine(),
        "torch": torch.backends.cpu.get_cpu_capability(),
        "simd": _numpy_simd(),
        "threads": os.environ.get("OPENBLAS_NUM_THREADS"),
        "versions": {name: version(name) for name in ("numpy", "scipy", "torch")},
    }


def _blas_core() -> str:
    """The kind of processor that numpy's OpenBLAS has kernels chosen for."""
    folder = Path(np.__file__).resolve().parent.with_name("numpy.libs")
    for path in folder.glob("*openblas*"):
        name_of_core = ctypes.CDLL(str(path)).scipy_openblas_get_corename64_
        name_of_core.restype = ctypes.c_char_p
        return str(name_of_core().decode())
    return "another BLAS"


def _numpy_simd() -> list[str]:
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    return sorted(found)
