from pathlib import Path

from app.analysis.simulation_journal import open_journal
from app.analysis.simulation_run import Failure, run_cells
from models.experiment import Cell
from tests.app.analysis.experiments import run_all_but_two, run_at_once

CELLS = [Cell("plane", "no-align", 0.0, seed, 10, 1000) for seed in range(6)]


def test_a_cell_that_fails_is_named_and_leaves_the_others_alone(tmp_path: Path) -> None:
    ended: list[Failure[Cell] | None] = []
    with open_journal(tmp_path, is_fresh=False) as journal:
        failures = run_cells(CELLS, journal.add, 2, ended.append, run_all_but_two)
        found = {cell: row.alignment_error for cell, row in journal.rows.items()}
    assert found == {c: run_at_once(c).alignment_error for c in CELLS if c.seed not in (1, 2)}
    reasons = {failure.cell.seed: failure.reason for failure in failures}
    assert reasons == {1: "Seed 1 brings bad luck.", 2: "Its process died (exit code 7)."}
    assert len(ended) == len(CELLS)
    assert {failure for failure in ended if failure} == set(failures)
