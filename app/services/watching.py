"""Whose arms are live, and what is being learned, whoever's it is."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy.orm import Session

from app.errors import JoymapError
from app.schemas.experimenter import JobOut, JobsOut, LiveOut, LivesOut
from app.schemas.messages import StatusOut
from app.services import flow
from app.services.enrolment import label_of
from app.services.studies import step_out
from app.storage import jobs, participants
from app.storage.tables import JobRow, ParticipantRow


class NoSuchJob(JoymapError):
    """A training that nobody wanted."""

    status_code = 404
    kind = "no-such-job"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such training to go on after.")


@dataclass(frozen=True)
class Live:
    """What an arm does now, and whether somebody has it in front of them."""

    participant_id: str
    is_connected: bool
    status: StatusOut


def lives(db: Session, seen: list[Live]) -> LivesOut:
    """Who has an arm in front of them, in order of their numbers."""
    people = participants.by_ids(db, [each.participant_id for each in seen])
    sessions = []
    for each in seen:
        person = people.get(each.participant_id)
        if person is not None:
            sessions.append((person.number, _live(db, person, each)))
    return LivesOut(sessions=[line for _, line in sorted(sessions, key=lambda found: found[0])])


def _live(db: Session, person: ParticipantRow, live: Live) -> LiveOut:
    return LiveOut(
        participant_id=person.id,
        label=label_of(person),
        study_id=person.study_id,
        step=step_out(flow.here(db, person).step),
        mode=live.status.mode,
        is_connected=live.is_connected,
        drive_id=live.status.drive_id,
        progress=live.status.progress,
    )


def trainings(db: Session, *, state: str | None, after: str | None, limit: int) -> JobsOut:
    """A page of everybody's trainings, newest first.

    Args:
        db: The transaction.
        state: Only those in this state.
        after: The id of the last one of the page before.
        limit: At most so many.

    Raises:
        NoSuchJob: If there is no training ``after`` which to go on.
    """
    last = None
    if after is not None:
        last = jobs.by_id(db, after)
        if last is None:
            raise NoSuchJob
    rows = jobs.page(db, state, last, limit + 1)
    found = [_job(job, person) for job, person in rows[:limit]]
    return JobsOut(jobs=found, next=found[-1].id if len(rows) > limit else None)


def _job(job: JobRow, person: ParticipantRow) -> JobOut:
    return JobOut(
        id=job.id,
        participant_id=person.id,
        label=label_of(person),
        study_id=person.study_id,
        task=job.task,
        state=job.state,  # type: ignore[arg-type]
        fraction=job.fraction,
        attempt=job.attempt,
        error=job.error,
        queued_at=_iso(job.queued_at),
        ended_at=None if job.ended_at is None else _iso(job.ended_at),
        training_s=job.training_s,
    )


def _iso(moment: datetime) -> str:
    return moment.isoformat(timespec="seconds")
