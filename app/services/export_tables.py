"""A study's tables, row by row, as they leave the house: tidy, with names, units and no secrets.

Who withdrew is left out; who was excluded is marked. Participants are called by the pseudonyms that
:class:`Names` makes for one export.
"""

import hashlib
import hmac
import json
import secrets
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.services import flow, records
from app.services.records import NothingRecorded
from app.storage.tables import (
    AnswerRow,
    DriveRow,
    EventRow,
    JobRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
    SampleChunkRow,
)
from app.storage.ticks import COLUMNS, unpack

TableRow = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: As in the files.
        kind: "text", "integer", "number", "boolean" or "time".
        unit: Of a number; "" if it has none.
        says: What it is.
    """

    name: str
    kind: str
    unit: str
    says: str


@dataclass(frozen=True)
class Names:
    """Pseudonyms: the same within an export, another each time, and no way back from them."""

    key: bytes = field(default_factory=lambda: secrets.token_bytes(32))

    def of(self, real: str) -> str:
        """What a participant, query or drive is called."""
        return hmac.new(self.key, real.encode(), hashlib.sha256).hexdigest()[:16]


_WHO = Column("participant", "text", "", "pseudonym of the participant, made for this export")
_TASK = Column("task", "text", "", "the robot task")
_SAMPLE_COLUMNS = (
    Column("monotonic_s", "number", "s", "the server's monotonic clock"),
    Column("raw_x", "number", "1", "stick as the page sent it, right is positive, in [-1, 1]"),
    Column("raw_y", "number", "1", "stick as the page sent it, up is positive, in [-1, 1]"),
    Column("h_x", "number", "1", "stick as the alignment got it, right is positive, in [-1, 1]"),
    Column("h_y", "number", "1", "stick as the alignment got it, up is positive, in [-1, 1]"),
    *(Column(f"z_{i}", "number", "1", f"latent action {i}") for i in (1, 2)),
    *(Column(f"a_{j}", "number", "rad/s", f"velocity asked of joint {j}") for j in range(1, 8)),
    *(Column(f"q_{j}", "number", "rad", f"position of joint {j}") for j in range(1, 8)),
    *(Column(f"hand_{x}", "number", "m", f"hand along {x} of the base") for x in "xyz"),
    *(Column(f"hand_q{i}", "number", "1", f"hand's unit quaternion, {i}") for i in "wxyz"),
    Column("hold", "number", "", "0 moved, 1 released, 2 silent, 3 edge, 4 homing, 5 by itself"),
    Column("touching", "number", "", "1 while arm or hand touch the obstacle, else 0"),
)

TABLES: dict[str, tuple[Column, ...]] = {
    "participants": (
        _WHO,
        Column("state", "text", "", "active, completed or abandoned"),
        Column("excluded", "text", "", "why the data are to be left out; empty: they are not"),
        Column("protocol_version", "integer", "", "the version they took part under"),
        Column("cell", "integer", "", "which of the design's orders they got"),
        Column("order", "text", "", "the strategies in their order, joined by >"),
        Column("step", "text", "", "the key of the step they reached"),
        Column("place", "integer", "", "the number of that step, from 0"),
        Column("enrolled_at", "time", "", "when they were enrolled, UTC"),
        Column("ended_at", "time", "", "when they were done, UTC"),
        Column("stick_settings", "text", "", "how their stick was set, JSON; empty: as it comes"),
    ),
    "events": (
        _WHO,
        Column("event", "text", "", "the key of the step they left, or stick, moved-cell"),
        Column("at", "time", "", "the server's time, UTC"),
        Column("detail", "text", "", "JSON; of a consent the names of text and protocol"),
    ),
    "queries": (
        _WHO,
        Column("query", "text", "", "pseudonym of the query"),
        _TASK,
        Column("position", "integer", "", "the order of asking, from 1"),
        Column("repeats", "text", "", "the query that it asks once more; empty: it is new"),
        *(Column(f"s_{j}", "number", "rad", f"joint {j} before the move") for j in range(1, 8)),
        *(Column(f"z_{i}", "number", "1", f"latent action {i}, held") for i in (1, 2)),
        *(Column(f"s_star_{j}", "number", "rad", f"joint {j} 0.1 s later") for j in range(1, 8)),
    ),
    "answers": (
        _WHO,
        Column("query", "text", "", "pseudonym of the query"),
        _TASK,
        Column("position", "integer", "", "the query's place in the order of asking"),
        Column("h_x", "number", "1", "stick to the right, in [-1, 1]; empty: they could not say"),
        Column("h_y", "number", "1", "stick up, in [-1, 1]; empty: they could not say"),
        Column("thinking_time_s", "number", "s", "by the page's clock"),
        Column("answered_at", "time", "", "the server's time, UTC"),
        Column("counts", "boolean", "", "whether it is the last one given for its query"),
    ),
    "trainings": (
        _WHO,
        _TASK,
        Column("state", "text", "", "queued, running, succeeded or failed"),
        Column("attempts", "integer", "", "how often a worker began it"),
        Column("training_s", "number", "s", "how long it took"),
        Column("data_hash", "text", "", "SHA-256 of all that it learned from"),
        Column("queued_at", "time", "", "UTC"),
    ),
    "drives": (
        _WHO,
        Column("drive", "text", "", "pseudonym of the drive"),
        _TASK,
        Column("step", "text", "", "the key of the block"),
        Column("strategy", "text", "", "the strategy driven under"),
        Column("started_at", "time", "", "the server's time, UTC"),
        Column("end", "text", "", "done, given up, time limit, switched, left or server stopped"),
        Column("ticks", "integer", "", "how many samples were recorded"),
        Column("is_success", "boolean", "", "whether the task was achieved; empty: it has no goal"),
        Column("fraction", "number", "1", "how far the task was, from 0 to 1"),
        Column("completion_time_s", "number", "s", "from its first sample to its last"),
        Column("path_length_m", "number", "m", "how far the hand went"),
        Column("undo_share", "number", "1", "share of the time with the stick turned back"),
        Column("idle_time_s", "number", "s", "time with the stick let go"),
        Column("evenness", "number", "1", "how evenly the stick's directions were used"),
        Column("touches", "integer", "", "touches of the obstacle; empty: there is none"),
        Column("spills", "integer", "", "beads beside every vessel; empty: there are none"),
    ),
    "responses": (
        _WHO,
        Column("step", "text", "", "the key of the questionnaire's step"),
        _TASK,
        Column("way", "integer", "", "which way of steering it is about; empty: the whole task"),
        Column("strategy", "text", "", "the strategy of that way"),
        Column("questionnaire", "text", "", "its name"),
        Column("item", "text", "", "the item's key"),
        Column("value", "text", "", "a number, or words; empty: declined"),
        Column("is_declined", "boolean", "", "whether they would rather not say"),
        Column("answered_at", "time", "", "by the page's clock, UTC"),
        Column("received_at", "time", "", "by the server's clock, UTC"),
    ),
    "samples": (
        _WHO,
        Column("drive", "text", "", "pseudonym of the drive"),
        _TASK,
        Column("strategy", "text", "", "the strategy driven under"),
        Column("tick", "integer", "", "the number of the sample in its drive, from 0"),
        *_SAMPLE_COLUMNS,
    ),
}


def people(db: Session, study_id: str, with_excluded: bool = True) -> list[ParticipantRow]:
    """Whose data leave: everyone but those who withdrew."""
    rows = db.scalars(
        select(ParticipantRow)
        .where(ParticipantRow.study_id == study_id, ParticipantRow.state != "withdrawn")
        .order_by(ParticipantRow.number)
    )
    return [row for row in rows if with_excluded or row.excluded is None]


def rows_of(db: Session, table: str, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    """One participant's rows of a table, in order."""
    name = {"participant": names.of(who.id)}
    for row in _ROWS[table](db, who, names):
        yield name | row


def _participants(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    del names
    at = flow.here(db, who)
    yield {
        "state": who.state,
        "excluded": who.excluded,
        "protocol_version": at.version,
        "cell": who.cell,
        "order": ">".join(at.order),
        "step": at.step.key,
        "place": at.place,
        "enrolled_at": _iso(who.created_at),
        "ended_at": _iso(who.ended_at),
        "stick_settings": None if who.stick is None else json.dumps(who.stick, sort_keys=True),
    }


def _events(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    del names
    for row in _all(db, EventRow, who.id, EventRow.at):
        detail = json.dumps(row.detail, sort_keys=True)
        yield {"event": row.kind, "at": _iso(row.at), "detail": detail}


def _queries(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    for row in _all(db, QueryRow, who.id, QueryRow.task, QueryRow.position):
        yield {
            "query": names.of(row.id),
            "task": row.task,
            "position": row.position,
            "repeats": None if row.repeats is None else names.of(row.repeats),
            **{f"s_{j}": value for j, value in enumerate(row.s, start=1)},
            **{f"z_{i}": value for i, value in enumerate(row.z, start=1)},
            **{f"s_star_{j}": value for j, value in enumerate(row.next_s, start=1)},
        }


def _answers(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    asked = {row.id: row for row in _all(db, QueryRow, who.id, QueryRow.position)}
    given = _all(db, AnswerRow, who.id, AnswerRow.sequence)
    last = {row.query_id: row.sequence for row in given}
    for row in given:
        yield {
            "query": names.of(row.query_id),
            "task": asked[row.query_id].task,
            "position": asked[row.query_id].position,
            "h_x": row.h_x,
            "h_y": row.h_y,
            "thinking_time_s": row.thinking_time_s,
            "answered_at": _iso(row.answered_at),
            "counts": last[row.query_id] == row.sequence,
        }


def _trainings(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    del names
    for row in _all(db, JobRow, who.id, JobRow.queued_at):
        yield {
            "task": row.task,
            "state": row.state,
            "attempts": row.attempt,
            "training_s": row.training_s,
            "data_hash": row.data_hash,
            "queued_at": _iso(row.queued_at),
        }


def _drives(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    for row in _all(db, DriveRow, who.id, DriveRow.started_at):
        outcome = row.outcome or {}
        line = {
            "drive": names.of(row.id),
            "task": row.task,
            "step": row.step,
            "strategy": row.strategy,
            "started_at": _iso(row.started_at),
            "end": row.end,
            "ticks": 0,
            "is_success": outcome.get("is_success"),
            "fraction": outcome.get("fraction"),
        }
        try:
            record = records.read(db, row.id)
        except NothingRecorded:
            yield line
            continue
        measures = asdict(record.measures())
        wanted = {column.name for column in TABLES["drives"]}
        line |= {key: value for key, value in measures.items() if key in wanted}
        line["ticks"] = len(record.rows)
        yield line


def _responses(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    del names
    at = flow.here(db, who)
    for row in _all(db, ResponseRow, who.id, ResponseRow.id):
        step = at.block(row.step)
        way = None if step is None else step.position
        value = None if row.value is None else json.loads(row.value)
        yield {
            "step": row.step,
            "task": None if step is None else step.task,
            "way": way,
            "strategy": None if way is None else at.order[way - 1],
            "questionnaire": row.questionnaire,
            "item": row.item,
            "value": None if value is None else str(value),
            "is_declined": value is None,
            "answered_at": _iso(row.answered_at),
            "received_at": _iso(row.received_at),
        }


def _samples(db: Session, who: ParticipantRow, names: Names) -> Iterator[TableRow]:
    for drive in _all(db, DriveRow, who.id, DriveRow.started_at):
        line = {"drive": names.of(drive.id), "task": drive.task, "strategy": drive.strategy}
        chunks = db.scalars(
            select(SampleChunkRow)
            .where(SampleChunkRow.drive_id == drive.id)
            .order_by(SampleChunkRow.first_tick)
        )
        for chunk in chunks:
            for tick, values in enumerate(unpack(chunk.samples).tolist(), start=chunk.first_tick):
                yield line | {"tick": tick} | dict(zip(COLUMNS, values, strict=True))


_ROWS = {
    "participants": _participants,
    "events": _events,
    "queries": _queries,
    "answers": _answers,
    "trainings": _trainings,
    "drives": _drives,
    "responses": _responses,
    "samples": _samples,
}


def _all(db: Session, table: Any, participant_id: str, *order: Any) -> list[Any]:
    statement = select(table).where(table.participant_id == participant_id).order_by(*order)
    return list(db.scalars(statement))


def _iso(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="milliseconds")
