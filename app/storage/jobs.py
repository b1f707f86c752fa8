"""Asking the database about trainings, and the two statements that must not race."""

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from .tables import AlignmentRow, JobRow


def of_task(db: Session, participant_id: str, task: str) -> JobRow | None:
    """The participant's latest training for a task."""
    return db.scalar(
        select(JobRow)
        .where(JobRow.participant_id == participant_id, JobRow.task == task)
        .order_by(JobRow.queued_at.desc())
        .limit(1)
    )


def claim(db: Session) -> JobRow | None:
    """Take the oldest queued job and mark it running, in one statement."""
    oldest = (
        select(JobRow.id)
        .where(JobRow.state == "queued")
        .order_by(JobRow.queued_at)
        .limit(1)
        .scalar_subquery()
    )
    return db.scalar(
        update(JobRow)
        .where(JobRow.id == oldest)
        .values(state="running", attempt=JobRow.attempt + 1, fraction=0.0)
        .returning(JobRow)
    )


def running(db: Session, job_id: str, attempt: int) -> JobRow | None:
    """The job, if this attempt is still the one that counts."""
    return db.scalar(
        select(JobRow).where(
            JobRow.id == job_id, JobRow.attempt == attempt, JobRow.state == "running"
        )
    )


def all_running(db: Session) -> list[JobRow]:
    """Jobs that a worker had begun; after a start of the server none has one any more."""
    return list(db.scalars(select(JobRow).where(JobRow.state == "running")))


def alignment(db: Session, participant_id: str, task: str, strategy: str) -> AlignmentRow | None:
    """The participant's latest finished alignment of a strategy for a task."""
    return db.scalar(
        select(AlignmentRow)
        .where(
            AlignmentRow.participant_id == participant_id,
            AlignmentRow.task == task,
            AlignmentRow.strategy == strategy,
        )
        .order_by(AlignmentRow.trained_at.desc())
        .limit(1)
    )


def alignment_files(db: Session) -> set[str]:
    """The names of all files that hold a registered alignment."""
    return set(db.scalars(select(AlignmentRow.file)))
