"""Rows to begin with."""

import uuid
from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.schemas.participants import AnswerIn
from app.services import enrolment, flow, protocols
from app.storage.tables import ParticipantRow, QueryRow, StudyRow

# A whole protocol, and short.
SMALL: dict[str, Any] = {
    "title": "A small study",
    "tasks": [{"task": "avoid", "labels": 5}, {"task": "pour-cup", "labels": 5}],
    "strategies": ["no-align", "no-priors", "all-priors"],
    "questionnaires": {
        "after_each_strategy": ["steering"],
        "after_each_task": ["preference"],
    },
    "completion": {"code": "C0DE", "url": "https://example.org/done?cc={code}"},
}
FREE: dict[str, Any] = {
    "title": "Try it out",
    "tasks": [{"task": "plane"}],
    "strategies": protocols.DEMO_STRATEGIES,
    "order": "fixed",
    "is_free": True,
}


def make_study(db: Session, **changes: Any) -> StudyRow:
    """An open study with the protocol SMALL, but for these changes."""
    study = StudyRow(
        id=str(uuid.uuid4()),
        title="",
        state="open",
        link_hash=None,
        created_at=now(),
        created_by=None,
    )
    db.add(study)
    db.flush()
    protocols.keep(db, study, protocols.parse(SMALL | changes))
    return study


def enrol(db: Session, study: StudyRow, **given: Any) -> ParticipantRow:
    """One more participant of a study."""
    return enrolment.enrol(
        db,
        study,
        enrolment.new_token(),
        **{"participant_id": str(uuid.uuid4()), "origin": "experimenter", **given},
    )


def make_participant(db: Session, *, step: str = "consent", moves: int = 0) -> ParticipantRow:
    """Somebody who only tries Joymap out, on a step, with this many moves drawn."""
    study = db.get(StudyRow, protocols.DEMO)
    if study is None:
        study = StudyRow(
            id=protocols.DEMO, title="", state="open", link_hash=None, created_at=now()
        )
        db.add(study)
        db.flush()
        protocols.keep(db, study, protocols.parse(FREE))
    participant = enrol(db, study)
    at = flow.here(db, participant)
    participant.place = [each.kind for each in at.steps].index(step)  # type: ignore[arg-type]
    for position in range(1, moves + 1):
        db.add(
            QueryRow(
                id=str(uuid.uuid4()),
                participant_id=participant.id,
                task="plane",
                repeats=None,
                position=position,
                pool_index=position,
                controller_hash="c",
                s=[0.0] * 7,
                z=[0.1, 0.2],
                next_s=[0.1 * position] * 7,
                path=[[0.0] * 7] * 2,
                hand_path=[[0.0] * 3] * 2,
            )
        )
    db.flush()
    return participant


def make_answer(query: QueryRow, h: Any = (0.5, -0.5), **given: Any) -> AnswerIn:
    """What a page sends for a query."""
    return AnswerIn(
        **{"id": uuid.uuid4(), "query_id": query.id, "h": h, "thinking_time_s": 1.0, **given}
    )


def now() -> datetime:
    return datetime.now(UTC)
