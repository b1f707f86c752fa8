"""A whole study as a participant's page sees it: step by step, blind, nothing asked twice."""

import json
import time
import uuid
from collections.abc import Generator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.schemas.protocol import LEARNABLE, NO_ALIGN
from app.services import enrolment
from app.settings import Settings
from app.storage.database import migrate
from app.storage.tables import (
    AnswerRow,
    DriveRow,
    EventRow,
    JobRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
    SampleChunkRow,
    StudyRow,
)
from models.panda_pack import default_folder
from tests.app.factories import SMALL, make_study
from tests.patience import PATIENCE_S

PROTOCOL: dict[str, Any] = {
    "tasks": [
        {"task": "avoid", "labels": 5, "repeats": 2, "unlabelled": 100},
        {"task": "pour-cup", "labels": 5, "unlabelled": 100},
    ],
    "strategies": [NO_ALIGN, "no-priors"],
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder(), training_steps=20
    )
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


class Visitor:
    """A participant of a study; keeps all that their page was sent."""

    def __init__(self, client: TestClient, study_id: str) -> None:
        self.client, self.heard = client, ""
        self.token, self.id = enrolment.new_token(), str(uuid.uuid4())
        with client.app.state.service.database.write() as db:  # type: ignore[attr-defined]
            study = db.get_one(StudyRow, study_id)
            enrolment.enrol(db, study, self.token, participant_id=self.id, origin="experimenter")

    def session(self) -> dict[str, Any]:
        return self._keep(self.client.get(f"/p/{self.token}/api/session"))

    def post(self, path: str, **body: Any) -> Any:
        return self.client.post(
            f"/p/{self.token}/api/{path}",
            content=json.dumps({"id": str(uuid.uuid4())} | body),
            headers={"Content-Type": "application/json"},
        )

    def go(self, path: str, **body: Any) -> dict[str, Any]:
        response = self.post(path, **body)
        assert response.status_code in (200, 201), response.text
        return self._keep(response)

    def rows(self, table: Any) -> list[Any]:
        with self.client.app.state.service.database.read() as db:  # type: ignore[attr-defined]
            rows = list(db.query(table).filter(table.participant_id == self.id))
            db.expunge_all()
            return rows

    def answer_everything(self) -> dict[str, Any]:
        session = self.session()
        while session["step"] == "queries":
            query = next(each for each in session["queries"] if each["answer"] is None)
            session = self.go("answers", query_id=query["id"], h=[0.3, 0.4], thinking_time_s=1.0)
        return session

    def learn(self) -> dict[str, Any]:
        limit_s = time.monotonic() + PATIENCE_S
        while self._keep(self.client.get(f"/p/{self.token}/api/training"))["state"] != "succeeded":
            assert time.monotonic() < limit_s
            time.sleep(0.05)
        return self.go("driving")

    def drive(self) -> dict[str, Any]:
        """One attempt, given up at once."""
        with self.client.websocket_connect(f"/p/{self.token}/live?tab=t") as socket:
            drive_id = self.go("drives")["id"]
            socket.send_json({"type": "give-up"})
            while True:
                text = socket.receive_text()
                self.heard += text
                status = json.loads(text)
                progress = status.get("progress")
                if status.get("drive_id") == drive_id and progress and progress["end"]:
                    break
        limit_s = time.monotonic() + PATIENCE_S
        while True:
            session = self.session()
            if session["block"]["may_continue"] or time.monotonic() > limit_s:
                return session
            time.sleep(0.05)

    def fill_in(self, session: dict[str, Any]) -> dict[str, Any]:
        items = session["questions"]["questionnaire"]["items"]
        values = {"scale": 4, "text": "well", "strategy": 2}
        given = [
            {
                "item": item["key"],
                "value": values[item["kind"]],
                "answered_at": "2026-11-24T01:00:00Z",
            }
            for item in items
        ]
        return self.go("questions", key=session["key"], responses=given)

    def _keep(self, response: Any) -> dict[str, Any]:
        self.heard += response.text
        found: dict[str, Any] = response.json()
        return found


@pytest.fixture(scope="module")
def study_id(client: TestClient) -> str:
    with client.app.state.service.database.write() as db:  # type: ignore[attr-defined]
        return make_study(db, **PROTOCOL).id


def test_a_page_is_told_its_tasks_name_and_what_stands_on_the_table(
    client: TestClient, study_id: str
) -> None:
    visitor = Visitor(client, study_id)
    session = visitor.session()
    assert (session["task"], session["task_name"], session["props"]) == (None, None, None)
    visitor.go("consent", version=session["consent"]["version"])
    session = visitor.go("practice")
    assert (session["task"], session["task_name"]) == ("Go round", "avoid")
    assert session["props"] == {
        "obstacle": {"position": [0.5, 0.0], "radius_m": 0.045, "height_m": 0.15},
        "bowls": [],
        "cup": None,
    }


def test_a_study_from_consent_to_the_last_page(client: TestClient, study_id: str) -> None:
    visitor = Visitor(client, study_id)
    session = visitor.session()
    assert (session["step"], session["study"]) == ("consent", SMALL["title"])
    assert "<p>" in session["consent"]["html"]
    visitor.go("consent", version=session["consent"]["version"])
    session = visitor.go("practice")
    passed = []
    while session["step"] != "end":
        passed.append(session["key"])
        match session["step"]:
            case "queries":
                session = visitor.answer_everything()
            case "training":
                session = visitor.learn()
            case "block":
                assert not session["block"]["may_continue"]
                assert visitor.post("block", key=session["key"]).status_code == 409
                session = visitor.drive()
                session = visitor.go("block", key=session["key"])
            case "questions":
                session = visitor.fill_in(session)
    assert len(passed) == len(set(passed)) == 2 * (2 + 2 + 2 + 1)
    assert session["end"] == {
        "message": "Thank you! You have done everything.",
        "code": "C0DE",
        "url": "https://example.org/done?cc=C0DE",
        "left": None,
    }
    assert session["state"] == "completed"
    assert len(visitor.rows(JobRow)) == 2
    assert len(visitor.rows(AnswerRow)) == 5 + 2 + 5
    repeated = [query for query in visitor.rows(QueryRow) if query.repeats is not None]
    assert len(repeated) == 2
    drives = visitor.rows(DriveRow)
    assert [drive.end for drive in drives] == ["given up"] * 4
    driven = {(drive.task, drive.strategy) for drive in drives}
    strategies = PROTOCOL["strategies"]
    assert driven == {(task, name) for task in ("avoid", "pour-cup") for name in strategies}
    assert len(visitor.rows(ResponseRow)) == 2 * (2 * 6 + 2)
    for name in (NO_ALIGN, *LEARNABLE):
        assert name not in visitor.heard
    assert visitor.post("drives").status_code == 409


def test_who_withdraws_may_have_everything_erased(client: TestClient, study_id: str) -> None:
    visitor = Visitor(client, study_id)
    visitor.go("consent", version=visitor.session()["consent"]["version"])
    visitor.go("practice")
    visitor.answer_everything()
    visitor.learn()
    visitor.drive()
    canary = visitor.rows(DriveRow)[0].id.encode()
    data_dir = client.app.state.service.settings.data_dir  # type: ignore[attr-defined]
    held = b"".join(path.read_bytes() for path in data_dir.glob("joymap.db*"))
    assert canary in held
    session = visitor.go("withdraw", erase=True)
    assert (session["state"], session["step"]) == ("withdrawn", "end")
    assert (session["end"]["code"], session["end"]["left"]) == (None, "erased")
    for table in (AnswerRow, QueryRow, DriveRow, JobRow, EventRow):
        assert visitor.rows(table) == []
    held = b"".join(path.read_bytes() for path in data_dir.glob("joymap.db*"))
    assert canary not in held
    with client.app.state.service.database.read() as db:  # type: ignore[attr-defined]
        assert (
            db.query(SampleChunkRow).filter(SampleChunkRow.drive_id == canary.decode()).count() == 0
        )
        row = db.get_one(ParticipantRow, visitor.id)
        assert (row.state, row.seed, row.stick) == ("withdrawn", 0, None)
    for path in ("drives", "driving", "practice"):
        assert visitor.post(path).status_code == 409


def test_who_withdraws_may_leave_what_they_gave(client: TestClient, study_id: str) -> None:
    visitor = Visitor(client, study_id)
    visitor.go("consent", version=visitor.session()["consent"]["version"])
    visitor.go("practice")
    visitor.answer_everything()
    event_id = str(uuid.uuid4())
    for _ in range(2):
        left = visitor.go("withdraw", id=event_id, erase=False)
        assert (left["state"], left["end"]["left"]) == ("withdrawn", "kept")
    assert len(visitor.rows(AnswerRow)) == 7
    assert [event.kind for event in visitor.rows(EventRow)].count("withdraw") == 1
    assert visitor.go("withdraw", erase=True)["end"]["left"] == "erased"
    assert visitor.rows(AnswerRow) == []


def test_by_the_shared_link_one_joins(client: TestClient, study_id: str) -> None:
    link = enrolment.new_token()
    with client.app.state.service.database.write() as db:  # type: ignore[attr-defined]
        db.get_one(StudyRow, study_id).link_hash = enrolment.hash_of(link)
    assert client.get(f"/join/{link}/study").json() == {"title": SMALL["title"], "is_open": True}
    made = client.post(f"/join/{link}", json={"external_id": "5f3c"})
    assert made.status_code == 201
    path = made.json()["link"].split("/p/")[1]
    assert client.get(f"/p/{path}/api/session").json()["step"] == "consent"
    assert client.post("/join/guessed", json={}).status_code == 404
    assert client.post(f"/join/{link}", json={"external_id": 7}).status_code == 422
