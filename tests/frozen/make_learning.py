"""Made the folders ``learning`` and ``simulation``; no test runs it.

In a checkout of the commit that the fixtures are named after, with this folder copied into it::

    export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
    python -m tests.frozen.make_learning

The answers that are learned from are a simulated person's. Of the trainings with the first seed the
checkpoints are kept, of all of them a hash of the weights and what they make of some sticks.
"""

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import save_file

from models.alignment import Alignment
from models.checkpoints import PRETRAINED, load_controller, save_alignment
from models.kinematics import Kinematics
from models.panda_pack import default_folder, open_pack
from models.preferences import parse_preference
from models.queries import choose_queries, sample_pool
from models.simulated_human import SimulatedHuman, sensitivity
from models.tasks import get_task
from tests.frozen import learning, made


def main() -> None:
    assert learning.machine()["threads"] == "1"
    _learn()
    _simulate()


def _learn() -> None:
    shutil.rmtree(made.LEARNING, ignore_errors=True)
    made.LEARNING.mkdir(parents=True)
    found = []
    for task in learning.TASKS:
        _ask(task)
        found += _train(task)
    content = {
        "machine": learning.machine(),
        "controllers": {
            path.name: hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(PRETRAINED.iterdir())
        },
        "weights": found,
    }
    (made.LEARNING / "weights.json").write_text(json.dumps(content, indent=1) + "\n")


def _simulate() -> None:
    shutil.rmtree(made.SIMULATION, ignore_errors=True)
    words = [word for option in learning.GRID.items() for word in option]
    command = [sys.executable, "-m", "app.cli", "simulate", "--out", str(made.SIMULATION)]
    subprocess.run([*command, *words], check=True)
    for picture in made.SIMULATION.glob("figure.*"):
        picture.unlink()


def _ask(task_name: str) -> None:
    """Answers to eight moves, and sticks and states to compare alignments at."""
    task, controller = get_task(task_name), load_controller(task_name)
    kinematics = Kinematics.from_urdf(open_pack(default_folder()).urdf)
    rng = np.random.default_rng(74)
    pool = sample_pool(task, controller, kinematics, 200, rng)
    preference = parse_preference("rotated:30", rng)
    person = SimulatedHuman(task, preference, sensitivity(task, kinematics, pool), 0.1)
    rows = choose_queries(pool, 8, rng, 0.012)
    s, s_star = pool.states[rows], pool.next_states[rows]
    h = person.label(kinematics.hand_pose(s), kinematics.hand_pose(s_star), rng)
    asked = {"s": s, "h": np.clip(h, -1.0, 1.0), "s_star": s_star}
    save_file(asked, made.LEARNING / f"answers-{task_name}.safetensors")
    probes = {"h": rng.uniform(-1.0, 1.0, (16, 2)), "s": np.ascontiguousarray(pool.states[:16])}
    save_file(probes, made.LEARNING / f"probes-{task_name}.safetensors")


def _train(task: str) -> list[dict[str, Any]]:
    found = []
    for seed, steps in learning.TRAININGS:
        with tempfile.TemporaryDirectory() as folder:
            stems = learning.train_as_worker(Path(folder), task, learning.FROM_ANSWERS, seed, steps)
            for strategy, stem in stems.items():
                alignment = learning.read_alignment(stem, task)
                found.append(_line("answers", task, strategy, seed, steps, alignment))
                if steps is None:
                    for ending in ("safetensors", "json"):
                        kept = made.LEARNING / f"{task}-{strategy}.{ending}"
                        shutil.copy(stem.with_suffix(f".{ending}"), kept)
    for strategy in learning.FROM_EVERYTHING:
        alignment = learning.fit_as_simulation(task, strategy, learning.SHORT)
        found.append(_line("everything", task, strategy, 1, learning.SHORT, alignment))
        stem = made.LEARNING / f"{task}-{strategy}"
        how: dict[str, Any] = {"seed": 1, "data_hash": "every answer", "settings": {}}
        save_alignment(stem, alignment, strategy=strategy, **how)
    return found


def _line(
    learned_from: str,
    task: str,
    strategy: str,
    seed: int,
    steps: int | None,
    alignment: Alignment,
) -> dict[str, Any]:
    h, s = learning.probes(task)
    return {
        "from": learned_from,
        "task": task,
        "strategy": strategy,
        "seed": seed,
        "steps": steps,
        "sha256": learning.sha256(alignment.to_arrays()),
        "z": alignment(h, s).tolist(),
    }


if __name__ == "__main__":
    main()
