"""What a worker makes of an order, without a process of its own."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.jobs import worker
from app.jobs.worker import Report
from app.services import queries
from app.services.training import TrainingOrder, TrainingOutcome
from models.checkpoints import load_controller
from models.field import Field
from models.fitting import Labels, Progress
from models.kinematics import Kinematics
from models.panda_pack import PandaPack

STEPS = 20


@pytest.fixture(scope="module")
def order(pack: PandaPack, tmp_path_factory: pytest.TempPathFactory) -> TrainingOrder:
    kinematics = Kinematics.from_urdf(pack.urdf)
    pool = queries.draw_pool("plane", 5, load_controller("plane"), kinematics, 100)
    return TrainingOrder(
        job_id="job",
        attempt=2,
        task="plane",
        strategies=("all-priors", "task-space"),
        pack_dir=pack.urdf.parent,
        folder=tmp_path_factory.mktemp("alignments"),
        pool_seed=5,
        unlabelled=100,
        steps=STEPS,
        seed=6,
        data_hash="data",
        labels=Labels(pool.states[:7], pool.latents[:7], pool.next_states[:7]),
    )


@pytest.fixture(scope="module")
def outcome(order: TrainingOrder) -> TrainingOutcome:
    return worker.train(order)


def test_every_strategy_of_the_order_is_a_file_that_says_what_it_is(
    order: TrainingOrder, outcome: TrainingOutcome
) -> None:
    assert [trained.strategy for trained in outcome.alignments] == ["all-priors", "task-space"]
    assert [trained.file for trained in outcome.alignments] == [
        "job-2-all-priors",
        "job-2-task-space",
    ]
    for trained in outcome.alignments:
        written = [path.stem for path in order.folder.iterdir()]
        assert trained.file in written
        assert trained.controller_hash == load_controller("plane").content_hash
        assert len(trained.weights_sha256) == 64
    network, task_space = outcome.alignments
    assert network.settings["steps"] == STEPS
    assert task_space.settings == {}
    assert outcome.training_s > 0.0


def test_the_report_holds_the_learning_curve_and_the_field_at_its_stages(
    outcome: TrainingOutcome,
) -> None:
    network, task_space = outcome.report["all-priors"], outcome.report["task-space"]
    steps = [step for step, _ in network["curve"]]
    assert (steps[0], steps[-1]) == (1, STEPS)
    assert all(before < after for before, after in pairwise(steps))
    assert network["curve"][-1][1] < network["curve"][0][1]
    assert [field["fraction"] for field in network["fields"]] == [0.0, 0.5, 1.0]
    assert task_space["curve"] == []
    assert [field["fraction"] for field in task_space["fields"]] == [1.0]
    for part in (network, task_space):
        for field in part["fields"]:
            assert len(field["arrows"]) == 35  # five by seven over the workspace
            for arrow in field["arrows"]:
                assert set(arrow) == {"at", "up", "down", "left", "right"}
                assert all(len(pair) == 2 for pair in arrow.values())


def test_the_same_order_gives_the_same_weights(
    order: TrainingOrder, outcome: TrainingOutcome
) -> None:
    again = worker.train(order)
    assert [each.weights_sha256 for each in again.alignments] == [
        each.weights_sha256 for each in outcome.alignments
    ]


def numbers(report: Any) -> list[float]:
    """Every number in a report, however deep."""
    if isinstance(report, dict):
        return [number for part in report.values() for number in numbers(part)]
    if isinstance(report, list):
        return [number for part in report for number in numbers(part)]
    return [report]


def test_a_report_has_five_digits_of_each_number(tmp_path: Path) -> None:
    report = Report(tmp_path / "progress", parts=1)
    report.note("all-priors", Progress(1, 10, {"supervised": 0.123456789}))
    moves = np.full((1, 4, 2), -1.23456789e-3)
    report.add_field("all-priors", 0.5, Field(np.full((1, 2), 0.3333333), moves))
    assert set(numbers(report.strategies)) == {1, 0.12346, 0.5, 0.33333, -0.0012346}


def test_the_progress_file_counts_the_strategies_that_are_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_REPORT_EVERY_S", 0.0)
    path = tmp_path / "job.progress"
    report = Report(path, parts=2)
    fractions = []
    for strategy in ("no-priors", "all-priors"):
        for step in (1, 5, 10):
            report.note(strategy, Progress(step, 10, {"supervised": 0.5}))
            fractions.append(json.loads(path.read_text())["fraction"])
    assert fractions == pytest.approx([0.05, 0.25, 0.5, 0.55, 0.75, 1.0])
    assert json.loads(path.read_text())["report"] == report.strategies
    assert [each.name for each in tmp_path.iterdir()] == ["job.progress"]


def test_progress_is_not_written_at_every_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_REPORT_EVERY_S", 1e6)
    path = tmp_path / "job.progress"
    report = Report(path, parts=1)
    report.note("all-priors", Progress(1, 10, {"supervised": 0.5}))
    report.note("all-priors", Progress(2, 10, {"supervised": 0.4}))
    assert json.loads(path.read_text())["fraction"] == 0.1
    assert report.strategies["all-priors"]["curve"] == [[1, 0.5], [2, 0.4]]
