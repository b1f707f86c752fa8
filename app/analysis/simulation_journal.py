"""The journal of a run: a line for each finished cell, on the disk before the next one counts.

A run that is stopped, by Ctrl-C or by ``kill -9``, loses nothing that its progress bar counted. Its
lines say what made them, so that rows of different code, weights or libraries never mix.
"""

import fcntl
import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import BinaryIO

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

    def __init__(self, file: BinaryIO, origin: str) -> None:
        """Read what is there; :func:`open_journal` is the way in."""
        self.rows: dict[Cell, Row] = {}
        self.seconds: dict[Cell, float] = {}
        self._file = file
        self._origin = origin
        self._read()

    def add(self, cell: Cell, row: Row, seconds: float) -> None:
        """Keep a finished cell; when this returns it is on the disk."""
        line = {
            "origin": self._origin,
            "rotation_weight": cell.rotation_weight,
            "seconds": seconds,
            "row": asdict(row),
        }
        self._file.write(json.dumps(line).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.rows[cell] = row
        self.seconds[cell] = seconds

    def _read(self) -> None:
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        for number, line in enumerate(content[:whole].splitlines(), start=1):
            try:
                entry = json.loads(line)
                origin, row = entry["origin"], Row(**entry["row"])
                cell = Cell(
                    **{name: getattr(row, name) for name in _CELL_COLUMNS},
                    rotation_weight=entry["rotation_weight"],
                )
                seconds = float(entry["seconds"])
            except (ValueError, KeyError, TypeError) as error:
                raise SimulationError(
                    f"Line {number} of {self._file.name} is damaged; begin anew with --fresh."
                ) from error
            if origin != self._origin:
                raise SimulationError(
                    f"{Path(self._file.name).parent} holds rows that other code, weights or "
                    "libraries made; begin anew with --fresh, or give another --out."
                )
            self.rows[cell] = row
            self.seconds[cell] = seconds
        # A line without its end was cut off by a kill: its cell will be run again.
        self._file.truncate(whole)


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
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / _NAME).open("a+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise SimulationError(f"Another simulation is writing to {folder}.") from error
        if is_fresh:
            file.truncate(0)
        yield Journal(file, origin())


def origin() -> str:
    """Twelve digits for all that decides a row beside its cell: code, weights and libraries."""
    weights = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(PRETRAINED.glob("*.safetensors"))
    }
    parts = json.dumps([code_version(), weights, library_versions()], sort_keys=True)
    return hashlib.sha256(parts.encode()).hexdigest()[:12]
