"""The commands as a person gives them; two of the tests run real experiments."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from app import cli
from app.analysis.simulation_journal import open_journal
from app.analysis.simulation_rows import rows_csv, select
from app.analysis.simulation_run import run_cells
from models.experiment import Cell, Row, run_cell
from models.panda_pack import default_folder
from tests.app.analysis.experiments import labels_rows, paper_rows, run_at_once
from tests.patience import PATIENCE_S

SMALL = ["--task", "plane", "--method", "no-align,manual-align", "--noise", "0", "--seeds", "3"]
CELLS = [
    Cell("plane", method, 0.0, seed, 10, 1000)
    for method in ("no-align", "manual-align")
    for seed in range(3)
]


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a command writes there is gone after the test."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(default_folder()))


def start(out: Path, *options: str) -> subprocess.Popen[str]:
    """``joymap simulate`` in a process of its own, as the leader of a group, like in a shell."""
    # In the background of a shell the tests have Ctrl-C ignored, and so would what they start.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(
            [sys.executable, "-m", "app.cli", "simulate", *SMALL, *options, "--out", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
    finally:
        signal.signal(signal.SIGINT, before)


def wait_for_lines(out: Path, wanted: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not (out / "rows.jsonl").exists() or lines(out) < wanted:
        assert time.monotonic() < deadline
        time.sleep(0.005)


def lines(out: Path) -> int:
    return (out / "rows.jsonl").read_bytes().count(b"\n")


def wait_for_end(leader: int) -> None:
    """Until no process of the group is left."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            os.killpg(leader, 0)
        except ProcessLookupError:
            return
        assert time.monotonic() < deadline
        time.sleep(0.05)


def without_times(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return [
            {name: value for name, value in line.items() if "training_seconds" not in name}
            for line in csv.DictReader(file)
        ]


def test_a_run_killed_in_the_middle_goes_on_and_ends_with_the_rows_of_a_whole_one(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    process = start(out, "--workers", "1")
    wait_for_lines(out, 2)
    process.kill()
    process.communicate()
    done, kept = lines(out), (out / "rows.jsonl").read_bytes()
    assert 2 <= done < len(CELLS)
    wait_for_end(process.pid)  # its worker ends with it

    assert cli.main(["simulate", *SMALL, "--workers", "2", "--out", str(out)]) == 0
    assert f"{done} of {len(CELLS)} cells are there already." in capfd.readouterr().err
    assert (out / "rows.jsonl").read_bytes().startswith(kept)
    assert lines(out) == len(CELLS)
    with open_journal(tmp_path / "whole", is_fresh=False) as journal:
        run_cells(CELLS, journal.add, 1, lambda _: None, run_cell)
        (tmp_path / "whole.csv").write_text(rows_csv([journal.rows[cell] for cell in CELLS]))
    # Made by one worker and then by two, or all by one: to the bit the same.
    assert without_times(out / "rows.csv") == without_times(tmp_path / "whole.csv")
    assert {path.name for path in out.iterdir()} == {
        "rows.jsonl",
        "rows.csv",
        "summary.csv",
        "run.json",
        "figure.png",
        "figure.pdf",
        "figure.svg",
    }


def test_ctrl_c_says_in_one_line_how_to_go_on(tmp_path: Path) -> None:
    process = start(tmp_path / "out", "--workers", "1", "--seeds", "9")
    wait_for_lines(tmp_path / "out", 1)
    os.killpg(process.pid, signal.SIGINT)  # a terminal tells the whole group
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert output == ""
    assert errors.splitlines() == [
        "joymap: Stopped; finished cells are kept, and the same command goes on from there."
    ]
    wait_for_end(process.pid)


BAD = [
    (["--task", "cook"], "There is no task 'cook'; choose one of: plane, pour"),
    (["--method", "all-priors,magic"], "There is no method 'magic'; choose one of: no-align"),
    (["--noise", "much"], "'much' is not a number"),
    (["--noise", "0,,1"], "'0,,1' is not a list such as A,B"),
    (["--noise", "-0.1"], "noise must lie between 0 and"),
    (["--noise", "nan"], "noise must lie between 0 and"),
    (["--labels", "10.5"], "'10.5' is not a whole number"),
    (["--labels", "0"], "labels must lie between 2 and"),
    (["--unlabelled", "0"], "--unlabelled must be at least 1, not 0"),
    (["--labels", "30", "--unlabelled", "40"], "At most half of the unlabelled"),
    (["--preference", "random+mood"], "There is no preference 'mood'; join by '+' any of: axes"),
    (["--preference", "rotated"], "There is no preference 'rotated'"),
    (["--controller", "neural"], "There is no controller 'neural'; choose one of: autoencoder"),
    (["--queries", "clever"], "There is no queries 'clever'; choose one of: random, designed"),
    (["--wrong-answers", "1.5"], "wrong-answers must lie between 0 and 1"),
    (["--rotation-weight", "-1"], "rotation-weight must lie between 0 and"),
    (["--seeds", "0"], "--seeds must be between 1 and 10000, not 0"),
    (["--first-seed", "-1"], "seed must lie between 0 and"),
    (["--workers", "0"], "--workers must be between 1 and 256, not 0"),
    (["--json", "/nowhere/at/all.json"], "--json must be a file in a folder that exists"),
    (["--sees", "3"], "unrecognized arguments: --sees 3"),
]


@pytest.mark.parametrize(("options", "sentence"), BAD, ids=lambda value: str(value)[:40])
def test_a_bad_argument_gets_one_line_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: Sequence[str], sentence: str
) -> None:
    out = tmp_path / "out"
    assert exit_code(["simulate", "--out", str(out), *options]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert sentence in said.err
    assert not out.exists()


def test_the_folder_for_the_files_has_to_be_given(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(["simulate"]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "--out" in said


def test_a_file_is_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").write_text("mine")
    assert exit_code(["simulate", "--out", str(tmp_path / "out")]) == 2
    assert "must be a folder" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "mine"


def test_without_the_arms_pack_it_says_once_how_to_get_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(tmp_path / "none"))
    assert exit_code(["simulate", "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "make setup" in said


def test_another_grid_in_the_same_folder_keeps_its_rows_apart(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with open_journal(out, is_fresh=False) as journal:
        for cell in CELLS:
            journal.add(cell, run_at_once(cell), 0.5)
    words = tmp_path / "all.json"
    options = ["--seeds", "1", "--first-seed", "1", "--out", str(out), "--json", str(words)]
    assert exit_code(["simulate", *SMALL, *options]) == 0
    assert "2 of 2 cells are there already." in capfd.readouterr().err
    assert [line["seed"] for line in without_times(out / "rows.csv")] == ["1", "1"]
    assert [line["n"] for line in without_times(out / "summary.csv")] == ["1", "1"]
    assert lines(out) == len(CELLS)
    said = json.loads(words.read_text())
    assert [row["seed"] for row in said["rows"]] == [1, 1]
    assert said["summary"][0]["n"] == 1
    assert said["grid"]["seeds"] == [1]


def test_the_page_is_made_from_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paper = fill(tmp_path / "paper", paper_rows(tasks=["plane"], seeds=2))
    labels = fill(tmp_path / "labels", select(labels_rows(), task="plane", queries="random"))
    page = tmp_path / "docs" / "page.md"
    options = ["--paper", str(paper), "--labels", str(labels), "--out", str(page)]
    assert exit_code(["simulate-page", *options]) == 0
    assert capsys.readouterr().out == f"Wrote {page}.\n"
    assert page.read_text().startswith("# The simulation experiments")
    assert (page.parent / "images" / "simulation.png").is_file()


def test_a_page_of_nothing_says_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "none")
    options = ["--paper", missing, "--labels", missing, "--out", str(tmp_path / "page.md")]
    assert exit_code(["simulate-page", *options]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "joymap simulate --out" in said
    assert not (tmp_path / "page.md").exists()


def exit_code(arguments: Sequence[str]) -> int:
    """What the shell would see; argparse leaves by an exception."""
    try:
        return cli.main(list(arguments))
    except SystemExit as end:
        return int(end.code or 0)


def fill(folder: Path, rows: list[Row]) -> Path:
    """What a page needs of a run."""
    folder.mkdir()
    (folder / "rows.csv").write_text(rows_csv(rows))
    about = {"rotation_weight": 10.0, "origin": "abc", "worker_seconds": 1.0}
    (folder / "run.json").write_text(json.dumps(about))
    return folder
