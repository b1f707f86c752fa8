"""Makes the pretrained controllers: ``python -m models.make_controllers --task plane``."""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from .checkpoints import PRETRAINED, controller_stem, save_controller
from .controller import AutoencoderController, LatentController
from .controller_training import (
    ControllerQuality,
    ControllerSettings,
    fit_controller,
    principal_components,
    warp,
)
from .errors import ModelsError
from .kinematics import Kinematics
from .panda_pack import open_pack
from .tasks import TASKS, get_task

TRAJECTORIES = 2400
STEPS = 12


def make_controllers(
    task_name: str, seed: int, settings: ControllerSettings, folder: Path = PRETRAINED
) -> None:
    """Demonstrate a task, learn its controllers and write them; same seed, same files."""
    task = get_task(task_name)
    kinematics = Kinematics.from_urdf(open_pack().urdf)
    demonstrations = task.demonstrations(
        kinematics,
        np.random.default_rng(seed),
        TRAJECTORIES * len(task.motions),
        STEPS,
        disturbed=True,
    )
    _say(f"{task.name}: {demonstrations.states.shape[0]} demonstrations")

    def save(controller: LatentController, quality: ControllerQuality) -> None:
        _say(f" {controller.form}")
        for name, figure in asdict(quality).items():
            _say(f"  {name}: {figure:.4f}")
        checkpoint = save_controller(
            folder / controller_stem(task.name, controller.form),
            controller,
            seed=seed,
            data_hash=demonstrations.content_hash,
            settings={
                **asdict(settings),
                "trajectories": demonstrations.states.shape[0],
                "trajectory_steps": STEPS,
            },
            facts={"task": task.name, "quality": asdict(quality)},
        )
        _say(f"  written, {checkpoint.weights_sha256[:12]}")

    def report(step: int, loss: float) -> None:
        if step % 1000 == 0:
            _say(f"  step {step}: loss {loss:.2e}")

    paper, quality = fit_controller(task, kinematics, demonstrations, settings, seed, report)
    assert isinstance(paper, AutoencoderController)
    save(paper, quality)
    save(*warp(task, kinematics, paper, quality, demonstrations, seed))
    save(*principal_components(task, kinematics, demonstrations, settings.held_out, seed))
    save(*fit_controller(task, kinematics, demonstrations, settings, seed, report, is_linear=True))


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
            make_controllers(name, arguments.seed, ControllerSettings(), arguments.out)
    except ModelsError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
