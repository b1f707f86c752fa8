"""What is too large, too old or too late for the database is never an error of the server's."""

import sqlite3
import uuid
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.services import enrolment, flow, protocols
from app.storage.tables import AnswerRow, ParticipantRow
from tests.app.routers.conftest import database_of
from tests.app.routers.test_study_visit import Visitor


@pytest.mark.parametrize("number", ["99999999999999999999", str(2**63), "9" * 5000])
@pytest.mark.parametrize("address", ["studies/demo/participants?after=", "audit?before="])
def test_a_number_that_no_row_can_have_is_refused(
    office: TestClient, address: str, number: str
) -> None:
    assert office.get(f"/api/v1/{address}{number}").status_code == 422
    assert office.get(f"/api/v1/{address}{2**63 - 1}").status_code == 200


@pytest.mark.parametrize("path", ["/health", "/", "/login", "/dashboard", "/api/v1/studies"])
def test_a_head_is_answered_like_a_get_without_the_body(office: TestClient, path: str) -> None:
    got, head = office.get(path), office.head(path)
    assert (head.status_code, head.content) == (got.status_code, b"")
    assert head.headers["content-type"] == got.headers["content-type"]
    assert office.head("/nowhere").status_code == 404


def asked(office: TestClient) -> tuple[TestClient, str, list[str]]:
    """Somebody at the demo's questions: their page, its address and the questions' ids."""
    token = enrolment.new_token()
    with database_of(office).write() as db:
        demo = protocols.demo(db, office.app.state.service.settings)  # type: ignore[attr-defined]
        enrolment.enrol(db, demo, token, participant_id=str(uuid.uuid4()), origin="experimenter")
    page, address = TestClient(office.app), f"/p/{token}/api"
    version = page.get(f"{address}/session").json()["consent"]["version"]
    page.post(f"{address}/consent", json={"id": str(uuid.uuid4()), "version": version})
    shown = page.post(f"{address}/practice", json={"id": str(uuid.uuid4())}).json()["queries"]
    return page, address, [query["id"] for query in shown]


def answer(query_id: str, **changes: Any) -> dict[str, Any]:
    given = {"id": str(uuid.uuid4()), "query_id": query_id, "h": [0.5, 0.5]}
    return given | {"thinking_time_s": 2.0} | changes


@pytest.mark.parametrize("days", [1.1, 30.0, 1e6])
def test_a_tab_that_was_open_for_days_answers_and_its_time_is_cut_off(
    office: TestClient, days: float
) -> None:
    page, address, queries = asked(office)
    given = answer(queries[0], thinking_time_s=86_400.0 * days)
    assert page.post(f"{address}/answers", json=given).status_code == 201
    with database_of(office).read() as db:
        kept = db.query(AnswerRow).filter_by(id=given["id"]).one()
        assert kept.thinking_time_s == 86_400.0


def test_while_another_program_holds_the_database_one_is_told_to_try_again(
    office: TestClient,
) -> None:
    page, address, queries = asked(office)
    given = answer(queries[0])
    database = office.app.state.service.settings.database_path  # type: ignore[attr-defined]
    with sqlite3.connect(database) as other:
        other.execute("BEGIN IMMEDIATE")
        refused = page.post(f"{address}/answers", json=given)
        other.rollback()
    other.close()
    assert refused.status_code == 503
    assert int(refused.headers["retry-after"]) > 0
    assert "held by another program" in refused.json()["error"]["sentence"]
    assert page.post(f"{address}/answers", json=given).status_code == 201


CLOCKS = ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-12:00", "1969-01-01T00:00:00Z"]


@pytest.mark.parametrize("at", CLOCKS)
def test_whatever_a_pages_clock_says_its_questionnaire_is_kept(office: TestClient, at: str) -> None:
    study_id = str(uuid.uuid4())
    made: dict[str, Any] = {
        "title": "T",
        "tasks": [{"task": "avoid", "labels": 5, "unlabelled": 100}],
    }
    made |= {"strategies": ["no-align"], "questionnaires": {"after_each_strategy": ["comments"]}}
    office.post("/api/v1/studies", json={"id": study_id, "protocol": made}).raise_for_status()
    visitor = Visitor(office, study_id)
    with database_of(office).write() as db:
        row = db.get_one(ParticipantRow, visitor.id)
        steps = flow.here(db, row).steps
        row.place = next(index for index, step in enumerate(steps) if step.kind == "questions")
    session = visitor.session()
    said = [{"item": "comments", "value": "Fine.", "answered_at": at}]
    sent = visitor.post("questions", key=session["key"], responses=said)
    assert sent.status_code == 200, sent.text
