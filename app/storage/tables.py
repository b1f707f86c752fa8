"""Every table. Rows hold facts as they were given; nothing here decides anything.

Times ending in ``_at`` are the server's wall clock in UTC; ``…_monotonic_s`` are its monotonic
clock, which never jumps but starts anew with the machine (``boot`` tells which start).
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    CheckConstraint,
    DateTime,
    Dialect,
    ForeignKey,
    LargeBinary,
    MetaData,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

_NAMES = {
    "ix": "ix_%(column_0_label)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class Utc(TypeDecorator[datetime]):
    """A moment in UTC; comes back from SQLite with its time zone."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, _dialect: Dialect) -> datetime | None:
        """Store UTC."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, _dialect: Dialect) -> datetime | None:
        """Give the time zone back."""
        return None if value is None else value.replace(tzinfo=UTC)


class Row(DeclarativeBase):
    """Base of all tables."""

    metadata = MetaData(naming_convention=_NAMES)
    type_annotation_map = {datetime: Utc, dict[str, Any]: JSON, list[Any]: JSON}  # noqa: RUF012


class StudyRow(Row):
    """A study: protocols, version after version, and the people who take part."""

    __tablename__ = "study"

    id: Mapped[str] = mapped_column(primary_key=True)
    title: Mapped[str]
    state: Mapped[str]  # "open": people can enrol; "closed"
    link_hash: Mapped[str | None] = mapped_column(unique=True)  # of the shared link's token
    created_at: Mapped[datetime]
    created_by: Mapped[str | None] = mapped_column(ForeignKey("experimenter.id"))


class ProtocolRow(Row):
    """One version of a study's protocol; it never changes once somebody is enrolled under it."""

    __tablename__ = "protocol"
    __table_args__ = (UniqueConstraint("study_id", "version"),)

    id: Mapped[str] = mapped_column(primary_key=True)
    study_id: Mapped[str] = mapped_column(ForeignKey("study.id"), index=True)
    version: Mapped[int]
    content: Mapped[dict[str, Any]]  # a Protocol (app.schemas.protocol) as JSON
    created_at: Mapped[datetime]
    frozen_at: Mapped[datetime | None]  # when the first participant enrolled under it


class ParticipantRow(Row):
    """A person with a link; only the hash of the link's token is kept."""

    __tablename__ = "participant"
    __table_args__ = (
        UniqueConstraint("study_id", "external_id"),
        CheckConstraint(
            "state IN ('active', 'completed', 'abandoned', 'withdrawn')",
            name="state",
        ),
    )

    id: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[int] = mapped_column(unique=True)
    study_id: Mapped[str] = mapped_column(ForeignKey("study.id"), index=True)
    protocol_id: Mapped[str] = mapped_column(ForeignKey("protocol.id"))
    cell: Mapped[int]  # which order of the protocol's strategies they get
    place: Mapped[int]  # on which of the protocol's steps they are
    state: Mapped[str]
    origin: Mapped[str]  # "start": printed when the server started; "experimenter"; "link"
    external_id: Mapped[str | None]  # a recruiting service's name for them
    token_hash: Mapped[str | None] = mapped_column(unique=True)  # null: the link was revoked
    browser_hash: Mapped[str | None]  # of the cookie they came with by the shared link
    seed: Mapped[int]
    created_at: Mapped[datetime]
    opened_at: Mapped[datetime | None]
    seen_at: Mapped[datetime | None]  # when they last did something
    ended_at: Mapped[datetime | None]  # completed, or withdrawn
    erased_at: Mapped[datetime | None]  # when what they gave was erased, as they wished
    excluded: Mapped[str | None]  # why an experimenter leaves their data out
    stick: Mapped[dict[str, Any] | None]  # how their stick is set; null: the defaults


class EventRow(Row):
    """What a participant did, by the client's id: a step taken, or ("stick") their stick set."""

    __tablename__ = "event"

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    kind: Mapped[str]
    detail: Mapped[dict[str, Any]]
    at: Mapped[datetime]


class QueryRow(Row):
    """A move shown to a participant, who is asked for the stick input they would give for it."""

    __tablename__ = "query"
    __table_args__ = (UniqueConstraint("participant_id", "task", "position"),)

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    task: Mapped[str]
    repeats: Mapped[str | None] = mapped_column(ForeignKey("query.id"))  # asked once more
    position: Mapped[int]  # 1, 2, …: the order of asking
    pool_index: Mapped[int]  # which of the participant's unlabelled samples it is
    controller_hash: Mapped[str]
    s: Mapped[list[Any]]  # (7,) joint positions, [rad]
    z: Mapped[list[Any]]  # (2,) the latent action held during the move
    next_s: Mapped[list[Any]]  # (7,) [rad]
    path: Mapped[list[Any]]  # (m, 7) the move as shown, [rad]
    hand_path: Mapped[list[Any]]  # (m, 3) the hand during the move, [m]


class AnswerRow(Row):
    """A stick input given for a query; the last one given for a query counts. All are kept."""

    __tablename__ = "answer"
    __table_args__ = (
        CheckConstraint("(h_x IS NULL) = (h_y IS NULL)", name="both_or_none"),
        CheckConstraint("h_x IS NULL OR (h_x BETWEEN -1 AND 1)", name="x_in_range"),
        CheckConstraint("h_y IS NULL OR (h_y BETWEEN -1 AND 1)", name="y_in_range"),
    )

    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(unique=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    query_id: Mapped[str] = mapped_column(ForeignKey("query.id"), index=True)
    h_x: Mapped[float | None]  # both null: "I can't say"
    h_y: Mapped[float | None]
    thinking_time_s: Mapped[float]  # as the page measured it
    answered_at: Mapped[datetime]


class JobRow(Row):
    """A training, from the moment it is wanted to its one end."""

    __tablename__ = "job"
    __table_args__ = (
        UniqueConstraint("participant_id", "task", "data_hash"),
        CheckConstraint("state IN ('queued', 'running', 'succeeded', 'failed')", name="state"),
    )

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    task: Mapped[str]
    state: Mapped[str] = mapped_column(index=True)
    attempt: Mapped[int]  # how often a worker has begun it
    data_hash: Mapped[str]
    seed: Mapped[int]
    # Curves and learned fields, as far as they have come: long, and read by few.
    report: Mapped[dict[str, Any]] = mapped_column(deferred=True)
    fraction: Mapped[float]
    error: Mapped[str | None]
    training_s: Mapped[float | None]
    queued_at: Mapped[datetime]
    ended_at: Mapped[datetime | None]


class AlignmentRow(Row):
    """A finished alignment: whose, from which data, and where its weights lie."""

    __tablename__ = "alignment"
    __table_args__ = (UniqueConstraint("job_id", "strategy"),)

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    job_id: Mapped[str] = mapped_column(ForeignKey("job.id"))
    task: Mapped[str]
    strategy: Mapped[str]
    file: Mapped[str]  # name in the folder of alignments
    weights_sha256: Mapped[str]
    data_hash: Mapped[str]
    controller_hash: Mapped[str]
    seed: Mapped[int]
    settings: Mapped[dict[str, Any]]
    code_version: Mapped[str]
    trained_at: Mapped[datetime]


class DriveRow(Row):
    """A stretch of driving under one strategy."""

    __tablename__ = "drive"

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    task: Mapped[str]
    step: Mapped[str]  # the key of the protocol's step it was driven in
    strategy: Mapped[str]
    alignment_id: Mapped[str | None] = mapped_column(ForeignKey("alignment.id"))
    boot: Mapped[str]
    started_at: Mapped[datetime]
    started_monotonic_s: Mapped[float]
    ended_at: Mapped[datetime | None]
    # "done", "given up", "time limit", "switched", "left", "server stopped"
    end: Mapped[str | None]
    outcome: Mapped[dict[str, Any] | None]  # what the task said at the end


class SampleChunkRow(Row):
    """Ticks of a drive, in order: float64 rows of the columns in ``app.storage.ticks``."""

    __tablename__ = "sample_chunk"
    __table_args__ = (UniqueConstraint("drive_id", "first_tick"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    drive_id: Mapped[str] = mapped_column(ForeignKey("drive.id"), index=True)
    first_tick: Mapped[int]
    ticks: Mapped[int]
    last_monotonic_s: Mapped[float]
    samples: Mapped[bytes] = mapped_column(LargeBinary)
    props: Mapped[bytes | None] = mapped_column(LargeBinary)  # cup and beads, tick by tick


class ResponseRow(Row):
    """What a person said to one item of a questionnaire, as they gave it."""

    __tablename__ = "response"
    __table_args__ = (UniqueConstraint("participant_id", "step", "item"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    step: Mapped[str]  # the key of the protocol's step
    questionnaire: Mapped[str]
    item: Mapped[str]
    value: Mapped[str | None]  # JSON; null: they would rather not say
    answered_at: Mapped[datetime]  # when the page says that it was given
    received_at: Mapped[datetime]


class NoteRow(Row):
    """What an experimenter noted of a participant."""

    __tablename__ = "note"

    id: Mapped[str] = mapped_column(primary_key=True)
    participant_id: Mapped[str] = mapped_column(ForeignKey("participant.id"), index=True)
    experimenter_id: Mapped[str] = mapped_column(ForeignKey("experimenter.id"))
    text: Mapped[str]
    written_at: Mapped[datetime]


class AuditRow(Row):
    """What an experimenter did, and when; never changed, and without participants' data."""

    __tablename__ = "audit"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    at: Mapped[datetime]
    experimenter_id: Mapped[str | None]  # null: the server itself
    action: Mapped[str]  # such as "study.create"
    subject: Mapped[str | None]  # the id of what it was done to
    detail: Mapped[dict[str, Any]]


class ExperimenterRow(Row):
    """An account on the dashboard."""

    __tablename__ = "experimenter"
    __table_args__ = (CheckConstraint("role IN ('owner', 'assistant', 'viewer')", name="role"),)

    id: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)  # what they log in with, in lower case
    password_hash: Mapped[str]  # argon2
    role: Mapped[str]
    created_at: Mapped[datetime]
    disabled_at: Mapped[datetime | None]


class SetupLinkRow(Row):
    """A link that makes one account: the one of the latest start, or an invitation."""

    __tablename__ = "setup_link"

    token_hash: Mapped[str] = mapped_column(primary_key=True)
    role: Mapped[str]
    made_by: Mapped[str | None] = mapped_column(ForeignKey("experimenter.id"))  # null: the start
    created_at: Mapped[datetime]
    used_at: Mapped[datetime | None]


class LoginRow(Row):
    """An experimenter's browser; only the hash of its cookie is kept."""

    __tablename__ = "login"

    token_hash: Mapped[str] = mapped_column(primary_key=True)
    experimenter_id: Mapped[str] = mapped_column(ForeignKey("experimenter.id"), index=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]


class ApiTokenRow(Row):
    """A program's key to the API; only its hash is kept."""

    __tablename__ = "api_token"
    __table_args__ = (CheckConstraint("scope IN ('read', 'write')", name="scope"),)

    id: Mapped[str] = mapped_column(primary_key=True)
    experimenter_id: Mapped[str] = mapped_column(ForeignKey("experimenter.id"), index=True)
    name: Mapped[str]
    scope: Mapped[str]
    token_hash: Mapped[str] = mapped_column(unique=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime | None]
    used_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]
