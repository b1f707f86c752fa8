"""A strategy that another package brings goes all the way without a line of Joymap's changed."""

import csv
import os
import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from app.analysis.study_export import read_export
from app.settings import ROOT
from models.panda_pack import default_folder
from models.strategies import ENTRY_POINTS, OURS, PAPER, collect

DOCUMENT = ROOT / "docs" / "adding-a-strategy.md"
STUDY = """\
title: With a toy
tasks: [{task: avoid, labels: 7, unlabelled: 200}]
strategies: [no-align, toy]
practice_s: 0
"""


@pytest.fixture
def joymap(tmp_path: Path):
    site = tmp_path / "site"
    about = site / "toy_strategy-1.0.dist-info"
    about.mkdir(parents=True)
    module = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert module is not None
    (site / "toy_strategy.py").write_text(module[1])
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-strategy\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{ENTRY_POINTS}]\ntoy = toy_strategy:TOY\n")

    def joymap(*words: str) -> str:
        ran = subprocess.run(
            [sys.executable, "-m", "app.cli", *words],
            env=os.environ | {"PYTHONPATH": str(site), "JOYMAP_PANDA_DIR": str(default_folder())},
            capture_output=True,
            text=True,
            check=False,
        )
        assert ran.returncode == 0, ran.stderr
        return ran.stdout

    return joymap


def test_it_is_simulated_beside_the_others(joymap, tmp_path: Path) -> None:
    few = ("--task", "plane", "--noise", "0", "--seeds", "1", "--unlabelled", "200")
    joymap("simulate", "--method", "no-align,toy", *few, "--out", str(tmp_path / "out"))
    with (tmp_path / "out" / "rows.csv").open() as file:
        error = {row["method"]: float(row["position_error"]) for row in csv.DictReader(file)}
    assert set(error) == {"no-align", "toy"}
    assert error["toy"] < 0.5 * error["no-align"]


def test_it_is_trained_kept_and_driven_in_a_study(joymap, tmp_path: Path) -> None:
    study, out = tmp_path / "study.yaml", tmp_path / "study.zip"
    study.write_text(STUDY)
    who = ("--participants", "1", "--preference", "mirrored+rotated:75", "--seed", "3")
    joymap("bots", "--study", str(study), "--out", str(out), *who, "--speed", "3")
    drives = {drive["strategy"]: drive for drive in read_export(out).tables["drives"]}
    assert drives["toy"]["alignment"] is not None
    assert drives["toy"]["is_success"]
    assert drives["no-align"]["alignment"] is None


def entry(name: str, value: str) -> EntryPoint:
    return EntryPoint(name, value, ENTRY_POINTS)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("lost", "no_such_module:TOY", "'lost' cannot be loaded"),
        ("odd", "models.strategies:PAPER", "not a strategy named 'odd'"),
    ],
)
def test_what_is_no_strategy_is_left_out_and_the_log_says_so(
    name: str, value: str, says: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert list(collect([entry(name, value)])) == [each.name for each in (*PAPER, *OURS)]
    assert says in caplog.text


def test_no_package_takes_the_name_of_another_strategy(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("models.strategies.TAKEN", PAPER[0], raising=False)
    found = collect([entry("no-align", "models.strategies:TAKEN")])
    assert found["no-align"] is PAPER[0]
    assert "There is a strategy 'no-align' already" in caplog.text
