"""The same weights from the same answers, and old files of weights as they were."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.analysis.simulation_rows import MEASURES, read_rows
from models.alignment import Alignment
from models.checkpoints import PRETRAINED, read_checkpoint
from models.experiment import METHODS, Cell, run_cell
from tests.frozen import learning
from tests.frozen.compare import differences
from tests.frozen.exported import read_csv
from tests.frozen.made import LEARNING, SIMULATION

KEPT: dict[str, Any] = json.loads((LEARNING / "weights.json").read_text())
LINES: list[dict[str, Any]] = KEPT["weights"]
# On such a machine every bit must be as it was; on another one the numbers must be near.
IS_SAME_MACHINE = KEPT["machine"] == learning.machine()
# How far z may be, which is about 1 for the whole stick. What was found on one machine with other
# kernels (AVX2 and OpenBLAS's Haswell, for AVX-512 and SkylakeX) was 2e-14 without a network, 6e-6
# after a hundred steps of one, and 6e-3 after a thousand.
EXACT, AFTER_FEW, AFTER_MANY = 1e-9, 1e-4, 5e-2
# And the share by which a row's measures may differ: found were 4e-14, and 0.011 with a network.
ROW_EXACT, ROW_LEARNED = 1e-9, 0.05
NO_NETWORK = ("no-align", "manual-align", "task-space")


def lines(**wanted: Any) -> dict[str, dict[str, Any]]:
    """Of each strategy what was kept of one training."""
    return {
        line["strategy"]: line
        for line in LINES
        if all(line[name] == value for name, value in wanted.items())
    }


def check(line: dict[str, Any], alignment: Alignment) -> None:
    h, s = learning.probes(line["task"])
    tolerance = AFTER_MANY if line["steps"] is None else AFTER_FEW
    if line["strategy"] in NO_NETWORK:
        tolerance = EXACT
    np.testing.assert_allclose(alignment(h, s), line["z"], rtol=0.0, atol=tolerance)
    if IS_SAME_MACHINE:
        assert learning.sha256(alignment.to_arrays()) == line["sha256"], line["strategy"]


# The strategies differ in a few steps as they do in many, which take long.
@pytest.mark.parametrize(
    ("task", "seed", "steps", "strategies"),
    [
        ("plane", 1, None, ("all-priors",)),
        *((task, 2, learning.SHORT, learning.FROM_ANSWERS) for task in learning.TASKS),
    ],
)
def test_a_training_gives_the_weights_that_it_gave(
    task: str, seed: int, steps: int | None, strategies: tuple[str, ...], tmp_path: Path
) -> None:
    kept = lines(**{"from": "answers"}, task=task, seed=seed, steps=steps)
    stems = learning.train_as_worker(tmp_path, task, strategies, seed, steps)
    assert tuple(stems) == strategies
    for strategy, stem in stems.items():
        check(kept[strategy], learning.read_alignment(stem, task))
        assert read_checkpoint(stem).facts["strategy"] == strategy


@pytest.mark.parametrize("task", learning.TASKS)
def test_whoever_is_told_everything_gives_the_weights_that_they_gave(task: str) -> None:
    kept = lines(**{"from": "everything"}, task=task)
    assert tuple(kept) == learning.FROM_EVERYTHING
    for strategy, line in kept.items():
        check(line, learning.fit_as_simulation(task, strategy, line["steps"]))


@pytest.mark.parametrize("task", learning.TASKS)
def test_an_old_checkpoint_makes_the_latent_actions_that_it_made(task: str) -> None:
    h, s = learning.probes(task)
    kept = lines(**{"from": "answers"}, task=task, steps=None)
    kept |= lines(**{"from": "everything"}, task=task)
    assert len(kept) == len(METHODS) - 1  # no-align has no file
    for strategy, line in kept.items():
        alignment = learning.read_alignment(LEARNING / f"{task}-{strategy}", task)
        assert learning.sha256(alignment.to_arrays()) == line["sha256"]
        # The weights are the same to the bit; a product of matrices may be summed in another order.
        np.testing.assert_allclose(alignment(h, s), line["z"], rtol=0.0, atol=EXACT)


def test_the_controllers_that_come_with_the_program_are_what_they_were() -> None:
    for name, digest in KEPT["controllers"].items():
        assert hashlib.sha256((PRETRAINED / name).read_bytes()).hexdigest() == digest, name


OLD_ROWS = {
    (row.task, row.method, row.noise, row.seed): row for row in read_rows(SIMULATION / "rows.csv")
}
AGAIN = [
    *(("plane", method, 0.5, 1) for method in (*NO_NETWORK, "ideal-align")),
    *(("reach-and-pour", method, 0.5, 1) for method in ("all-priors", "task-space")),
]


@pytest.mark.parametrize("key", AGAIN, ids=lambda key: "-".join(map(str, key)))
def test_a_simulation_gives_the_row_that_it_gave(key: tuple[str, str, float, int]) -> None:
    old = asdict(OLD_ROWS[key])
    chosen = {name: value for name, value in old.items() if name not in MEASURES}
    new = asdict(run_cell(Cell(**chosen)))
    assert {name: new[name] for name in chosen} == chosen
    tolerance = ROW_EXACT if old["method"] in NO_NETWORK else ROW_LEARNED
    for name in set(MEASURES) - {"training_seconds"}:
        assert new[name] == pytest.approx(old[name], rel=tolerance, abs=1e-12), name
        if IS_SAME_MACHINE:
            assert new[name] == old[name], name


def test_an_old_journal_is_taken_up_without_running_a_cell_again(simulation: Path) -> None:
    assert simulation.with_name("said").read_text() == "72 of 72 cells are there already.\n"
    for name in ("rows.csv", "summary.csv"):
        old, new = (read_csv((path / name).read_bytes()) for path in (SIMULATION, simulation))
        assert differences(old, new) == []
    old_run, new_run = (
        json.loads((path / "run.json").read_text()) for path in (SIMULATION, simulation)
    )
    assert differences(old_run, new_run, ignored=["origin"]) == []
