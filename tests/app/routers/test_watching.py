"""Watching: whose arms are live, a look at one of them, and what is being learned."""

import time
import uuid
from collections.abc import Generator
from datetime import timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.main import create_app
from app.scene.server import SUBPROTOCOL
from app.services import accounts, enrolment
from app.settings import Settings
from app.storage.database import Database, migrate
from app.storage.tables import JobRow
from models.panda_pack import default_folder
from tests.app.factories import enrol, make_study, now


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        with database_of(client).write() as db:
            login = accounts.sign_up(db, accounts.new_setup_link(db), "somebody", "not a hash")
        client.cookies.set("joymap_login", login)
        yield client


def database_of(client: TestClient) -> Database:
    return client.app.state.service.database  # type: ignore[attr-defined,no-any-return]


def job(participant_id: str, task: str, state: str, ago_s: float) -> JobRow:
    return JobRow(
        id=str(uuid.uuid4()),
        participant_id=participant_id,
        task=task,
        state=state,
        attempt=1,
        data_hash=uuid.uuid4().hex,
        seed=0,
        report={},
        fraction=0.5,
        error=None,
        training_s=None,
        queued_at=now() - timedelta(seconds=ago_s),
        ended_at=None,
    )


def test_trainings_go_page_by_page_newest_first(client: TestClient) -> None:
    with database_of(client).write() as db:
        person = enrol(db, make_study(db))
        # Two were asked for in the same moment: each is seen once, whatever their order.
        jobs = [job(person.id, "avoid", "failed", ago_s) for ago_s in (50, 40, 40, 20)]
        jobs.append(job(person.id, "pour-cup", "succeeded", 10))
        for each in jobs[2:3]:
            each.queued_at = jobs[1].queued_at
        db.add_all(jobs)
        ids = [each.id for each in jobs]
        label = enrolment.label_of(person)
    found: list[dict[str, Any]] = []
    after = None
    while True:
        asked = {"limit": 2} | ({} if after is None else {"after": after})
        page = client.get("/api/v1/jobs", params=asked).json()
        found += page["jobs"]
        after = page["next"]
        if after is None:
            break
    assert [each["id"] for each in found[:2]] == [ids[4], ids[3]]
    assert {each["id"] for each in found[2:4]} == {ids[1], ids[2]}
    assert [each["id"] for each in found[4:]] == [ids[0]]
    assert (found[0]["label"], found[0]["task"]) == (label, "pour-cup")
    failed = client.get("/api/v1/jobs?state=failed").json()["jobs"]
    assert {each["id"] for each in failed} == set(ids[:4])
    assert client.get("/api/v1/jobs?state=lost").status_code == 422
    missing = client.get("/api/v1/jobs?after=none")
    assert (missing.status_code, missing.json()["error"]["kind"]) == (404, "no-such-job")


def test_unchanged_trainings_are_not_sent_again(client: TestClient) -> None:
    first = client.get("/api/v1/jobs")
    again = client.get("/api/v1/jobs", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_who_is_live_can_be_looked_at_until_they_leave(client: TestClient) -> None:
    token = enrolment.new_token()
    with database_of(client).write() as db:
        study = make_study(db)
        person = enrolment.enrol(
            db, study, token, participant_id=str(uuid.uuid4()), origin="experimenter"
        )
        person_id, study_id = person.id, person.study_id
    look = f"/participants/{person_id}/live/scene"
    assert client.get("/api/v1/live").json() == {"sessions": []}
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect(look, subprotocols=[SUBPROTOCOL]),
    ):
        pass
    with client.websocket_connect(f"/p/{token}/live?tab=a") as page:
        page.receive_json()
        (line,) = client.get("/api/v1/live").json()["sessions"]
        assert (line["participant_id"], line["study_id"]) == (person_id, study_id)
        assert (line["is_connected"], line["mode"]) == (True, "idle")
        assert line["step"]["kind"] == "consent"
        with client.websocket_connect(look, subprotocols=[SUBPROTOCOL]) as watched:
            assert len(watched.receive_bytes()) > 0
            session = client.app.state.service.live.existing(person_id)  # type: ignore[attr-defined]
            assert session.pages == 1, "who only watches is no page"
            page.close()
            limit_s = time.monotonic() + 10.0
            with pytest.raises(WebSocketDisconnect):
                while time.monotonic() < limit_s:
                    watched.receive_bytes()
    (line,) = client.get("/api/v1/live").json()["sessions"]
    assert line["is_connected"] is False
