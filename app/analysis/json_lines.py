"""A file of JSON lines that a run fills: each is on the disk before the next thing counts.

A run that is stopped, by Ctrl-C or by ``kill -9``, loses nothing that it has counted.
"""

import fcntl
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from app.analysis.simulation_rows import SimulationError


class JsonLines:
    """The lines of a file; :func:`open_lines` is the way in."""

    def __init__(self, file: BinaryIO) -> None:
        """Take the file as it is."""
        self._file = file

    def read(self, take: Callable[[Any], None]) -> None:
        """Hand on each entry that is there, in order.

        Args:
            take: Gets an entry; a ValueError, KeyError or TypeError from it says that the entry is
                damaged.

        Raises:
            SimulationError: If a line is damaged.
        """
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        for number, line in enumerate(content[:whole].splitlines(), start=1):
            try:
                take(json.loads(line))
            except (ValueError, KeyError, TypeError) as error:
                raise SimulationError(
                    f"Line {number} of {self._file.name} is damaged; begin anew with --fresh."
                ) from error
        # A line without its end was cut off by a kill: what it was about will be run again.
        self._file.truncate(whole)

    def add(self, entry: Mapping[str, Any]) -> None:
        """Keep an entry; when this returns it is on the disk."""
        self._file.write(json.dumps(entry).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())


@contextmanager
def open_lines(path: Path, *, is_fresh: bool) -> Iterator[JsonLines]:
    """A file, made with its folder if it is not there, for one process at a time.

    Args:
        path: Where it lies.
        is_fresh: Whether to throw away what is there.

    Raises:
        SimulationError: If another process is at it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise SimulationError(f"Another simulation is writing to {path.parent}.") from error
        if is_fresh:
            file.truncate(0)
        yield JsonLines(file)
