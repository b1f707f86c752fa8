import asyncio
from typing import Any

import numpy as np

from app.services import drives as drive_service
from app.storage import drives
from app.storage.database import Database
from app.storage.tables import DriveRow
from app.storage.ticks import COLUMNS, pack, unpack, unpack_props
from app.teleop.recorder import DriveLog, Recorder
from tests.app.factories import make_participant, now


def test_samples_come_back_as_they_were(rng: np.random.Generator) -> None:
    rows = rng.normal(size=(37, len(COLUMNS)))
    assert np.array_equal(unpack(pack(rows)), rows)


def make_drive(database: Database) -> str:
    with database.write() as db:
        participant = make_participant(db, step="driving")
        db.add(
            DriveRow(
                id="drive",
                participant_id=participant.id,
                task="plane",
                step="driving",
                strategy="no-align",
                alignment_id=None,
                boot="boot",
                started_at=now(),
                started_monotonic_s=0.0,
            )
        )
    return "drive"


def row(tick: int) -> np.ndarray:
    values = np.full(len(COLUMNS), float(tick))
    values[0] = tick / 60
    return values


def test_ticks_reach_the_database_while_the_drive_runs_and_once(database: Database) -> None:
    drive_id = make_drive(database)

    async def record() -> list[int]:
        recorder = Recorder(database)
        running = asyncio.create_task(recorder.run())
        log = DriveLog(recorder, drive_id, 0, 0.5)
        stored = []
        for tick in range(200):
            log.add(row(tick), np.full(3, float(tick)))
            if tick == 100:
                await asyncio.sleep(0.2)
                with database.read() as db:
                    stored = [chunk.ticks for chunk in drives.chunks(db, drive_id)]
        log.end("left")
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        return stored

    assert sum(asyncio.run(record())) >= 60  # all but the last half second, in mid-drive
    with database.read() as db:
        chunks = drives.chunks(db, drive_id)
        ticks = np.concatenate([unpack(chunk.samples)[:, 1] for chunk in chunks])
        assert ticks.tolist() == list(range(200))
        props = np.concatenate([unpack_props(chunk.props or b"", chunk.ticks) for chunk in chunks])
        assert props.tolist() == [[float(tick)] * 3 for tick in range(200)]
        ended = db.get_one(DriveRow, drive_id)
        assert ended.end == "left"
        assert ended.ended_at is not None


def test_a_chunk_that_cannot_be_stored_does_not_stop_the_next(
    database: Database, monkeypatch: Any
) -> None:
    drive_id = make_drive(database)
    keep, calls = drive_service.keep_samples, []

    def fail_first(*given: Any) -> None:
        calls.append(given)
        if any(chunk.first_tick == 0 for chunk in given[1]):
            raise OSError("disk full")
        keep(*given)

    monkeypatch.setattr(drive_service, "keep_samples", fail_first)

    async def record() -> None:
        recorder = Recorder(database)
        running = asyncio.create_task(recorder.run())
        recorder.keep(drive_id, 0, [row(0)], [np.zeros(0)])
        recorder.keep(drive_id, 1, [row(1)], [np.zeros(0)])
        recorder.end(drive_id, "left", {"fraction": 0.5})
        await asyncio.sleep(0.3)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    asyncio.run(record())
    with database.read() as db:
        assert [chunk.first_tick for chunk in drives.chunks(db, drive_id)] == [1]
        ended = db.get_one(DriveRow, drive_id)
        assert (ended.end, ended.outcome) == ("left", {"fraction": 0.5})
