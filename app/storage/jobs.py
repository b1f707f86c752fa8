"""Asking the database about trainings, and the two statements that must not race."""

from sqlalchemy import and_, or_, select, update
from sqlalchemy.orm import Session, undefer

from .tables import AlignmentRow, JobRow, ParticipantRow


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


def by_id(db: Session, job_id: str) -> JobRow | None:
    """A training, by its id."""
    return db.get(JobRow, job_id)


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


def all_of(db: Session, participant_id: str) -> list[JobRow]:
    """All trainings of a participant, with what they reported, oldest first."""
    return list(
        db.scalars(
            select(JobRow)
            .where(JobRow.participant_id == participant_id)
            .options(undefer(JobRow.report))
            .order_by(JobRow.queued_at)
        )
    )


def page(
    db: Session, state: str | None, after: JobRow | None, limit: int
) -> list[tuple[JobRow, ParticipantRow]]:
    """Some trainings of everybody, newest first, beginning after one of them."""
    statement = select(JobRow, ParticipantRow).join(
        ParticipantRow, ParticipantRow.id == JobRow.participant_id
    )
    if state is not None:
        statement = statement.where(JobRow.state == state)
    if after is not None:
        at = after.queued_at
        statement = statement.where(
            or_(JobRow.queued_at < at, and_(JobRow.queued_at == at, JobRow.id < after.id))
        )
    rows = db.execute(statement.order_by(JobRow.queued_at.desc(), JobRow.id.desc()).limit(limit))
    return [(job, participant) for job, participant in rows]


def latest_states(db: Session, participant_ids: list[str]) -> dict[str, str]:
    """The state of each one's newest training."""
    rows = db.execute(
        select(JobRow.participant_id, JobRow.state)
        .where(JobRow.participant_id.in_(participant_ids))
        .order_by(JobRow.queued_at)
    )
    return {participant_id: state for participant_id, state in rows}
