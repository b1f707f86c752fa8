"""Deleting all rows that hold what somebody gave."""

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from .tables import (
    AlignmentRow,
    AnswerRow,
    DriveRow,
    EventRow,
    JobRow,
    NoteRow,
    QueryRow,
    ResponseRow,
    SampleChunkRow,
)


def erase(db: Session, participant_id: str) -> list[str]:
    """Delete everything but the participant's own row; the names of their alignments' files."""
    files = list(
        db.scalars(select(AlignmentRow.file).where(AlignmentRow.participant_id == participant_id))
    )
    theirs = select(DriveRow.id).where(DriveRow.participant_id == participant_id)
    db.execute(delete(SampleChunkRow).where(SampleChunkRow.drive_id.in_(theirs)))
    db.execute(
        update(QueryRow).where(QueryRow.participant_id == participant_id).values(repeats=None)
    )
    # What points at other rows goes before what it points at.
    tables = (AnswerRow, DriveRow, AlignmentRow, JobRow, QueryRow, ResponseRow, NoteRow, EventRow)
    for table in tables:
        db.execute(delete(table).where(table.participant_id == participant_id))
    return files
