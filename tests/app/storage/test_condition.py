"""A database that cannot be used is said in one sentence by every command, and stays as it is."""

import sqlite3
from pathlib import Path

import pytest

from app.cli import main
from app.storage import condition
from app.storage.database import migrate
from models.panda_pack import default_folder

FIRST = "c5631a66e27a"
SERVE, MIGRATE, EXPORT = ["serve", "--port", "0"], ["migrate"], ["export", "demo", "--out", "x.zip"]


def newer(path: Path) -> None:
    migrate(path)
    with sqlite3.connect(path) as file:
        file.execute("UPDATE alembic_version SET version_num = 'from_the_future'")
    file.close()


def older(path: Path) -> None:
    migrate(path, FIRST)


def damaged(path: Path) -> None:
    path.write_bytes(b"not a database at all" * 200)


def cut_off(path: Path) -> None:
    migrate(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def empty(path: Path) -> None:
    path.touch()


def anothers(path: Path) -> None:
    with sqlite3.connect(path) as file:
        file.execute("CREATE TABLE recipe (name TEXT)")
    file.close()


@pytest.mark.parametrize(
    ("make", "words", "said"),
    [
        *((newer, words, "newer Joymap") for words in (SERVE, MIGRATE, EXPORT)),
        *((damaged, words, "damaged or no database") for words in (SERVE, MIGRATE, EXPORT)),
        *((cut_off, words, "damaged or no database") for words in (SERVE, MIGRATE, EXPORT)),
        *((anothers, words, "another program's") for words in (SERVE, MIGRATE, EXPORT)),
        (older, EXPORT, "bring it up to date with 'joymap migrate'"),
        (empty, EXPORT, "is empty"),
    ],
)
def test_what_cannot_be_used_is_said_and_stays_as_it_is(
    make: object,
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("JOYMAP_DATA_DIR", str(tmp_path))
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(default_folder()))
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "joymap.db"
    make(path)  # type: ignore[operator]
    before = path.read_bytes()
    capsys.readouterr()
    assert main(words) == 2
    heard = capsys.readouterr().err
    assert said in heard
    assert heard.count("\n") == 1
    assert path.read_bytes() == before


@pytest.mark.parametrize("words", [SERVE, MIGRATE])
def test_a_data_folder_that_is_a_file_is_said(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(default_folder()))
    for folder in ("file", "file/below"):
        monkeypatch.setenv("JOYMAP_DATA_DIR", str(tmp_path / folder))
        assert main(words) == 2
        heard = capsys.readouterr().err
        assert "set JOYMAP_DATA_DIR" in heard
        assert heard.count("\n") == 1


@pytest.mark.parametrize("make", [older, empty])
def test_what_is_older_is_copied_aside_and_brought_up_to_date(make: object, tmp_path: Path) -> None:
    path = tmp_path / "joymap.db"
    make(path)  # type: ignore[operator]
    for _ in range(2):
        migrate(path)
        assert condition.revision_of(path) == condition.newest()
    copies = sorted(tmp_path.glob("joymap-before-*.db"))
    assert [condition.revision_of(copy) for copy in copies] == ([FIRST] if make is older else [])


def test_a_copy_aside_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "joymap.db"
    older(path)
    copies = {condition.copy_aside(path, FIRST) for _ in range(3)}
    assert len(copies) == 3
    assert all(condition.revision_of(copy) == FIRST for copy in copies)
