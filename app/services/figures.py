"""Which state of a study's data figures were drawn from."""

import hashlib
from dataclasses import dataclass

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.storage.tables import AnswerRow, DriveRow, ParticipantRow, ResponseRow


@dataclass(frozen=True)
class Version:
    """A state of a study's data.

    Attributes:
        people: Names who is in them: changes when somebody comes, leaves or is excluded.
        data: How much they gave.
    """

    people: str
    data: str


def version_of(db: Session, study_id: str) -> Version:
    """The state that a study's data are in now."""
    who = select(
        ParticipantRow.id, ParticipantRow.state == "withdrawn", ParticipantRow.excluded
    ).where(ParticipantRow.study_id == study_id)
    people = hashlib.sha256()
    for row in db.execute(who.order_by(ParticipantRow.id)):
        people.update(repr(tuple(row)).encode())
    counts = [
        db.scalar(
            select(func.count())
            .select_from(table)
            .join(ParticipantRow, table.participant_id == ParticipantRow.id)
            .where(ParticipantRow.study_id == study_id, *conditions)
        )
        for table, conditions in (
            (DriveRow, [DriveRow.ended_at.is_not(None)]),
            (ResponseRow, []),
            (AnswerRow, []),
        )
    ]
    return Version(people.hexdigest(), "/".join(map(str, counts)))
