"""A real server in a process of its own, as ``make run`` starts it, and a participant's side."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Generator
from pathlib import Path
from typing import Any

import httpx
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database import make_engine
from models.panda_pack import default_folder
from tests.patience import PATIENCE_S


def children_of(pid: int) -> list[int]:
    """The processes that a process has started."""
    command = ["ps", "-o", "pid=", "--ppid", str(pid)]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    return [int(child) for child in found.stdout.split()]


def descendants_of(pid: int) -> list[int]:
    """The processes that a process has started, and those that they have."""
    return [each for child in children_of(pid) for each in (child, *descendants_of(child))]


class RunningServer:
    """``joymap serve`` on a port of its own; ``kill`` is ``kill -9``."""

    def __init__(self, data_dir: Path, port: int = 0, **settings: Any) -> None:
        environment = os.environ | {
            "JOYMAP_DATA_DIR": str(data_dir),
            "JOYMAP_PANDA_DIR": str(default_folder()),
            **{f"JOYMAP_{name.upper()}": str(value) for name, value in settings.items()},
        }
        self._experimenter: httpx.Client | None = None
        self.owner: str | None = None  # who has used the printed link, in a browser
        self.data_dir, self.log_path = data_dir, data_dir / "server.log"
        data_dir.mkdir(parents=True, exist_ok=True)
        with self.log_path.open("ab") as log:
            begin = log.tell()
            self.process = subprocess.Popen(
                [sys.executable, "-m", "app.cli", "serve", "--port", str(port)],
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        deadline = time.monotonic() + PATIENCE_S
        links: dict[str, str] = {}
        while len(links) < 2:
            text = self.log_path.read_bytes()[begin:].decode()
            links = dict(re.findall(r"^  (participant|experimenter) +(\S+)", text, re.MULTILINE))
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"The server did not start:\n{text}")
            time.sleep(0.02)
        self.participant_link = links["participant"]
        self.experimenter_link = links["experimenter"]
        self.base_url = self.participant_link.split("/p/")[0]

    @property
    def port(self) -> int:
        return int(self.base_url.rsplit(":", 1)[1])

    def children(self) -> list[int]:
        """The worker processes, and what starts them."""
        return descendants_of(self.process.pid)

    def log(self) -> str:
        return self.log_path.read_text()

    def rows(self, table: Any) -> list[Any]:
        """What the database holds, read beside the server."""
        engine = make_engine(self.data_dir / "joymap.db")
        with Session(engine) as db:
            found = list(db.scalars(select(table)))
        engine.dispose()
        return found

    def experimenter(self) -> httpx.Client:
        """An owner's programs; if nobody has used the printed link, it makes the account."""
        if self._experimenter is None:
            self._experimenter = httpx.Client(base_url=self.base_url, timeout=PATIENCE_S)
            who = {"name": self.owner or "owner", "password": "correct horse"}
            door = self.experimenter_link if self.owner is None else "/api/v1/login"
            self._experimenter.post(door, json=who).raise_for_status()
        return self._experimenter

    def participant_links(self, count: int) -> list[str]:
        """The printed link, and as many more as it takes."""
        return [self.participant_link, *(self.new_links(count - 1) if count > 1 else [])]

    def new_links(self, count: int = 1) -> list[str]:
        """Links of new participants, made by the experimenter."""
        wanted = {"id": str(uuid.uuid4()), "count": count}
        made = self.experimenter().post("/api/v1/studies/demo/participants", json=wanted)
        return [line["link"] for line in made.raise_for_status().json()["participants"]]

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def stop(self) -> int:
        """Stop as Ctrl+C does; the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                return self.process.wait(timeout=15)
            self.process.kill()
        return self.process.wait()


@contextlib.contextmanager
def running_server(data_dir: Path, **settings: Any) -> Generator[RunningServer]:
    server = RunningServer(data_dir, **settings)
    try:
        yield server
    finally:
        server.stop()


class Participant:
    """A participant's side of the API, by their link."""

    def __init__(self, link: str) -> None:
        self.link = link
        self.http = httpx.Client(
            base_url=f"{link}/api/",
            timeout=PATIENCE_S,
            headers={"Content-Type": "application/json"},
        )

    def session(self) -> dict[str, Any]:
        session: dict[str, Any] = self.http.get("session").raise_for_status().json()
        return session

    def post(self, path: str, **body: Any) -> httpx.Response:
        return self.http.post(path, content=json.dumps({"id": str(uuid.uuid4())} | body))

    def begin(self) -> dict[str, Any]:
        """Consent and practice, up to the questions."""
        consent = self.session()["consent"]
        self.post("consent", version=consent["version"]).raise_for_status()
        session: dict[str, Any] = self.post("practice").raise_for_status().json()
        return session

    def answer(self, query_id: str, h: Any, **body: Any) -> httpx.Response:
        return self.post("answers", query_id=query_id, h=h, thinking_time_s=1.0, **body)

    def wait_for_training(self, limit_s: float = PATIENCE_S) -> dict[str, Any]:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            status: dict[str, Any] = self.http.get("training").raise_for_status().json()
            if status["state"] in ("succeeded", "failed"):
                return status
            time.sleep(0.01)
        raise AssertionError(f"The training did not end: {status['state']}")
