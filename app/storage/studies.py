"""Asking the database about studies and the versions of their protocols."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from .tables import ParticipantRow, ProtocolRow, StudyRow


def study(db: Session, study_id: str) -> StudyRow | None:
    """A study, by its id."""
    return db.get(StudyRow, study_id)


def everything(db: Session) -> list[StudyRow]:
    """All studies, in the order in which they were made."""
    return list(db.scalars(select(StudyRow).order_by(StudyRow.created_at, StudyRow.id)))


def by_link_hash(db: Session, link_hash: str) -> StudyRow | None:
    """The study a shared link belongs to."""
    return db.scalar(select(StudyRow).where(StudyRow.link_hash == link_hash))


def protocol(db: Session, protocol_id: str) -> ProtocolRow:
    """A version of a protocol."""
    return db.get_one(ProtocolRow, protocol_id)


def versions(db: Session, study_id: str) -> list[ProtocolRow]:
    """All versions of a study's protocol, oldest first."""
    return list(
        db.scalars(
            select(ProtocolRow)
            .where(ProtocolRow.study_id == study_id)
            .order_by(ProtocolRow.version)
        )
    )


def latest(db: Session, study_id: str) -> ProtocolRow | None:
    """The version that new participants get."""
    return db.scalar(
        select(ProtocolRow)
        .where(ProtocolRow.study_id == study_id)
        .order_by(ProtocolRow.version.desc())
        .limit(1)
    )


def cell_counts(db: Session, protocol_id: str, states: tuple[str, ...]) -> dict[int, int]:
    """How many participants in these states each cell of a protocol has."""
    rows = db.execute(
        select(ParticipantRow.cell, func.count())
        .where(ParticipantRow.protocol_id == protocol_id, ParticipantRow.state.in_(states))
        .group_by(ParticipantRow.cell)
    )
    return {cell: count for cell, count in rows}


def state_counts(db: Session, study_id: str) -> dict[str, int]:
    """How many participants of a study are in each state."""
    rows = db.execute(
        select(ParticipantRow.state, func.count())
        .where(ParticipantRow.study_id == study_id)
        .group_by(ParticipantRow.state)
    )
    return {state: count for state, count in rows}


def version_counts(db: Session, study_id: str) -> dict[str, int]:
    """How many participants were enrolled under each version, by the protocol's id."""
    rows = db.execute(
        select(ParticipantRow.protocol_id, func.count())
        .where(ParticipantRow.study_id == study_id)
        .group_by(ParticipantRow.protocol_id)
    )
    return {protocol_id: count for protocol_id, count in rows}
