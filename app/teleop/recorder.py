"""Every tick of a drive, on its way to the database while the drive runs.

Ticks are gathered for half a second, compressed, and written by one task in the background, in
order, all drives together; little more than the last half second is ever in memory alone.
"""

import asyncio
import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.services import drives
from app.storage.database import Database
from app.storage.ticks import pack, pack_props

_LOG = logging.getLogger(__name__)
_GATHER_S = 0.1  # what comes in this time is written in one transaction


@dataclass(frozen=True)
class _Chunk:
    drive_id: str
    first_tick: int
    rows: np.ndarray
    props: np.ndarray


@dataclass(frozen=True)
class _End:
    drive_id: str
    why: str
    outcome: dict[str, Any] | None


class Recorder:
    """Takes ticks on the event loop; ``run`` writes them."""

    def __init__(self, database: Database) -> None:
        """Begin with nothing to write."""
        self._database = database
        self._waiting: list[_Chunk | _End] = []
        self._is_waiting = asyncio.Event()

    def keep(
        self, drive_id: str, first_tick: int, rows: list[np.ndarray], props: list[np.ndarray]
    ) -> None:
        """Queue a chunk of ticks for writing, with where the props were at each."""
        self._add(_Chunk(drive_id, first_tick, np.array(rows), np.array(props)))

    def end(self, drive_id: str, why: str, outcome: dict[str, Any] | None) -> None:
        """Queue the end of a drive, after its chunks."""
        self._add(_End(drive_id, why, outcome))

    def _add(self, item: _Chunk | _End) -> None:
        self._waiting.append(item)
        self._is_waiting.set()

    async def run(self) -> None:
        """Write what comes until cancelled; what is queued then is still written."""
        try:
            while True:
                await self._is_waiting.wait()
                await asyncio.sleep(_GATHER_S)  # other drives' chunks go with it
                await self.write_waiting()
        finally:
            await self.write_waiting()

    async def write_waiting(self) -> None:
        """Write what has come so far."""
        items, self._waiting = self._waiting, []
        self._is_waiting.clear()
        if items and not await self._write(items):
            # Together they could not be written: only those that cannot be alone are lost.
            for item in items:
                await self._write([item])

    async def _write(self, items: list[_Chunk | _End]) -> bool:
        """Write them in one transaction; whether that was possible."""
        try:
            await asyncio.shield(asyncio.to_thread(self._store, items))
        except Exception:
            # Nothing may stop the recording of what comes after, but it must be seen.
            names = ", ".join(sorted({item.drive_id for item in items}))
            _LOG.exception("samples of drive %s could not be stored", names)
            return False
        return True

    def _store(self, items: list[_Chunk | _End]) -> None:
        chunks = [
            drives.Chunk(
                item.drive_id,
                item.first_tick,
                len(item.rows),
                float(item.rows[-1, 0]),
                pack(item.rows),
                pack_props(item.props) if item.props.size else None,
            )
            for item in items
            if isinstance(item, _Chunk)
        ]
        with self._database.write() as db:
            drives.keep_samples(db, chunks)
            for item in items:
                if isinstance(item, _End):
                    drives.end(db, item.drive_id, item.why, item.outcome)


class DriveLog:
    """One drive's ticks, handed on in chunks."""

    def __init__(self, recorder: Recorder, drive_id: str, first_tick: int, chunk_s: float) -> None:
        """Begin at ``first_tick`` of the drive."""
        self.drive_id = drive_id
        self._recorder = recorder
        self._next_tick = first_tick
        self._chunk_s = chunk_s
        self._rows: list[np.ndarray] = []
        self._props: list[np.ndarray] = []

    def add(self, row: np.ndarray, props: np.ndarray) -> None:
        """Keep one tick: a row of ``COLUMNS``, and the props' numbers (see :func:`pack_props`)."""
        self._rows.append(row)
        self._props.append(props)
        if row[0] - self._rows[0][0] >= self._chunk_s:
            self.flush()

    def flush(self) -> None:
        """Hand on what is there."""
        if self._rows:
            self._recorder.keep(self.drive_id, self._next_tick, self._rows, self._props)
            self._next_tick += len(self._rows)
            self._rows, self._props = [], []

    def end(self, why: str, outcome: dict[str, Any] | None = None) -> None:
        """Hand on what is there and end the drive."""
        self.flush()
        self._recorder.end(self.drive_id, why, outcome)
