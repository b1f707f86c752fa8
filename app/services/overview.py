"""What an experimenter sees of everyone at a glance."""

from sqlalchemy.orm import Session

from app.schemas.experimenter import ParticipantOut
from app.services.accounts import label_of
from app.storage import drives, jobs, participants


def everyone(db: Session, ticks_per_s: float) -> list[ParticipantOut]:
    """One line a participant."""
    driven = drives.counts(db)
    lines = []
    for row in participants.everyone(db):
        job = jobs.of_participant(db, row.id)
        count, ticks = driven.get(row.id, (0, 0))
        lines.append(
            ParticipantOut(
                id=row.id,
                label=label_of(row),
                created_at=row.created_at.isoformat(timespec="seconds"),
                step=row.step if row.opened_at is not None else "not opened",
                answers=len(participants.latest_answers(db, row.id)),
                training=None if job is None else job.state,  # type: ignore[arg-type]
                drives=count,
                driven_s=round(ticks / ticks_per_s, 1),
            )
        )
    return lines
