"""The one database: SQLite in WAL mode, one writer at a time, committed before anyone is told.

Every write begins with ``BEGIN IMMEDIATE`` behind a lock of this process, so that reading and then
writing is one step and nobody meets "database is locked". A committed transaction survives
``kill -9`` and, with ``synchronous=FULL``, a power cut (as SQLite documents it).
"""

import fcntl
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from alembic import command
from sqlalchemy import Engine, create_engine, event, text
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from app.storage import condition

# What SQLite says when another program holds the file, or there is no room to write to.
DatabaseTrouble = OperationalError

_PRAGMAS = (
    "PRAGMA journal_mode=WAL",
    "PRAGMA synchronous=FULL",
    "PRAGMA foreign_keys=ON",
    "PRAGMA busy_timeout=5000",
    "PRAGMA trusted_schema=OFF",
    "PRAGMA secure_delete=ON",
)


def make_engine(path: Path) -> Engine:
    """An engine whose transactions begin when they say so."""
    engine = create_engine(f"sqlite:///{path}")

    @event.listens_for(engine, "connect")
    def _connect(connection: Any, _record: Any) -> None:
        # Python's driver would begin transactions on its own, too late and without saying so.
        connection.isolation_level = None
        for pragma in _PRAGMAS:
            connection.execute(pragma)

    @event.listens_for(engine, "begin")
    def _begin(connection: Any) -> None:
        options = connection.get_execution_options()
        connection.exec_driver_sql("BEGIN IMMEDIATE" if options.get("writes") else "BEGIN")

    return engine


def migrate(path: Path, revision: str = "head") -> None:
    """Bring the file up to a schema, the newest by default, making it if need be.

    What holds something already is copied aside first: there is no way back.

    Raises:
        UnusableDatabase: If there is something there that cannot be brought up, and what to do.
    """
    condition.require_folder(path.parent)
    before = condition.revision_of(path)
    if before is not None and before != condition.newest():
        condition.copy_aside(path, before)
    command.upgrade(condition.configuration(path), revision)


class Database:
    """Where everything that was given is kept."""

    def __init__(self, path: Path) -> None:
        """Open the (migrated) file and make sure no other server has it open.

        Raises:
            DatabaseInUse: If another server runs on the same folder.
        """
        self._lock_file = _take(path.with_suffix(".lock"))
        self._engine = make_engine(path)
        self._writing_engine = self._engine.execution_options(writes=True)
        self._writer = threading.Lock()

    @contextmanager
    def read(self) -> Generator[Session]:
        """A consistent view of the data, for reading only."""
        with Session(self._engine) as db:
            yield db
            db.rollback()

    @contextmanager
    def write(self) -> Generator[Session]:
        """One transaction: committed when the block ends, undone when it raises."""
        with self._writer, Session(self._writing_engine, expire_on_commit=False) as db, db.begin():
            yield db

    def forget_erased(self) -> bool:
        """Empty the write-ahead log, in which erased rows still stand; whether that was possible.

        The database file itself overwrites what is deleted (``secure_delete``).
        """
        with self._writer, self._engine.connect() as connection:
            raw = connection.connection.driver_connection
            assert raw is not None
            is_busy = raw.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]
        return not is_busy

    @contextmanager
    def counting(self, statements: list[str]) -> Generator[None]:
        """Gather the statements that are run meanwhile: for whoever watches over their number."""

        def note(_conn: Any, _cursor: Any, statement: str, *_more: Any) -> None:
            statements.append(statement)

        event.listen(self._engine, "before_cursor_execute", note)
        try:
            yield
        finally:
            event.remove(self._engine, "before_cursor_execute", note)

    def ping(self) -> None:
        """Read one thing; raises if the file cannot be read."""
        with self.read() as db:
            db.execute(text("SELECT 1"))

    def close(self) -> None:
        """Let the file go."""
        self._engine.dispose()
        self._lock_file.close()


class DatabaseInUse(Exception):
    """Another server runs on the same data."""


def _take(path: Path) -> IO[str]:
    file = path.open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        file.close()
        raise DatabaseInUse(
            f"Another joymap server uses {path.parent}; stop it, or set JOYMAP_DATA_DIR."
        ) from error
    return file
