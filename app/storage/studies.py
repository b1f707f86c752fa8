"""Asking the database about studies and the versions of their protocols."""

from sqlalchemy import and_, func, select
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


def state_counts(db: Session, study_id: str | None = None) -> dict[tuple[str, str], int]:
    """How many participants of a study, or of each, are in each state, by the study's id and it."""
    statement = select(ParticipantRow.study_id, ParticipantRow.state, func.count())
    if study_id is not None:
        statement = statement.where(ParticipantRow.study_id == study_id)
    rows = db.execute(statement.group_by(ParticipantRow.study_id, ParticipantRow.state))
    return {(of, state): count for of, state, count in rows}


def all_latest(db: Session) -> dict[str, ProtocolRow]:
    """The version that new participants get, of each study, by the study's id."""
    newest = (
        select(ProtocolRow.study_id, func.max(ProtocolRow.version).label("version"))
        .group_by(ProtocolRow.study_id)
        .subquery()
    )
    rows = db.scalars(
        select(ProtocolRow).join(
            newest,
            and_(
                ProtocolRow.study_id == newest.c.study_id,
                ProtocolRow.version == newest.c.version,
            ),
        )
    )
    return {row.study_id: row for row in rows}


def version_counts(db: Session, study_id: str) -> dict[str, int]:
    """How many participants were enrolled under each version, by the protocol's id."""
    rows = db.execute(
        select(ParticipantRow.protocol_id, func.count())
        .where(ParticipantRow.study_id == study_id)
        .group_by(ParticipantRow.protocol_id)
    )
    return {protocol_id: count for protocol_id, count in rows}
