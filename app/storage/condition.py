"""Whether a database file can be used: that it is one, whole, and of a schema known here."""

import contextlib
import os
import sqlite3
from pathlib import Path

from alembic.config import Config
from alembic.script import ScriptDirectory
from alembic.util import CommandError

from app.errors import JoymapError
from app.settings import MIGRATIONS_DIR


class UnusableDatabase(JoymapError):
    """A file, or a folder, that no server can run on; says what to do."""

    status_code = 500
    kind = "unusable-database"


def configuration(path: Path) -> Config:
    """Alembic's, for this file."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS_DIR))
    # Alembic reads % as the beginning of a name.
    config.set_main_option("sqlalchemy.url", f"sqlite:///{path}".replace("%", "%%"))
    return config


def require_folder(folder: Path) -> None:
    """Make sure of a folder that can be written to.

    Raises:
        UnusableDatabase: If there is none and none can be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnusableDatabase(
            f"The data folder {folder} cannot be used ({error.strerror}); set JOYMAP_DATA_DIR."
        ) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UnusableDatabase(
            f"The data folder {folder} cannot be written to; set JOYMAP_DATA_DIR, or change who "
            "may write there."
        )


def revision_of(path: Path) -> str | None:
    """The schema of a file, by the name of its last migration; None: it holds nothing yet.

    Raises:
        UnusableDatabase: If it is no database of Joymap's, is damaged, or is of a newer Joymap.
    """
    if not path.exists() or path.stat().st_size == 0:
        return None
    try:
        with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as file:
            sound = file.execute("PRAGMA quick_check(1)").fetchone()[0]
            if sound != "ok":
                raise sqlite3.DatabaseError(sound)
            tables = {name for (name,) in file.execute("SELECT name FROM sqlite_master")}
            if not tables:
                return None
            if "alembic_version" not in tables:
                raise UnusableDatabase(
                    f"{path} is a database of another program's; set JOYMAP_DATA_DIR to a folder "
                    "of Joymap's."
                )
            found = file.execute("SELECT version_num FROM alembic_version").fetchone()
    except sqlite3.DatabaseError as error:
        raise UnusableDatabase(
            f"{path} is damaged or no database ({error}); put a copy of it in its place, or set "
            "JOYMAP_DATA_DIR to another folder."
        ) from error
    if found is None:
        return None
    revision = str(found[0])
    try:
        ScriptDirectory.from_config(configuration(path)).get_revision(revision)
    except CommandError as error:
        raise UnusableDatabase(
            f"{path} was last used by a newer Joymap (its schema {revision} is not known here); "
            "use that version, or the copy it made before it changed the file."
        ) from error
    return revision


def newest() -> str:
    """The schema that this code works with."""
    head = ScriptDirectory.from_config(configuration(Path())).get_current_head()
    assert head is not None
    return head


def require_newest(path: Path) -> None:
    """Make sure that a file can be read as it is.

    Raises:
        UnusableDatabase: If it is not there, empty, damaged, or of an older or newer Joymap.
    """
    if not path.exists():
        raise UnusableDatabase(f"There is no database in {path.parent}; set JOYMAP_DATA_DIR.")
    revision = revision_of(path)
    if revision is None:
        raise UnusableDatabase(f"{path} is empty; there is nothing in it to read.")
    if revision != newest():
        raise UnusableDatabase(
            f"{path} was made by an older Joymap; bring it up to date with 'joymap migrate'."
        )


def copy_aside(path: Path, revision: str) -> Path:
    """A whole copy of a file beside it, named by its schema; one that is there stays."""
    copy = path.with_name(f"{path.stem}-before-{revision}{path.suffix}")
    number = 1
    while copy.exists():
        number += 1
        copy = path.with_name(f"{path.stem}-before-{revision}-{number}{path.suffix}")
    with (
        contextlib.closing(sqlite3.connect(path)) as source,
        contextlib.closing(sqlite3.connect(copy)) as target,
    ):
        source.backup(target)
    return copy
