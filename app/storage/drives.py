"""Asking the database about drives and their samples."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import func, insert, select
from sqlalchemy.orm import Session

from .tables import DriveRow, SampleChunkRow


def by_id(db: Session, drive_id: str) -> DriveRow | None:
    """A drive, by the client's id."""
    return db.get(DriveRow, drive_id)


def still_open(db: Session, participant_id: str | None = None) -> list[DriveRow]:
    """Drives not ended yet: one participant's, or everyone's."""
    statement = select(DriveRow).where(DriveRow.ended_at.is_(None))
    if participant_id is not None:
        statement = statement.where(DriveRow.participant_id == participant_id)
    return list(db.scalars(statement))


def of_participant(db: Session, participant_id: str) -> list[DriveRow]:
    """A participant's drives, in the order in which they began."""
    return list(
        db.scalars(
            select(DriveRow)
            .where(DriveRow.participant_id == participant_id)
            .order_by(DriveRow.started_at, DriveRow.id)
        )
    )


def of_step(db: Session, participant_id: str, step: str) -> list[DriveRow]:
    """A participant's drives in one step, in the order in which they began."""
    return [drive for drive in of_participant(db, participant_id) if drive.step == step]


def last_chunk(db: Session, participant_id: str, task: str) -> SampleChunkRow | None:
    """The newest samples of a participant at a task."""
    return db.scalar(
        select(SampleChunkRow)
        .join(DriveRow, DriveRow.id == SampleChunkRow.drive_id)
        .where(DriveRow.participant_id == participant_id, DriveRow.task == task)
        .order_by(SampleChunkRow.id.desc())
        .limit(1)
    )


def chunks(db: Session, drive_id: str) -> Sequence[SampleChunkRow]:
    """All samples of a drive, in order."""
    return list(
        db.scalars(
            select(SampleChunkRow)
            .where(SampleChunkRow.drive_id == drive_id)
            .order_by(SampleChunkRow.first_tick)
        )
    )


def add_chunks(db: Session, rows: list[dict[str, Any]]) -> None:
    """Add chunks of samples, all in one statement."""
    if rows:
        db.execute(insert(SampleChunkRow), rows)


def ticks_of(db: Session, participant_id: str) -> dict[str, int]:
    """How many ticks were kept of each of a participant's drives; those without any are not in."""
    rows = db.execute(
        select(SampleChunkRow.drive_id, func.sum(SampleChunkRow.ticks))
        .join(DriveRow, DriveRow.id == SampleChunkRow.drive_id)
        .where(DriveRow.participant_id == participant_id)
        .group_by(SampleChunkRow.drive_id)
    )
    return {drive_id: ticks for drive_id, ticks in rows}


def counts(db: Session, participant_ids: list[str]) -> dict[str, tuple[int, int]]:
    """For each of these participants: how many drives, and how many ticks in them."""
    rows = db.execute(
        select(
            DriveRow.participant_id,
            func.count(func.distinct(DriveRow.id)),
            func.coalesce(func.sum(SampleChunkRow.ticks), 0),
        )
        .outerjoin(SampleChunkRow, SampleChunkRow.drive_id == DriveRow.id)
        .where(DriveRow.participant_id.in_(participant_ids))
        .group_by(DriveRow.participant_id)
    )
    return {participant_id: (drives, ticks) for participant_id, drives, ticks in rows}
