import json
from pathlib import Path

import pytest

from app.analysis import simulation_journal
from app.analysis.simulation_journal import open_journal
from app.analysis.simulation_rows import SimulationError
from models.experiment import Cell
from tests.app.analysis.experiments import run_at_once

CELLS = [Cell("plane", "no-align", 0.0, seed, 10, 1000) for seed in range(3)]


def fill(folder: Path, cells: list[Cell] = CELLS) -> None:
    with open_journal(folder, is_fresh=False) as journal:
        for cell in cells:
            journal.add(cell, run_at_once(cell), 0.5)


def test_what_was_added_is_there_for_the_next_one(tmp_path: Path) -> None:
    fill(tmp_path)
    with open_journal(tmp_path, is_fresh=False) as journal:
        assert journal.rows == {cell: run_at_once(cell) for cell in CELLS}
        assert journal.seconds == dict.fromkeys(CELLS, 0.5)


def test_every_cell_is_on_the_disk_before_the_next(tmp_path: Path) -> None:
    with open_journal(tmp_path, is_fresh=False) as journal:
        for done, cell in enumerate(CELLS, start=1):
            journal.add(cell, run_at_once(cell), 0.5)
            assert len((tmp_path / "rows.jsonl").read_text().splitlines()) == done


@pytest.mark.parametrize("kept", [1, 40, -2])
def test_a_line_that_was_cut_off_is_dropped_and_its_cell_run_again(
    tmp_path: Path, kept: int
) -> None:
    fill(tmp_path)
    path = tmp_path / "rows.jsonl"
    whole = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(whole[0] + whole[1] + whole[2][:kept])
    with open_journal(tmp_path, is_fresh=False) as journal:
        assert list(journal.rows) == CELLS[:2]
        journal.add(CELLS[2], run_at_once(CELLS[2]), 0.5)
    with open_journal(tmp_path, is_fresh=False) as journal:
        assert list(journal.rows) == CELLS


def test_rows_of_other_code_are_refused_until_one_begins_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(tmp_path)
    before = (tmp_path / "rows.jsonl").read_bytes()
    monkeypatch.setattr(simulation_journal, "code_version", lambda: "another")
    with (
        pytest.raises(SimulationError, match=r"other code.*--fresh"),
        open_journal(tmp_path, is_fresh=False),
    ):
        pass
    assert (tmp_path / "rows.jsonl").read_bytes() == before
    with open_journal(tmp_path, is_fresh=True) as journal:
        assert not journal.rows


def test_rows_of_other_weights_have_another_origin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = simulation_journal.origin()
    (tmp_path / "plane.safetensors").write_bytes(b"other weights")
    monkeypatch.setattr(simulation_journal, "PRETRAINED", tmp_path)
    assert simulation_journal.origin() != here


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    fill(tmp_path)
    path = tmp_path / "rows.jsonl"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], json.dumps({"row": {}}), lines[2], ""]))
    with (
        pytest.raises(SimulationError, match=r"Line 2 of .* is damaged"),
        open_journal(tmp_path, is_fresh=False),
    ):
        pass


def test_two_simulations_do_not_write_to_one_folder(tmp_path: Path) -> None:
    with (
        open_journal(tmp_path, is_fresh=False),
        pytest.raises(SimulationError, match="Another simulation"),
        open_journal(tmp_path, is_fresh=True),
    ):
        pass


def test_cells_with_another_rotation_weight_are_other_cells(tmp_path: Path) -> None:
    fill(tmp_path)
    other = Cell("plane", "no-align", 0.0, 0, 10, 1000, rotation_weight=1.0)
    with open_journal(tmp_path, is_fresh=False) as journal:
        assert CELLS[0] in journal.rows
        assert other not in journal.rows
