"""Makes the pretrained controllers: ``python -m models.make_controllers --task plane``."""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from .checkpoints import PRETRAINED, Checkpoint, save_controller
from .controller_training import ControllerSettings, fit_controller
from .errors import ModelsError
from .kinematics import Kinematics
from .panda_pack import open_pack
from .tasks import TASKS, get_task

TRAJECTORIES = 2400
STEPS = 12


def make_controller(
    task_name: str, seed: int, settings: ControllerSettings, folder: Path = PRETRAINED
) -> Checkpoint:
    """Demonstrate a task, learn its controller and write it; same seed, same file."""
    task = get_task(task_name)
    kinematics = Kinematics.from_urdf(open_pack().urdf)
    demonstrations = task.demonstrations(
        kinematics, np.random.default_rng(seed), TRAJECTORIES, STEPS, disturbed=True
    )
    _say(f"{task.title}: {demonstrations.states.shape[0]} demonstrations")
    controller, quality = fit_controller(
        task,
        kinematics,
        demonstrations,
        settings,
        seed,
        lambda step, loss: None if step % 1000 else _say(f"  step {step}: loss {loss:.2e}"),
    )
    for name, figure in asdict(quality).items():
        _say(f"  {name}: {figure:.4f}")
    return save_controller(
        folder / task.name,
        controller,
        seed=seed,
        data_hash=demonstrations.content_hash,
        settings={**asdict(settings), "trajectories": TRAJECTORIES, "trajectory_steps": STEPS},
        facts={"task": task.name, "quality": asdict(quality)},
    )


def _say(line: str) -> None:
    print(line, flush=True)  # noqa: T201


def main() -> int:
    """Make one task's controller, or all of them."""
    parser = argparse.ArgumentParser(description="Make the pretrained controllers.")
    parser.add_argument("--task", choices=sorted(TASKS), help="only this one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=PRETRAINED)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    try:
        for name in [arguments.task] if arguments.task else sorted(TASKS):
            checkpoint = make_controller(name, arguments.seed, ControllerSettings(), arguments.out)
            _say(f"  written to {arguments.out / name}.*, {checkpoint.weights_sha256[:12]}")
    except ModelsError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
