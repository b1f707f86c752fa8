"""The journal of a run: a line for each finished cell, on the disk before the next one counts.

Its lines say what made them, so that rows of different code, weights or libraries never mix.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from app.analysis.json_lines import JsonLines, open_lines
from app.analysis.simulation_rows import SimulationError
from models.checkpoints import PRETRAINED, code_version, library_versions
from models.experiment import Cell, Row

_NAME = "rows.jsonl"
_CELL_COLUMNS = tuple(f.name for f in fields(Cell) if f.name != "rotation_weight")


class Journal:
    """The finished cells of a folder.

    Attributes:
        rows: Row by cell, those of earlier runs included.
        seconds: How long each cell took its worker, in [s].
    """

    def __init__(self, lines: JsonLines, folder: Path, origin: str) -> None:
        """Read what is there; :func:`open_journal` is the way in."""
        self.rows: dict[Cell, Row] = {}
        self.seconds: dict[Cell, float] = {}
        self._lines = lines
        self._folder = folder
        self._origin = origin
        lines.read(self._take)

    def add(self, cell: Cell, row: Row, seconds: float) -> None:
        """Keep a finished cell; when this returns it is on the disk."""
        self._lines.add(
            {
                "origin": self._origin,
                "rotation_weight": cell.rotation_weight,
                "seconds": seconds,
                "row": asdict(row),
            }
        )
        self.rows[cell] = row
        self.seconds[cell] = seconds

    def _take(self, entry: Any) -> None:
        origin, row = entry["origin"], Row(**entry["row"])
        cell = Cell(
            **{name: getattr(row, name) for name in _CELL_COLUMNS},
            rotation_weight=entry["rotation_weight"],
        )
        seconds = float(entry["seconds"])
        if origin != self._origin:
            raise SimulationError(
                f"{self._folder} holds rows that other code, weights or libraries made; begin "
                "anew with --fresh, or give another --out."
            )
        self.rows[cell] = row
        self.seconds[cell] = seconds


@contextmanager
def open_journal(folder: Path, *, is_fresh: bool) -> Iterator[Journal]:
    """The journal of a folder, which is made if it is not there, for one process at a time.

    Args:
        folder: Where the run's files lie.
        is_fresh: Whether to throw away what is there.

    Raises:
        SimulationError: If the rows there were made by something else or are damaged, or another
            process is at it.
    """
    with open_lines(folder / _NAME, is_fresh=is_fresh) as lines:
        yield Journal(lines, folder, origin())


def origin() -> str:
    """Twelve digits for all that decides a row beside its cell: code, weights and libraries."""
    weights = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(PRETRAINED.glob("*.safetensors"))
    }
    parts = json.dumps([code_version(), weights, library_versions()], sort_keys=True)
    return hashlib.sha256(parts.encode()).hexdigest()[:12]
