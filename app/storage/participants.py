"""Asking the database about participants, their steps and their questions."""

from sqlalchemy import cast, func, or_, select
from sqlalchemy.orm import Session
from sqlalchemy.types import String

from .tables import (
    AnswerRow,
    EventRow,
    ExperimenterRow,
    NoteRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
)


def by_token_hash(db: Session, token_hash: str) -> ParticipantRow | None:
    """The participant a link belongs to."""
    return db.scalar(select(ParticipantRow).where(ParticipantRow.token_hash == token_hash))


def by_ids(db: Session, participant_ids: list[str]) -> dict[str, ParticipantRow]:
    """These participants, by their ids."""
    rows = db.scalars(select(ParticipantRow).where(ParticipantRow.id.in_(participant_ids)))
    return {row.id: row for row in rows}


def everyone(db: Session) -> list[ParticipantRow]:
    """All participants, in order of their numbers."""
    return list(db.scalars(select(ParticipantRow).order_by(ParticipantRow.number)))


def never_opened(db: Session, origin: str) -> ParticipantRow | None:
    """A participant of this origin whose link nobody has opened yet."""
    return db.scalar(
        select(ParticipantRow)
        .where(ParticipantRow.origin == origin, ParticipantRow.opened_at.is_(None))
        .order_by(ParticipantRow.number)
        .limit(1)
    )


def by_external_id(db: Session, study_id: str, external_id: str) -> ParticipantRow | None:
    """The participant of a study whom a recruiting service calls this."""
    return db.scalar(
        select(ParticipantRow).where(
            ParticipantRow.study_id == study_id, ParticipantRow.external_id == external_id
        )
    )


def active(db: Session) -> list[ParticipantRow]:
    """Everyone who takes part now."""
    return list(db.scalars(select(ParticipantRow).where(ParticipantRow.state == "active")))


def active_under(db: Session, protocol_id: str) -> list[ParticipantRow]:
    """Everyone who takes part now under a version of a protocol, oldest first."""
    return list(
        db.scalars(
            select(ParticipantRow)
            .where(ParticipantRow.protocol_id == protocol_id, ParticipantRow.state == "active")
            .order_by(ParticipantRow.number)
        )
    )


def next_number(db: Session) -> int:
    """The number the next participant gets."""
    return (db.scalar(select(func.max(ParticipantRow.number))) or 0) + 1


def event(db: Session, event_id: str) -> EventRow | None:
    """A step taken, by the client's id."""
    return db.get(EventRow, event_id)


def queries_of(db: Session, participant_id: str, task: str) -> list[QueryRow]:
    """All moves of a task drawn for a participant, in the order of asking."""
    return list(
        db.scalars(
            select(QueryRow)
            .where(QueryRow.participant_id == participant_id, QueryRow.task == task)
            .order_by(QueryRow.position)
        )
    )


def answer_by_id(db: Session, answer_id: str) -> AnswerRow | None:
    """An answer, by the client's id."""
    return db.scalar(select(AnswerRow).where(AnswerRow.id == answer_id))


def latest_answers(db: Session, participant_id: str) -> dict[str, AnswerRow]:
    """The answer that counts for each query, by the query's id."""
    rows = db.scalars(
        select(AnswerRow)
        .where(AnswerRow.participant_id == participant_id)
        .order_by(AnswerRow.sequence)
    )
    return {row.query_id: row for row in rows}


def page(
    db: Session, study_id: str, state: str | None, search: str | None, after: int, limit: int
) -> tuple[list[ParticipantRow], int]:
    """Some of a study's participants after a number, and how many there are in all."""
    chosen = [ParticipantRow.study_id == study_id]
    if state is not None:
        chosen.append(ParticipantRow.state == state)
    if search:
        number = cast(ParticipantRow.number, String)
        holds = search.upper().removeprefix("P-")
        chosen.append(
            or_(number == holds, ParticipantRow.external_id.contains(search, autoescape=True))
        )
    total = db.scalar(select(func.count()).select_from(ParticipantRow).where(*chosen)) or 0
    rows = db.scalars(
        select(ParticipantRow)
        .where(*chosen, ParticipantRow.number > after)
        .order_by(ParticipantRow.number)
        .limit(limit)
    )
    return list(rows), total


def answer_counts(db: Session, participant_ids: list[str]) -> dict[str, int]:
    """How many questions each of these has answered."""
    rows = db.execute(
        select(AnswerRow.participant_id, func.count(func.distinct(AnswerRow.query_id)))
        .where(AnswerRow.participant_id.in_(participant_ids))
        .group_by(AnswerRow.participant_id)
    )
    return {participant_id: count for participant_id, count in rows}


def all_queries_of(db: Session, participant_id: str) -> dict[str, QueryRow]:
    """All moves drawn for a participant, by their ids, in the order of asking."""
    rows = db.scalars(
        select(QueryRow)
        .where(QueryRow.participant_id == participant_id)
        .order_by(QueryRow.task, QueryRow.position)
    )
    return {row.id: row for row in rows}


def responses_of(db: Session, participant_id: str) -> list[ResponseRow]:
    """What somebody said in questionnaires, in order."""
    return list(
        db.scalars(
            select(ResponseRow)
            .where(ResponseRow.participant_id == participant_id)
            .order_by(ResponseRow.id)
        )
    )


def notes_of(db: Session, participant_id: str) -> list[tuple[NoteRow, str]]:
    """What experimenters noted of somebody, with their names, oldest first."""
    rows = db.execute(
        select(NoteRow, ExperimenterRow.name)
        .join(ExperimenterRow, ExperimenterRow.id == NoteRow.experimenter_id)
        .where(NoteRow.participant_id == participant_id)
        .order_by(NoteRow.written_at)
    )
    return [(note, name) for note, name in rows]


def events_of(db: Session, participant_id: str) -> list[EventRow]:
    """What somebody did, oldest first."""
    return list(
        db.scalars(
            select(EventRow).where(EventRow.participant_id == participant_id).order_by(EventRow.at)
        )
    )
