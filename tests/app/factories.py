"""Rows to begin with."""

import uuid
from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.schemas.participants import AnswerIn
from app.services import accounts
from app.storage.tables import ParticipantRow, QueryRow


def make_participant(db: Session, *, step: str = "consent", moves: int = 0) -> ParticipantRow:
    """A participant on a step, with this many moves drawn."""
    participant_id = str(uuid.uuid4())
    accounts.add_participant(db, participant_id, "experimenter", "plane", accounts.new_token())
    participant = db.get_one(ParticipantRow, participant_id)
    participant.step = step
    for position in range(1, moves + 1):
        db.add(
            QueryRow(
                id=str(uuid.uuid4()),
                participant_id=participant_id,
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
