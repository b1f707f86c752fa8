"""Questionnaires: kept as given, once, whole, and only when they are asked."""

import uuid
from typing import Any

import pytest

from app.errors import WrongStep
from app.schemas.participants import QuestionnaireIn
from app.services import flow, responses
from app.services.responses import BadResponse
from app.storage.database import Database
from app.storage.tables import ResponseRow
from tests.app.factories import enrol, make_study, now

ITEMS: list[dict[str, Any]] = [
    {"key": "how", "kind": "scale", "text": "How?", "low": 0, "high": 100, "step": 5},
    {"key": "which", "kind": "choice", "text": "Which?", "choices": ["this", "that"]},
    {"key": "best", "kind": "strategy", "text": "Best?"},
    {"key": "why", "kind": "text", "text": "Why?"},
]
KEY = "questions/end/own"
GOOD: dict[str, Any] = {"how": 35, "which": "that", "best": 3, "why": "=1+1"}


def fill(values: dict[str, Any], key: str = KEY) -> QuestionnaireIn:
    given = [{"item": k, "value": v, "answered_at": now()} for k, v in values.items()]
    return QuestionnaireIn.model_validate({"id": uuid.uuid4(), "key": key, "responses": given})


def somebody_at_the_end(db: Any) -> Any:
    own = {"name": "own", "title": "Own", "items": ITEMS}
    asked = {"questionnaires": {"at_the_end": ["own"]}, "own_questionnaires": [own]}
    participant = enrol(db, make_study(db, **asked))
    participant.place = len(flow.here(db, participant).steps) - 2
    return participant


def test_answers_are_kept_as_given_and_once(database: Database) -> None:
    with database.write() as db:
        participant, given = somebody_at_the_end(db), fill(GOOD | {"why": None})
        assert responses.record(db, participant, flow.here(db, participant), given)
        assert not responses.record(db, participant, flow.here(db, participant), given)
        assert participant.state == "completed"
        kept = {row.item: row.value for row in db.query(ResponseRow)}
        assert kept == {"how": "35", "which": '"that"', "best": "3", "why": None}


@pytest.mark.parametrize(
    "wrong",
    [
        {"how": 36},
        {"how": 105},
        {"how": "35"},
        {"which": "neither"},
        {"which": 1},
        {"best": 4},
        {"best": 0},
        {"best": True},
        {"why": 5},
        {"extra": 1},
    ],
)
def test_what_an_item_does_not_allow_is_refused(database: Database, wrong: dict[str, Any]) -> None:
    with pytest.raises((BadResponse, ValueError)), database.write() as db:
        participant = somebody_at_the_end(db)
        responses.record(db, participant, flow.here(db, participant), fill(GOOD | wrong))
    with database.read() as db:
        assert db.query(ResponseRow).count() == 0


def test_an_item_cannot_be_skipped(database: Database) -> None:
    given = {key: value for key, value in GOOD.items() if key != "how"}
    with pytest.raises(BadResponse, match=r"How\?"), database.write() as db:
        participant = somebody_at_the_end(db)
        responses.record(db, participant, flow.here(db, participant), fill(given))


def test_a_questionnaire_is_answered_when_it_is_asked(database: Database) -> None:
    with database.write() as db:
        participant = somebody_at_the_end(db)
        participant.place -= 1
        with pytest.raises(WrongStep):
            responses.record(db, participant, flow.here(db, participant), fill(GOOD))
