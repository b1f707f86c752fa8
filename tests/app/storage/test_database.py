import sqlite3
import threading
import zlib
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import UniqueConstraint, inspect, select, text

from app.services import flow, queries
from app.storage.database import Database, DatabaseInUse, make_engine, migrate
from app.storage.tables import ParticipantRow, Row
from app.storage.ticks import COLUMNS, unpack
from tests.app.factories import make_participant


def test_read_then_write_from_many_threads_loses_nothing(database: Database) -> None:
    with database.write() as db:
        participant_id = make_participant(db).id

    def count_up() -> None:
        for _ in range(25):
            with database.write() as db:
                row = db.get_one(ParticipantRow, participant_id)
                row.seed = row.seed + 1

    with database.read() as db:
        before = db.get_one(ParticipantRow, participant_id).seed
    threads = [threading.Thread(target=count_up) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as db:
        assert db.get_one(ParticipantRow, participant_id).seed == before + 16 * 25


def test_a_transaction_that_raises_changes_nothing(database: Database) -> None:
    with pytest.raises(ZeroDivisionError), database.write() as db:
        make_participant(db)
        raise ZeroDivisionError
    with database.read() as db:
        assert db.scalars(select(ParticipantRow)).all() == []


def test_a_second_server_on_the_same_data_is_refused(database: Database, tmp_path: Path) -> None:
    with pytest.raises(DatabaseInUse, match="Another joymap server uses"):
        Database(tmp_path / "joymap.db")


def test_commits_are_synced_to_the_disk(database: Database) -> None:
    with database.read() as db:
        assert db.execute(text("PRAGMA journal_mode")).scalar() == "wal"
        assert db.execute(text("PRAGMA synchronous")).scalar() == 2
        assert db.execute(text("PRAGMA foreign_keys")).scalar() == 1


def test_the_migrations_make_the_tables_the_app_uses(tmp_path: Path) -> None:
    migrate(tmp_path / "new.db")
    found = inspect(make_engine(tmp_path / "new.db"))
    for table in Row.metadata.sorted_tables:
        columns = {column["name"]: column for column in found.get_columns(table.name)}
        assert set(columns) == {column.name for column in table.columns}, table.name
        for column in table.columns:
            assert columns[column.name]["nullable"] == column.nullable, column
        uniques = {
            tuple(unique["column_names"]) for unique in found.get_unique_constraints(table.name)
        }
        wanted = {
            tuple(column.name for column in constraint.columns)
            for constraint in table.constraints
            if isinstance(constraint, UniqueConstraint)
        }
        assert uniques == wanted, table.name


def test_migrating_twice_is_migrating_once(tmp_path: Path) -> None:
    migrate(tmp_path / "twice.db")
    migrate(tmp_path / "twice.db")
    found = inspect(make_engine(tmp_path / "twice.db"))
    assert set(found.get_table_names()) == {*Row.metadata.tables, "alembic_version"}


def test_ticks_recorded_before_touches_were_stay_readable(tmp_path: Path) -> None:
    path, rows = tmp_path / "old.db", np.random.default_rng(2).normal(size=(7, len(COLUMNS) - 1))
    migrate(path, "b2d9c4a7e610")
    with closing(sqlite3.connect(path)) as db, db:
        db.execute(
            "INSERT INTO sample_chunk (drive_id, first_tick, ticks, last_monotonic_s, samples)"
            " VALUES ('d', 0, 7, 1.0, ?)",
            [zlib.compress(rows.astype("<f8").tobytes())],
        )
    migrate(path)
    with closing(sqlite3.connect(path)) as db:
        found = unpack(db.execute("SELECT samples FROM sample_chunk").fetchone()[0])
    assert np.array_equal(found[:, :-1], rows)
    assert np.isnan(found[:, -1]).all()


def test_who_took_part_before_there_were_studies_is_where_they_were(tmp_path: Path) -> None:
    path = tmp_path / "old.db"
    migrate(path, "e81b5c20d9f4")
    steps = ("consent", "practice", "queries", "training", "driving")
    with closing(sqlite3.connect(path)) as db, db:
        for number, step in enumerate(steps, start=1):
            task = "plane" if number < 4 else "avoid"
            db.execute(
                "INSERT INTO participant (id, number, origin, token_hash, seed, task, step,"
                " created_at) VALUES (?, ?, 'start', ?, 7, ?, ?, '2026-11-23 12:00:00')",
                [f"p{number}", number, f"hash {number}", task, step],
            )
        db.execute(
            "INSERT INTO query (id, participant_id, position, pool_index, controller_hash, s, z,"
            " next_s, path, hand_path)"
            " VALUES ('q', 'p4', 1, 1, 'c', '[]', '[]', '[]', '[]', '[]')"
        )
        db.execute(
            "INSERT INTO answer (id, participant_id, query_id, h_x, h_y, thinking_time_s,"
            " answered_at) VALUES ('a', 'p4', 'q', 0.5, 0.5, 1.0, '2026-11-23 12:00:00')"
        )
    migrate(path)
    database = Database(path)
    with database.read() as session:
        for number, step in enumerate(steps, start=1):
            participant = session.get_one(ParticipantRow, f"p{number}")
            at = flow.here(session, participant)
            assert (at.step.kind, participant.state) == (step, "active")
            assert at.task.task == ("plane" if number < 4 else "avoid")
            assert participant.token_hash == f"hash {number}"
        (question,) = queries.asked(session, session.get_one(ParticipantRow, "p4"), at.task)
        assert question.answer is not None
        assert question.answer.h_x == 0.5
    database.close()
