"""Every protocol that is taken can be done to its end, whatever questionnaires it asks."""

import uuid
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy.orm import Session

from app.schemas.participants import QuestionnaireIn
from app.services import flow, questionnaires, responses, visit
from app.services.protocols import BadProtocol
from app.storage import studies
from app.storage.database import Database
from app.storage.tables import ParticipantRow, ResponseRow, StudyRow
from tests.app.factories import SMALL, enrol, make_study, now

OWN = ["own", "after", "end", "avoid"]  # as like the words in steps' keys as can be
PLACES = ("after_each_strategy", "after_each_task", "at_the_end")
names = st.lists(st.sampled_from([*questionnaires.LIBRARY, *OWN]), max_size=4)


def content_of(asked: dict[str, list[str]]) -> dict[str, Any]:
    item = {"key": "a", "kind": "text", "text": "Why?"}
    own = [{"name": name, "title": name, "items": [item]} for name in OWN]
    return SMALL | {"questionnaires": asked, "own_questionnaires": own, "practice_s": 0.0}


def do_all(db: Session, participant: ParticipantRow) -> None:
    """Go from step to step as far as it goes, filling in what is asked."""
    while participant.state == "active":
        at = flow.here(db, participant)
        step = at.step
        if step.kind != "questions":
            assert flow.advance(db, participant, at, str(uuid.uuid4()), step.kind, step.key)
            continue
        shown = visit.session_of(visit.snapshot(db, participant, at, [])).questions
        assert shown is not None
        said = [
            {"item": item.key, "value": None, "answered_at": now()}
            for item in shown.questionnaire.items
        ]
        filled = {"id": uuid.uuid4(), "key": step.key, "responses": said}
        assert responses.record(db, participant, at, QuestionnaireIn.model_validate(filled))
        db.flush()


def kept_before_the_rule(db: Session, asked: dict[str, list[str]]) -> StudyRow:
    """A study whose protocol was kept when twins were accepted."""
    study = make_study(db)
    row = studies.latest(db, study.id)
    assert row is not None
    row.content = content_of(asked)
    db.flush()
    return study


# The database goes on from one example to the next; each makes a study of its own.
few = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
any_questionnaires = given(asked=st.fixed_dictionaries({place: names for place in PLACES}))


@few
@any_questionnaires
def test_a_protocol_is_finished_with_all_it_asks_or_refused_for_asking_twice(
    database: Database, asked: dict[str, list[str]]
) -> None:
    with database.write() as db:
        if any(len(set(each)) < len(each) for each in asked.values()):
            with pytest.raises(BadProtocol, match="is there twice in questionnaires"):
                make_study(db, **content_of(asked))
        else:
            do_all_asked(db, make_study(db, **content_of(asked)), asked)


@few
@any_questionnaires
def test_every_protocol_kept_before_is_finished_with_all_it_asks(
    database: Database, asked: dict[str, list[str]]
) -> None:
    with database.write() as db:
        do_all_asked(db, kept_before_the_rule(db, asked), asked)


def do_all_asked(db: Session, study: StudyRow, asked: dict[str, list[str]]) -> None:
    participant = enrol(db, study)
    do_all(db, participant)
    assert participant.state == "completed"
    wanted = {"after_each_strategy": 2 * 3, "after_each_task": 2, "at_the_end": 1}
    items = sum(
        times * len(found.items)
        for place, times in wanted.items()
        for name in asked[place]
        if (found := questionnaires.find(flow.here(db, participant).protocol, name))
    )
    assert db.query(ResponseRow).filter_by(participant_id=participant.id).count() == items


@pytest.mark.parametrize("place", PLACES)
def test_who_was_stuck_at_a_questionnaires_second_time_is_asked_it_again_and_goes_on(
    database: Database, place: str
) -> None:
    with database.write() as db:
        participant = enrol(db, kept_before_the_rule(db, {place: ["sus", "sus"]}))
        steps = flow.here(db, participant).steps
        asked = [index for index, step in enumerate(steps) if step.questionnaire == "sus"]
        assert [steps[index].key.endswith("/sus") for index in asked[:2]] == [True, False]
        participant.place = asked[1]
        do_all(db, participant)
        assert participant.state == "completed"
