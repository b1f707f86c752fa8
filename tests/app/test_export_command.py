"""``joymap export`` and the download: the same data, beside a running server."""

import asyncio
import io
import json
import os
import signal
import subprocess
import sys
import zipfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.cli import main
from app.jobs import commands
from app.main import create_app
from app.routers import exports as routers_exports
from app.services import accounts
from app.services.export_package import MANIFEST, Zip
from app.settings import Settings
from app.storage.database import Database, migrate
from app.storage.tables import AuditRow
from models.panda_pack import default_folder
from tests.app.exported import TICKS, lines_of, make_whole_study
from tests.app.factories import make_study

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def study_id(database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("JOYMAP_DATA_DIR", str(tmp_path))
    with database.write() as db:
        return make_whole_study(db)


def test_the_command_writes_a_zip_that_the_example_reads(
    study_id: str, tmp_path: Path, capsys: Any
) -> None:
    out = tmp_path / "out.zip"
    assert main(["export", study_id, "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "4 participants, 3 consents, 3 events, 18 queries, 21 answers" in said.out
    assert f"{6 * TICKS} samples" in said.out
    assert said.err == ""
    read = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "read_export.py"), str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert read.returncode == 0, read.stderr
    assert "3 participants, 4 drives" in read.stdout
    assert "5 labels" in read.stdout


def test_a_study_can_be_named_by_its_title_if_no_other_has_it(
    study_id: str, database: Database, tmp_path: Path, capsys: Any
) -> None:
    out = str(tmp_path / "out.zip")
    options = ["--out", out, "--no-lerobot"]
    assert main(["export", "A small study", *options, "--without-excluded"]) == 0
    assert capsys.readouterr().out.startswith("3 participants, ")
    assert "lerobot" not in str(zipfile.ZipFile(out).namelist())
    with database.write() as db:
        make_study(db)
    assert main(["export", "A small study", *options]) == 2
    assert capsys.readouterr().err == "Several studies are called 'A small study'; use an id.\n"
    assert main(["export", study_id, *options]) == 0


def test_a_folder_appears_when_it_is_whole(study_id: str, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "out"
    command = ["export", study_id, "--out", str(out), "--format", "folder"]
    assert main(command) == 0
    assert (out / MANIFEST).exists()
    assert (out / "lerobot" / "meta" / "info.json").exists()
    assert main(command) == 2
    assert capsys.readouterr().err == (
        f"There is something at {out} already; choose another name.\n"
    )


def test_what_goes_wrong_is_said_in_a_sentence_and_leaves_nothing(
    study_id: str, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "new"
    folder.mkdir()
    out = str(folder / "out.zip")

    def refusal(*arguments: str) -> str:
        assert main(["export", *arguments]) == 2
        said: str = capsys.readouterr().err
        assert len(said.splitlines()) == 1
        return said

    assert refusal("no such study", "--out", out) == "There is no such study.\n"
    assert "--format folder" in refusal(study_id, "--out", str(folder))
    assert "stdout" in refusal(study_id, "--out", "-", "--format", "folder")
    assert "No such file" in refusal(study_id, "--out", str(folder / "a" / "b.zip"))

    def full(*_arguments: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Zip, "seal", full)
        assert "No space left" in refusal(study_id, "--out", out)
    assert list(folder.iterdir()) == []
    monkeypatch.setenv("JOYMAP_DATA_DIR", str(folder))
    assert "There is no database" in refusal(study_id, "--out", out)


@pytest.fixture
def client(tmp_path: Path) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path, panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        database = client.app.state.service.database  # type: ignore[attr-defined]
        with database.write() as db:
            token = accounts.new_setup_link(db, "owner", None)
            login = accounts.sign_up(db, token, "somebody", "not a hash")
        client.cookies.set("joymap_login", login)
        yield client


def test_the_download_is_the_export_and_is_in_the_audit_trail(client: TestClient) -> None:
    database = client.app.state.service.database  # type: ignore[attr-defined]
    with database.write() as db:
        study_id = make_whole_study(db)
    sent = client.get(f"/api/v1/studies/{study_id}/export?format=zip")
    assert sent.status_code == 200
    assert sent.headers["content-type"] == "application/zip"
    assert sent.headers["content-disposition"] == (
        f'attachment; filename="joymap-{study_id.split("-")[0]}.zip"'
    )
    export = zipfile.ZipFile(io.BytesIO(sent.content))
    assert export.testzip() is None
    assert len(lines_of(export, "samples")) == 6 * TICKS
    kept = client.get(f"/api/v1/studies/{study_id}/export?with_excluded=false&with_lerobot=false")
    export = zipfile.ZipFile(io.BytesIO(kept.content))
    assert len(lines_of(export, "participants")) == 3
    assert "lerobot" not in str(export.namelist())
    with database.read() as db:
        noted = [row for row in db.query(AuditRow) if row.action == "study.export"]
        assert [row.subject for row in noted] == [study_id] * 2
        assert json.loads(json.dumps(noted[1].detail)) == {"with_excluded": False}


def test_a_download_of_nothing_is_refused_and_not_noted(client: TestClient) -> None:
    assert client.get("/api/v1/studies/none/export").status_code == 404
    assert client.get("/api/v1/studies/demo/export?format=rar").status_code == 422
    with client.app.state.service.database.read() as db:  # type: ignore[attr-defined]
        assert not [row for row in db.query(AuditRow) if row.action == "study.export"]


def test_a_download_that_fails_is_broken_off(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(RuntimeError, match="ended with 1"):
        client.get("/api/v1/studies/demo/export")


ENDLESS = [sys.executable, "-c", "while True: print('.' * 100_000)"]


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The programs that were started."""
    started: list[Any] = []
    start = asyncio.create_subprocess_exec

    async def watched(*command: str, **options: Any) -> Any:
        started.append(await start(*command, **options))
        return started[-1]

    monkeypatch.setattr(asyncio, "create_subprocess_exec", watched)
    monkeypatch.setattr(commands, "joymap", tuple)
    return started


def test_an_export_ends_with_whoever_takes_it(begun: list[Any]) -> None:
    async def take_one_block() -> None:
        sent = routers_exports._output(ENDLESS, Settings())
        assert await anext(sent)
        assert os.getpriority(os.PRIO_PROCESS, begun[0].pid) > os.getpriority(os.PRIO_PROCESS, 0)
        await sent.aclose()

    asyncio.run(take_one_block())
    assert begun[0].returncode == -signal.SIGKILL


def test_an_export_does_not_wait_for_ever_for_a_browser_that_takes_nothing(
    begun: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(routers_exports, "_PATIENCE_S", 0.1)

    async def take_slowly() -> None:
        sent = routers_exports._output(ENDLESS, Settings())
        assert await anext(sent)
        await asyncio.sleep(1.0)
        with pytest.raises(RuntimeError, match="-9"):
            async for _ in sent:
                pass

    asyncio.run(take_slowly())
    assert begun[0].returncode == -signal.SIGKILL


def test_what_is_on_stdout_is_nothing_but_the_zip(study_id: str, tmp_path: Path) -> None:
    made = subprocess.run(
        [sys.executable, "-m", "app.cli", "export", "--out", "-", "--", study_id],
        cwd=ROOT,
        env=os.environ | {"JOYMAP_DATA_DIR": str(tmp_path)},
        capture_output=True,
        check=True,
    )
    assert made.stderr == b""
    assert made.stdout.startswith(b"PK")
    assert zipfile.ZipFile(io.BytesIO(made.stdout)).testzip() is None
