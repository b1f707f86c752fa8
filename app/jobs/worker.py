"""What runs in a worker process: one order in, files of weights and a report out.

It never opens the database. It dies with the server that started it.
"""

import json
import math
import os
import time
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from app.services import queries
from app.services.training import (
    TrainedAlignment,
    TrainingOrder,
    TrainingOutcome,
)
from app.worker_pool import settle
from models.checkpoints import load_controller, save_alignment
from models.controller import LatentController
from models.field import STICKS, Field, learned_field
from models.fitting import FitProblem, Progress
from models.kinematics import Kinematics
from models.mapping import Mapping
from models.panda_pack import open_pack
from models.strategies import get_strategy
from models.tasks import get_task

_REPORT_EVERY_S = 0.1
NICENESS = 10  # the control loop goes first
_DIGITS = 5
_FIELD_POINTS = (5, 7)


def prepare(pack_dir: str, task: str) -> None:
    """Make a fresh process ready, so that the first training need not wait for it."""
    settle()
    os.nice(NICENESS)
    _tools(task, pack_dir)


def stand_by() -> None:
    """Do nothing; asking for it starts the processes."""


def train(order: TrainingOrder) -> TrainingOutcome:
    """Learn every strategy from one person's answers."""
    began_s = time.perf_counter()
    controller, kinematics, spread = _tools(order.task, str(order.pack_dir))
    task = get_task(order.task)
    pool = queries.draw_pool(order.task, order.pool_seed, controller, kinematics, order.unlabelled)
    report = Report(order.folder / f"{order.name}.progress", len(order.strategies))
    trained = []
    problem = FitProblem(task, kinematics, controller, order.labels, pool, order.steps)
    for strategy in (get_strategy(name) for name in order.strategies):
        fit = strategy.method.fit(problem, order.seed, partial(report.note, strategy.name))
        for fraction, alignment in fit.snapshots:
            field = learned_field(Mapping(controller, alignment), kinematics, task, states=spread)
            report.add_field(strategy.name, fraction, field)
        name = f"{order.name}-{strategy.name}"
        checkpoint = save_alignment(
            order.folder / name,
            fit.alignment,
            strategy=strategy.name,
            seed=order.seed,
            data_hash=order.data_hash,
            settings=fit.settings,
        )
        trained.append(
            TrainedAlignment(
                strategy=strategy.name,
                file=name,
                weights_sha256=checkpoint.weights_sha256,
                controller_hash=controller.content_hash,
                settings=checkpoint.settings,
                code_version=checkpoint.code_version,
            )
        )
    return TrainingOutcome(tuple(trained), report.strategies, time.perf_counter() - began_s)


class Report:
    """What the page shows of a training; written to a file as it grows."""

    def __init__(self, path: Path, parts: int) -> None:
        """Begin empty; ``parts`` strategies will be trained one after the other."""
        self.strategies: dict[str, Any] = {}
        self._path = path
        self._parts = parts
        self._written_s = -math.inf

    def note(self, strategy: str, progress: Progress) -> None:
        """Take in a point of the learning curve."""
        part = self._part(strategy)
        part["curve"].append([progress.step, _short(progress.losses["supervised"])])
        done = len(self.strategies) - 1 + progress.fraction
        now_s = time.perf_counter()
        if now_s - self._written_s >= _REPORT_EVERY_S:
            self._written_s = now_s
            self._write(done / self._parts)

    def add_field(self, strategy: str, fraction: float, field: Field) -> None:
        """Take in how the hand moves for up, down, left and right, at a point of the training."""
        arrows = [
            {
                "at": [_short(x) for x in at],
                **{
                    name: [_short(x) for x in move]
                    for name, move in zip(STICKS, moves, strict=True)
                },
            }
            for at, moves in zip(field.points, field.moves, strict=True)
        ]
        self._part(strategy)["fields"].append({"fraction": fraction, "arrows": arrows})

    def _part(self, strategy: str) -> dict[str, Any]:
        part: dict[str, Any] = self.strategies.setdefault(strategy, {"curve": [], "fields": []})
        return part

    def _write(self, fraction: float) -> None:
        scratch = self._path.with_suffix(".part")
        scratch.write_text(json.dumps({"fraction": fraction, "report": self.strategies}))
        scratch.replace(self._path)


@cache
def _tools(task: str, pack_dir: str) -> tuple[LatentController, Kinematics, np.ndarray]:
    """The controller, the arm, and states over the workspace to show the field at."""
    kinematics = Kinematics.from_urdf(open_pack(Path(pack_dir)).urdf)
    return load_controller(task), kinematics, get_task(task).spread(kinematics, _FIELD_POINTS)


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
