import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.analysis.simulation_rows import (
    SimulationError,
    read_rows,
    rows_csv,
    select,
    summarise,
    summary_csv,
    write_file,
)
from tests.app.analysis.experiments import make_row


def test_a_summary_has_mean_and_deviation_of_the_rows_that_differ_by_seed() -> None:
    rows = [
        make_row(seed=seed, position_error=error) for seed, error in enumerate((0.1, 0.2, 0.6))
    ] + [make_row(noise=0.5, position_error=0.7)]
    three, one = summarise(rows)
    assert (three.n, one.n) == (3, 1)
    assert three.spreads["position_error"].mean == pytest.approx(0.3)
    assert three.spreads["position_error"].sd == pytest.approx(np.sqrt(0.07))
    assert three.spreads["alignment_error"].mean == pytest.approx(0.33)
    assert one.spreads["position_error"].mean == 0.7
    assert one.spreads["position_error"].sd is None


@pytest.mark.parametrize(
    "other",
    [{"preference": "polar"}, {"labels": 3}, {"controller": "linear"}, {"wrong_answers": 0.1},
     {"queries": "designed"}, {"unlabelled": 50}, {"task": "pour"}, {"method": "no-align"}],
)  # fmt: skip
def test_whatever_else_is_varied_has_a_line_of_its_own(other: dict[str, object]) -> None:
    assert len(summarise([make_row(), make_row(**other)])) == 2


def test_the_summarys_table_names_n_and_every_measure() -> None:
    text = summary_csv(summarise([make_row(seed=0, motion_gain=0.9), make_row(seed=1)]))
    (line,) = csv.DictReader(io.StringIO(text))
    assert line["task"] == "plane"
    assert line["n"] == "2"
    assert float(line["motion_gain_mean"]) == pytest.approx(0.95)
    assert float(line["training_seconds_sd"]) == 0.0


def test_the_deviation_of_one_seed_is_left_empty() -> None:
    (line,) = csv.DictReader(io.StringIO(summary_csv(summarise([make_row()]))))
    assert line["position_error_sd"] == ""


def test_rows_read_back_are_the_rows_to_the_bit(tmp_path: Path) -> None:
    rows = [make_row(seed=seed, position_error=1.0 / (seed + 3)) for seed in range(4)]
    write_file(tmp_path / "rows.csv", rows_csv(rows))
    assert read_rows(tmp_path / "rows.csv") == rows


@pytest.mark.parametrize(
    "text", ["task,method\nplane,all-priors\n", rows_csv([make_row()]).replace("10,1000", "ten,N")]
)
def test_a_file_that_is_no_table_of_rows_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "rows.csv").write_text(text)
    with pytest.raises(SimulationError, match="is not a table of rows"):
        read_rows(tmp_path / "rows.csv")


def test_a_missing_file_says_what_makes_it(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match="joymap simulate --out"):
        read_rows(tmp_path / "rows.csv")


def test_rows_are_selected_by_all_that_is_wanted() -> None:
    rows = [make_row(seed=seed, noise=noise) for seed in range(2) for noise in (0.0, 0.1)]
    assert select(rows, noise=0.1, seed=1) == [replace(rows[3])]
