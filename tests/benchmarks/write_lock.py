"""For how long nobody else can write, when many people come to their questions at once."""

import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from fastapi.testclient import TestClient
from rich.progress import track
from sqlalchemy.orm import Session

from app.main import create_app
from app.services import enrolment
from app.settings import Settings
from app.storage.database import Database, migrate
from models.panda_pack import default_folder
from tests.app.factories import make_study

PEOPLE = 20
ANSWERS = 6
TASK: dict[str, Any] = {"task": "fetch-and-pour", "labels": 30, "unlabelled": 2000}
# As soon as that many are there, each answer to a designed question is judged.
JUDGED = {"questions": "designed", "labels": 12, "enough_error": 0.001}

Row = tuple[str, str, str, str]
Hold = tuple[float, float]


def rows() -> Iterator[Row]:
    """What, median, worst, aim: each as a time and, in brackets, what of it the CPU worked."""
    for name, task in (("random", TASK), ("designed", TASK | JUDGED)):
        for what, holds in holds_of(task).items():
            wall_ms, cpu_ms = 1000 * np.array(holds).T
            yield (
                f"{PEOPLE} people at once, {name} questions, {what}: the write lock is held",
                f"{np.median(wall_ms):.1f} ms (CPU {np.median(cpu_ms):.1f})",
                f"{wall_ms.max():.1f} ms (CPU {cpu_ms.max():.1f})",
                "≤ 50 ms",
            )


def holds_of(task: dict[str, Any]) -> dict[str, list[Hold]]:
    """How long each transaction held the lock, from its begin to its end: time and CPU, in [s]."""
    held: list[Hold] = []
    with tempfile.TemporaryDirectory() as folder, _watched(held):
        settings = Settings(data_dir=Path(folder), panda_dir=default_folder(), training_workers=1)
        migrate(settings.database_path)
        with TestClient(create_app(settings)) as client:
            tokens = _enrol(client, task)
            people = [_Person(client, token) for token in tokens]
            found = {}
            for what, act in (("they agree", _Person.agree), ("they answer", _Person.answer)):
                held.clear()
                _at_once([partial(act, person) for person in people])
                found[what] = list(held)
    return found


def _enrol(client: TestClient, task: dict[str, Any]) -> list[str]:
    tokens = [enrolment.new_token() for _ in range(PEOPLE)]
    with client.app.state.service.database.write() as db:  # type: ignore[attr-defined]
        study = make_study(db, tasks=[task], practice_s=0.0, questionnaires={})
        for token in tokens:
            enrolment.enrol(db, study, token, participant_id=str(uuid.uuid4()), origin="link")
    return tokens


class _Person:
    """A participant's page."""

    def __init__(self, client: TestClient, token: str) -> None:
        self._client, self._address = client, f"/p/{token}/api"
        self._version = client.get(f"{self._address}/session").json()["consent"]["version"]
        self._asked: list[str] = []

    def agree(self) -> None:
        self._asked = [each["id"] for each in self._post("consent", version=self._version)]

    def answer(self) -> None:
        for index, query_id in enumerate(self._asked[:ANSWERS]):
            h = [float(np.cos(2.4 * index)), float(np.sin(2.4 * index))]
            self._post("answers", query_id=query_id, h=h, thinking_time_s=1.0)

    def _post(self, path: str, **body: Any) -> list[dict[str, Any]]:
        sent = {"id": str(uuid.uuid4())} | body
        answered = self._client.post(f"{self._address}/{path}", json=sent)
        answered.raise_for_status()
        found: list[dict[str, Any]] = answered.json()["queries"]
        return found


@contextmanager
def _watched(held: list[Hold]) -> Generator[None]:
    """Note of each transaction for how long it holds the lock, its commit included."""
    write = Database.write

    @contextmanager
    def timed(database: Database) -> Generator[Session]:
        try:
            with write(database) as db:
                began = time.perf_counter(), time.thread_time()
                yield db
        finally:
            held.append((time.perf_counter() - began[0], time.thread_time() - began[1]))

    Database.write = timed  # type: ignore[assignment, method-assign]
    try:
        yield
    finally:
        Database.write = write  # type: ignore[method-assign]


def _at_once(calls: list[Callable[[], None]]) -> None:
    threads = [threading.Thread(target=call) for call in calls]
    for thread in track(threads, description="people"):
        thread.start()
    for thread in threads:
        thread.join()
