"""Watching: whose arms are live, a look at one of them, and what is being learned."""

import time
import uuid
from datetime import timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.scene.server import SUBPROTOCOL
from app.services import enrolment
from app.storage.tables import JobRow
from tests.app.factories import enrol, make_study, now
from tests.app.routers.conftest import database_of
from tests.patience import PATIENCE_S


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


def test_trainings_go_page_by_page_newest_first(office: TestClient) -> None:
    with database_of(office).write() as db:
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
        page = office.get("/api/v1/jobs", params=asked).json()
        found += page["jobs"]
        after = page["next"]
        if after is None:
            break
    assert [each["id"] for each in found[:2]] == [ids[4], ids[3]]
    assert {each["id"] for each in found[2:4]} == {ids[1], ids[2]}
    assert [each["id"] for each in found[4:]] == [ids[0]]
    assert (found[0]["label"], found[0]["task"]) == (label, "pour-cup")
    failed = office.get("/api/v1/jobs?state=failed").json()["jobs"]
    assert {each["id"] for each in failed} == set(ids[:4])
    assert office.get("/api/v1/jobs?state=lost").status_code == 422
    missing = office.get("/api/v1/jobs?after=none")
    assert (missing.status_code, missing.json()["error"]["kind"]) == (404, "no-such-job")


def test_unchanged_trainings_are_not_sent_again(office: TestClient) -> None:
    first = office.get("/api/v1/jobs")
    again = office.get("/api/v1/jobs", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_who_is_live_can_be_looked_at_until_they_leave(office: TestClient) -> None:
    token = enrolment.new_token()
    with database_of(office).write() as db:
        study = make_study(db)
        person = enrolment.enrol(
            db, study, token, participant_id=str(uuid.uuid4()), origin="experimenter"
        )
        person_id, study_id = person.id, person.study_id
    look = f"/participants/{person_id}/live/scene"
    assert office.get("/api/v1/live").json() == {"sessions": []}
    with (
        pytest.raises(WebSocketDisconnect),
        office.websocket_connect(look, subprotocols=[SUBPROTOCOL]),
    ):
        pass
    with office.websocket_connect(f"/p/{token}/live?tab=a") as page:
        page.receive_json()
        (line,) = office.get("/api/v1/live").json()["sessions"]
        assert (line["participant_id"], line["study_id"]) == (person_id, study_id)
        assert (line["is_connected"], line["mode"]) == (True, "idle")
        assert line["step"]["kind"] == "consent"
        with office.websocket_connect(look, subprotocols=[SUBPROTOCOL]) as watched:
            assert len(watched.receive_bytes()) > 0
            session = office.app.state.service.live.existing(person_id)  # type: ignore[attr-defined]
            assert session.pages == 1, "who only watches is no page"
            page.close()
            limit_s = time.monotonic() + PATIENCE_S
            with pytest.raises(WebSocketDisconnect):
                while time.monotonic() < limit_s:
                    watched.receive_bytes()
    (line,) = office.get("/api/v1/live").json()["sessions"]
    assert line["is_connected"] is False
