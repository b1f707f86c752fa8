"""What was recorded of drives, tick by tick, as Arrow tables: a part of a drive at a time."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa

from app.analysis.codebook import BEAD_COLUMNS, CUP_COLUMNS, SAMPLE_COLUMNS
from app.services.export_tables import Source
from app.services.records import split_props
from app.storage import drives
from app.storage.tables import DriveRow, ParticipantRow, SampleChunkRow
from app.storage.ticks import unpack, unpack_props
from models.tasks import get_task

_CHUNKS = 400  # at once: some minutes of driving
_DECIMALS = 7  # of [m]: as fine as what is stored


def samples_of(source: Source, who: ParticipantRow) -> Iterator[pa.Table]:
    """A participant's samples, in order; columns as in the codebook."""
    for drive, chunks in _parts(source, who):
        rows = np.concatenate([unpack(chunk.samples) for chunk in chunks])
        columns = _columns(source, who, drive, chunks)
        for index, column in enumerate(SAMPLE_COLUMNS):
            columns[column.name] = _array(rows[:, index], column.kind)
        yield pa.table(columns)


def props_of(source: Source, who: ParticipantRow) -> Iterator[pa.Table]:
    """Where cup and beads were in a participant's drives, in order; none without a cup."""
    for drive, chunks in _parts(source, who):
        props = get_task(drive.task).props
        if props.cup is None or any(chunk.props is None for chunk in chunks):
            continue
        rows = np.concatenate([unpack_props(chunk.props or b"", chunk.ticks) for chunk in chunks])
        cups, beads = split_props(rows, props)
        flat = np.hstack([cups, beads.reshape(len(beads), -1)]).round(_DECIMALS)
        columns = _columns(source, who, drive, chunks)
        for index, column in enumerate((*CUP_COLUMNS, *BEAD_COLUMNS)):
            is_there = index < flat.shape[1]
            columns[column.name] = (
                _array(flat[:, index]) if is_there else pa.nulls(len(flat), pa.float64())
            )
        yield pa.table(columns)


def _parts(source: Source, who: ParticipantRow) -> Iterator[tuple[DriveRow, list[SampleChunkRow]]]:
    for drive in drives.of_participant(source.db, who.id):
        chunks = list(drives.chunks(source.db, drive.id))
        for start in range(0, len(chunks), _CHUNKS):
            yield drive, chunks[start : start + _CHUNKS]


def _columns(
    source: Source, who: ParticipantRow, drive: DriveRow, chunks: list[SampleChunkRow]
) -> dict[str, Any]:
    ticks = [np.arange(chunk.first_tick, chunk.first_tick + chunk.ticks) for chunk in chunks]
    tick = np.concatenate(ticks)
    same = {
        "participant": source.names.of(who.id),
        "drive": source.names.of(drive.id),
        "task": drive.task,
        "strategy": drive.strategy,
        "step": drive.step,
    }
    return {name: pa.repeat(value, len(tick)) for name, value in same.items()} | {"tick": tick}


def _array(values: np.ndarray, kind: str = "number") -> pa.Array:
    is_missing = ~np.isfinite(values)
    if kind == "integer":
        return pa.array(np.where(is_missing, 0, values).astype(np.int64), mask=is_missing)
    return pa.array(values, mask=is_missing)
