"""What today's code makes of the old things, by its own doors: commands, files, HTTP, sockets."""

import contextlib
import gzip
import io
import json
import os
import sqlite3
import time
import uuid
import zipfile
from collections.abc import Generator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest import mock

import httpx
from websockets.sync.client import connect

from app.analysis.simulation_journal import origin
from app.cli import main
from models.panda_pack import default_folder
from tests.frozen import made
from tests.frozen.learning import GRID
from tests.running_server import Participant, RunningServer, running_server

_LIMIT_S = 60.0


@dataclass(frozen=True)
class Command:
    """How a command went."""

    code: int
    out: str
    err: str


def joymap(*words: str, **environment: str) -> Command:
    """Run a command in this process, which takes no second to load what it needs."""
    out, err = io.StringIO(), io.StringIO()
    settings = {"JOYMAP_PANDA_DIR": str(default_folder())} | environment
    with (
        mock.patch.dict(os.environ, settings),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            code = main(list(words))
        except SystemExit as ended:  # as argparse ends what asks for help
            code = int(ended.code or 0)
    return Command(code, out.getvalue(), err.getvalue())


def unpack_data(folder: Path) -> Path:
    """A copy of the folder that the old server left.

    Who stopped half-way did so just now: after a year they would be gone for good.
    """
    with zipfile.ZipFile(made.DATA) as archive:
        archive.extractall(folder)
    with contextlib.closing(sqlite3.connect(folder / "joymap.db")) as db, db:
        now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")
        db.execute("UPDATE participant SET seen_at = ? WHERE state = 'active'", (now,))
    return folder


def migrate(data_dir: Path) -> Command:
    """Bring the database up to date."""
    return joymap("migrate", JOYMAP_DATA_DIR=str(data_dir))


def export(data_dir: Path, study: str, out: Path) -> Command:
    """Export a study of a database."""
    rate = {"JOYMAP_TELEOP_RATE_HZ": str(made.RATE_HZ)}
    return joymap("export", study, "--out", str(out), JOYMAP_DATA_DIR=str(data_dir), **rate)


def draw_figures(out: Path) -> Command:
    """Of the old export."""
    return joymap("figures", str(made.EXPORT), "--out", str(out))


def go_on_simulating(folder: Path) -> Command:
    """The old run's command once more, on a copy of its journal.

    Rows that other code made are refused, whatever they say; here the code is taken to be the same,
    and it is shown elsewhere that it makes the same rows.
    """
    folder.mkdir()
    lines = [json.loads(line) for line in (made.SIMULATION / "rows.jsonl").open()]
    stamped = [json.dumps(line | {"origin": origin()}) + "\n" for line in lines]
    (folder / "rows.jsonl").write_text("".join(stamped))
    options = [word for option in GRID.items() for word in option]
    return joymap("simulate", *options, "--out", str(folder), "--json", str(folder / "all.json"))


def old_answers() -> dict[str, Any]:
    """What the old server answered: ``study``, ``api`` by address, ``sessions`` by participant."""
    content: dict[str, Any] = json.loads(gzip.decompress(made.ANSWERS.read_bytes()))
    return content


def half_way(old: dict[str, Any]) -> str:
    """The participant who stopped before a drive."""
    (found,) = [each for each, page in old["sessions"].items() if page["step"] == "block"]
    return str(found)


class TodaysServer:
    """A server on the old data, and its owner."""

    def __init__(self, server: RunningServer) -> None:
        self.server = server
        self.office = httpx.Client(base_url=f"{server.base_url}/api/v1/", timeout=20.0)
        self.office.post("login", json=made.OWNER).raise_for_status()

    def get(self, address: str) -> Any:
        return self.office.get(address).raise_for_status().json()

    def visit(self, participant: str) -> Participant:
        """A participant's page, by a new link."""
        made_link = self.office.post(f"participants/{participant}/link").raise_for_status()
        return Participant(made_link.json()["link"])

    def drive(self, person: Participant) -> list[dict[str, Any]]:
        """Begin an attempt, push, and give it up; all that the page was told meanwhile."""
        drive_id = str(uuid.uuid4())
        address = person.link.replace("http", "ws", 1)
        told: list[dict[str, Any]] = []
        with connect(f"{address}/live?tab=t") as socket:
            person.post("drives", id=drive_id).raise_for_status()
            until_s, sequence = time.monotonic() + _LIMIT_S, 0
            while time.monotonic() < until_s:
                told.append(json.loads(socket.recv(timeout=_LIMIT_S)))
                if told[-1]["type"] != "status" or told[-1]["drive_id"] != drive_id:
                    continue
                if told[-1]["progress"]["end"] is not None:
                    return told
                if sequence > 5:
                    socket.send(json.dumps({"type": "give-up"}))
                push = {"type": "stick", "seq": sequence, "x": 0.6, "y": 0.6, "sent_ms": 0.0}
                socket.send(json.dumps(push))
                sequence += 1
        raise AssertionError(f"the attempt did not end; the last was {told[-1]}")

    def replay(self, drive_id: str) -> dict[str, Any]:
        """What the page of a replay is told first."""
        address = f"{self.server.base_url.replace('http', 'ws', 1)}/drives/{drive_id}/v/control"
        cookies = "; ".join(f"{name}={value}" for name, value in self.office.cookies.items())
        with connect(address, additional_headers={"Cookie": cookies}) as socket:
            socket.send(json.dumps({"type": "play"}))
            told: dict[str, Any] = json.loads(socket.recv(timeout=_LIMIT_S))
            return told


@contextlib.contextmanager
def todays_server(data_dir: Path) -> Generator[TodaysServer]:
    with running_server(data_dir, teleop_rate_hz=made.RATE_HZ) as server:
        yield TodaysServer(server)
