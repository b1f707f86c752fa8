"""A study's tables, row by row, as they leave the house: tidy, and without secrets.

Participants, queries, drives and all else with an id are called by the pseudonyms that
:class:`Names` makes for one export. The columns are described in :mod:`app.analysis.codebook`.
"""

import hashlib
import hmac
import json
import secrets
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from datetime import datetime
from itertools import groupby
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.analysis.codebook import MEASURES
from app.services import flow, questionnaires, records
from app.services.records import NothingRecorded
from app.storage import drives, participants
from app.storage.tables import (
    AlignmentRow,
    AnswerRow,
    EventRow,
    JobRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
)

TableRow = dict[str, Any]


@dataclass(frozen=True)
class Names:
    """Pseudonyms: the same within an export, another each time, and no way back from them."""

    key: bytes = field(default_factory=lambda: secrets.token_bytes(32))

    def of(self, real: str) -> str:
        """What a participant, query or drive is called."""
        return hmac.new(self.key, real.encode(), hashlib.sha256).hexdigest()[:16]

    def of_any(self, real: str | None) -> str | None:
        """The same, of what there may be none of."""
        return None if real is None else self.of(real)


@dataclass(frozen=True)
class Source:
    """Where the rows come from.

    Attributes:
        db: One read transaction: every table is of the same moment.
        names: Of this export.
        measured: The measures of drives, by the real id, as far as they are worked out.
    """

    db: Session
    names: Names = field(default_factory=Names)
    measured: dict[str, TableRow] = field(default_factory=dict)


def people(db: Session, study_id: str, with_excluded: bool = True) -> list[ParticipantRow]:
    """Whose data leave: everyone but those who withdrew, in the order in which they came."""
    rows = db.scalars(
        select(ParticipantRow)
        .where(ParticipantRow.study_id == study_id, ParticipantRow.state != "withdrawn")
        .order_by(ParticipantRow.number)
    )
    return [row for row in rows if with_excluded or row.excluded is None]


def rows_of(source: Source, table: str, who: ParticipantRow) -> Iterator[TableRow]:
    """One participant's rows of a table, in order."""
    name = {"participant": source.names.of(who.id)}
    for row in _ROWS[table](source, who):
        yield name | row


def _participants(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    at = flow.here(source.db, who)
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
        "stick_settings": None if who.stick is None else _json(who.stick),
    }


def _consents(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row in _all(source, EventRow, who, EventRow.at, EventRow.id):
        if row.kind == "consent":
            yield {
                "agreed_at": _iso(row.at),
                "protocol_version": row.detail.get("protocol"),
                "text_version": row.detail.get("version"),
            }


def _events(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row in _all(source, EventRow, who, EventRow.at, EventRow.id):
        yield {"event": row.kind, "at": _iso(row.at), "detail": _json(row.detail)}


def _queries(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row in _all(source, QueryRow, who, QueryRow.task, QueryRow.position):
        yield {
            "query": source.names.of(row.id),
            "task": row.task,
            "position": row.position,
            "repeats": source.names.of_any(row.repeats),
            **{f"s_{j}": value for j, value in enumerate(row.s, start=1)},
            **{f"z_{i}": value for i, value in enumerate(row.z, start=1)},
            **{f"s_star_{j}": value for j, value in enumerate(row.next_s, start=1)},
            "hand_path": _json(row.hand_path),
        }


def _answers(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    asked = {row.id: row for row in _all(source, QueryRow, who, QueryRow.position)}
    given = _all(source, AnswerRow, who, AnswerRow.sequence)
    last = {row.query_id: row.sequence for row in given}
    for row in given:
        yield {
            "query": source.names.of(row.query_id),
            "task": asked[row.query_id].task,
            "position": asked[row.query_id].position,
            "h_x": row.h_x,
            "h_y": row.h_y,
            "thinking_time_s": row.thinking_time_s,
            "answered_at": _iso(row.answered_at),
            "counts": last[row.query_id] == row.sequence,
        }


def _trainings(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row in _all(source, JobRow, who, JobRow.queued_at, JobRow.id):
        yield {
            "training": source.names.of(row.id),
            "task": row.task,
            "state": row.state,
            "attempts": row.attempt,
            "training_s": row.training_s,
            "curves": _json({name: part["curve"] for name, part in row.report.items()}),
            "data_hash": row.data_hash,
            "queued_at": _iso(row.queued_at),
            "ended_at": _iso(row.ended_at),
        }


def _alignments(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row in _all(source, AlignmentRow, who, AlignmentRow.trained_at, AlignmentRow.id):
        yield {
            "alignment": source.names.of(row.id),
            "training": source.names.of(row.job_id),
            "task": row.task,
            "strategy": row.strategy,
            "settings": _json(row.settings),
            "data_hash": row.data_hash,
            "controller_hash": row.controller_hash,
            "weights_sha256": row.weights_sha256,
            "code_version": row.code_version,
            "trained_at": _iso(row.trained_at),
        }


def _drives(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    at = flow.here(source.db, who)
    for row in drives.of_participant(source.db, who.id):
        if row.id not in source.measured:
            source.measured[row.id] = _measures(source.db, row.id)
        step = at.block(row.step)
        outcome = row.outcome or {}
        yield {
            "drive": source.names.of(row.id),
            "task": row.task,
            "step": row.step,
            "way": None if step is None else step.position,
            "strategy": row.strategy,
            "alignment": source.names.of_any(row.alignment_id),
            "started_at": _iso(row.started_at),
            "ended_at": _iso(row.ended_at),
            "end": row.end,
            "fraction": outcome.get("fraction"),
            **source.measured[row.id],
        }


def _measures(db: Session, drive_id: str) -> TableRow:
    try:
        record = records.read(db, drive_id)
    except NothingRecorded:
        return {"ticks": 0}
    measures = asdict(record.measures())
    measures["counts"] = _json(measures["counts"]) if measures["counts"] else None
    row = {column.name: measures[column.name] for column in MEASURES}
    return row | {"ticks": len(record.rows)}


def _responses(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    at = flow.here(source.db, who)
    for row in _all(source, ResponseRow, who, ResponseRow.id):
        value: int | str | None = None if row.value is None else json.loads(row.value)
        number = value if isinstance(value, int) else None
        questionnaire = questionnaires.find(at.protocol, row.questionnaire)
        items = () if questionnaire is None else questionnaire.items
        is_choice = any(item.key == row.item and item.kind == "strategy" for item in items)
        yield {
            **_about(at, row.step),
            "questionnaire": row.questionnaire,
            "item": row.item,
            "value": None if value is None else str(value),
            "number": None if is_choice else number,
            "chosen": at.order[number - 1] if is_choice and number is not None else None,
            "is_declined": value is None,
            "answered_at": _iso(row.answered_at),
            "received_at": _iso(row.received_at),
        }


def _scores(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    at = flow.here(source.db, who)
    rows = _all(source, ResponseRow, who, ResponseRow.id)
    for (step, name), given in groupby(rows, key=lambda row: (row.step, row.questionnaire)):
        # A study's own questionnaire may bear the name of a published one.
        if questionnaires.find(at.protocol, name) != questionnaires.LIBRARY.get(name):
            continue
        values = {row.item: None if row.value is None else json.loads(row.value) for row in given}
        for score, value in questionnaires.score(name, values).items():
            yield {**_about(at, step), "questionnaire": name, "score": score, "value": value}


def _about(at: flow.Here, key: str) -> TableRow:
    """What a step's questionnaire is about."""
    step = at.block(key)
    way = None if step is None else step.position
    return {
        "step": key,
        "task": None if step is None else step.task,
        "way": way,
        "strategy": None if way is None else at.order[way - 1],
    }


def _notes(source: Source, who: ParticipantRow) -> Iterator[TableRow]:
    for row, _ in participants.notes_of(source.db, who.id):
        yield {
            "author": source.names.of(row.experimenter_id),
            "text": row.text,
            "written_at": _iso(row.written_at),
        }


_ROWS = {
    "participants": _participants,
    "consents": _consents,
    "events": _events,
    "queries": _queries,
    "answers": _answers,
    "trainings": _trainings,
    "alignments": _alignments,
    "drives": _drives,
    "responses": _responses,
    "scores": _scores,
    "notes": _notes,
}


def _all(source: Source, table: Any, who: ParticipantRow, *order: Any) -> list[Any]:
    statement = select(table).where(table.participant_id == who.id).order_by(*order)
    return list(source.db.scalars(statement))


def _json(content: Any) -> str:
    return json.dumps(content, sort_keys=True, ensure_ascii=False)


def _iso(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="milliseconds")
