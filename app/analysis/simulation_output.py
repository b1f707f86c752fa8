"""The files of a run: rows, summary, figure, and what the run was."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from app.analysis.pictures import ENDINGS, save_figure
from app.analysis.simulation_figure import bars_figure
from app.analysis.simulation_grid import Grid
from app.analysis.simulation_rows import (
    SimulationError,
    read_rows,
    rows_csv,
    summarise,
    summary_csv,
    write_file,
)
from models.experiment import Row

_TEXTS = ("rows.csv", "summary.csv", "run.json")
_FIGURE = "figure"


@dataclass(frozen=True)
class Run:
    """A run as its files tell it.

    Attributes:
        folder: Where they lie.
        rows: In the order of the grid.
        rotation_weight: Of the rows' alignment errors, in [1/rad].
        origin: What made the rows (code, weights and libraries).
        worker_seconds: What all cells together took their workers, in [s].
    """

    folder: Path
    rows: list[Row]
    rotation_weight: float
    origin: str
    worker_seconds: float


def write_run(run: Run, grid: Grid) -> list[Path]:
    """Write ``rows.csv``, ``summary.csv``, ``run.json`` and ``figure.*``; returns their paths."""
    about = {
        "grid": asdict(grid),
        "rotation_weight": run.rotation_weight,
        "origin": run.origin,
        "worker_seconds": run.worker_seconds,
    }
    texts = (
        rows_csv(run.rows),
        summary_csv(summarise(run.rows)),
        json.dumps(about, indent=1) + "\n",
    )
    for name, text in zip(_TEXTS, texts, strict=True):
        write_file(run.folder / name, text)
    figure = bars_figure(run.rows, run.rotation_weight)
    return [run.folder / name for name in _TEXTS] + save_figure(figure, run.folder / _FIGURE)


def remove_results(folder: Path) -> None:
    """Take away what :func:`write_run` wrote before: it would not go with the rows to come."""
    for name in (*_TEXTS, *(f"{_FIGURE}.{ending}" for ending in ENDINGS)):
        (folder / name).unlink(missing_ok=True)


def read_run(folder: Path) -> Run:
    """A run from its folder.

    Raises:
        SimulationError: If its files are missing or damaged.
    """
    rows = read_rows(folder / "rows.csv")
    if not rows:
        raise SimulationError(f"{folder / 'rows.csv'} holds no rows.")
    path = folder / "run.json"
    try:
        about = json.loads(path.read_text())
        return Run(
            folder,
            rows,
            float(about["rotation_weight"]),
            str(about["origin"]),
            float(about["worker_seconds"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SimulationError(f"{path} is missing or damaged.") from error


def as_json(run: Run, grid: Grid) -> str:
    """Everything of a run in one text for programs: the grid, the rows and their summary."""
    content: dict[str, Any] = {
        "grid": asdict(grid),
        "origin": run.origin,
        "rows": [asdict(row) for row in run.rows],
        "summary": [asdict(setting) for setting in summarise(run.rows)],
    }
    return json.dumps(content, indent=1) + "\n"


def written_names(paths: Sequence[Path]) -> str:
    """The files' names for a sentence."""
    return ", ".join(path.name for path in paths)
