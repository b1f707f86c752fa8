"""A fresh, migrated database for each test, and rows to begin with."""

import shutil
from collections.abc import Generator
from pathlib import Path

import pytest

from app.storage.database import Database, migrate


@pytest.fixture(scope="session")
def empty_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("database") / "empty.db"
    migrate(path)
    return path


@pytest.fixture
def database(empty_file: Path, tmp_path: Path) -> Generator[Database]:
    shutil.copy(empty_file, tmp_path / "joymap.db")
    database = Database(tmp_path / "joymap.db")
    yield database
    database.close()
