"""A study with something in every table, and what an export of it holds."""

import csv
import io
import json
import uuid
import zipfile
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.services import enrolment, exports, flow
from app.services.export_package import Zip
from app.storage.database import Database
from app.storage.tables import (
    AlignmentRow,
    AnswerRow,
    DriveRow,
    EventRow,
    ExperimenterRow,
    JobRow,
    NoteRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
    SampleChunkRow,
    StudyRow,
)
from app.storage.ticks import COLUMNS, pack, pack_props
from tests.app.factories import enrol, make_study, now

EPISODES = "lerobot/meta/episodes/chunk-000/file-000.parquet"
SECRET = "5f3c-external"
TICKS = 90
BEADS = 20
WAYS = {
    "questionnaires": {
        "after_each_strategy": ["steering", "sus"],
        "after_each_task": ["preference"],
    }
}


def make_query(db: Session, who: ParticipantRow, position: int, **changes: Any) -> QueryRow:
    rng = np.random.default_rng([who.number, position])
    row = QueryRow(
        **{
            "id": str(uuid.uuid4()),
            "participant_id": who.id,
            "task": "avoid",
            "repeats": None,
            "position": position,
            "pool_index": position,
            "controller_hash": "c",
            "s": rng.normal(size=7).tolist(),
            "z": [0.1, 0.2],
            "next_s": rng.normal(size=7).tolist(),
            "path": [[0.0] * 7] * 2,
            "hand_path": [[0.0, 0.1, 0.2]] * 2,
        }
        | changes
    )
    db.add(row)
    db.flush()
    return row


def answer(db: Session, query: QueryRow, h: tuple[float, float] | None = (-0.25, 0.5)) -> None:
    h_x, h_y = h if h is not None else (None, None)
    db.add(
        AnswerRow(
            id=str(uuid.uuid4()),
            participant_id=query.participant_id,
            query_id=query.id,
            h_x=h_x,
            h_y=h_y,
            thinking_time_s=1.5,
            answered_at=now(),
        )
    )


def drive(db: Session, who: ParticipantRow, task: str, ticks: int = TICKS) -> DriveRow:
    """A drive in the first block of a task; of one with a cup its props as well."""
    step = next(s for s in flow.here(db, who).steps if s.kind == "block" and s.task == task)
    row = DriveRow(
        id=str(uuid.uuid4()),
        participant_id=who.id,
        task=task,
        step=step.key,
        strategy=step.strategies[0],
        alignment_id=None,
        boot="b",
        started_at=now(),
        started_monotonic_s=0.0,
        ended_at=now(),
        end="done",
        outcome={"fraction": 1.0, "counts": {"touches": 0}, "is_success": True},
    )
    db.add(row)
    db.flush()
    rng = np.random.default_rng(who.number)
    rows = rng.normal(size=(ticks, len(COLUMNS)))
    rows[:, 0] = np.arange(ticks) / 60
    rows[:, COLUMNS.index("hold")] = 1.0
    rows[:, COLUMNS.index("touching")] = 0.0 if task == "avoid" else np.nan
    props = rng.normal(size=(ticks, 7 + 3 * BEADS)) if task == "pour-cup" else np.zeros((ticks, 0))
    for first in range(0, ticks, 30):
        part = slice(first, min(first + 30, ticks))
        db.add(
            SampleChunkRow(
                drive_id=row.id,
                first_tick=first,
                ticks=len(rows[part]),
                last_monotonic_s=2.0,
                samples=pack(rows[part]),
                props=pack_props(props[part]),
            )
        )
    db.flush()
    return row


def respond(db: Session, who: ParticipantRow, step: str, **values: Any) -> None:
    for item, value in values.items():
        db.add(
            ResponseRow(
                participant_id=who.id,
                step=step,
                questionnaire=step.rsplit("/", maxsplit=1)[-1],
                item=item.replace("_", "-"),
                value=None if value is None else json.dumps(value),
                answered_at=now(),
                received_at=now(),
            )
        )


def learn(db: Session, who: ParticipantRow) -> None:
    job = JobRow(
        id=str(uuid.uuid4()),
        participant_id=who.id,
        task="avoid",
        state="succeeded",
        attempt=1,
        data_hash="d",
        seed=1,
        report={},
        fraction=1.0,
        error=None,
        training_s=0.5,
        queued_at=now(),
        ended_at=now(),
    )
    db.add(job)
    db.flush()
    db.add(
        AlignmentRow(
            id=str(uuid.uuid4()),
            participant_id=who.id,
            job_id=job.id,
            task="avoid",
            strategy="all-priors",
            file="f",
            weights_sha256="w",
            data_hash="d",
            controller_hash="c",
            seed=1,
            settings={"steps": 10},
            code_version="1",
            trained_at=now(),
        )
    )


def note(db: Session, who: ParticipantRow, text: str) -> None:
    if db.get(ExperimenterRow, "experimenter-1") is None:
        db.add(
            ExperimenterRow(
                id="experimenter-1",
                name="ada-of-the-lab",
                password_hash="h",
                role="owner",
                created_at=now(),
                disabled_at=None,
            )
        )
        db.flush()
    db.add(
        NoteRow(
            id=str(uuid.uuid4()),
            participant_id=who.id,
            experimenter_id="experimenter-1",
            text=text,
            written_at=now(),
        )
    )


def give(db: Session, study: StudyRow, words: str = "fine", **given: Any) -> ParticipantRow:
    """Somebody who answered, drove twice, filled in questionnaires, and of whom there is a note."""
    who = enrol(db, study, **given)
    detail = {"version": "t", "protocol": 1}
    db.add(
        EventRow(
            id=str(uuid.uuid4()), participant_id=who.id, kind="consent", detail=detail, at=now()
        )
    )
    asked = [make_query(db, who, position) for position in range(1, 6)]
    for query in asked:
        answer(db, query)
    answer(db, asked[0])  # anew
    again = make_query(db, who, 11, repeats=asked[0].id)
    answer(db, again, None)
    learn(db, who)
    drive(db, who, "avoid")
    drive(db, who, "pour-cup")
    respond(db, who, "questions/avoid/1/steering", intuitive=6, again=None)
    respond(db, who, "questions/avoid/1/sus", **{f"sus_{i}": 3 for i in range(1, 11)})
    respond(db, who, "questions/avoid/after/preference", best=2, why=words)
    note(db, who, words)
    db.flush()
    return who


def make_whole_study(db: Session) -> str:
    """A study of three people with data, one of them excluded, one withdrawn, and one new."""
    study = make_study(db, **WAYS)
    give(db, study, external_id=SECRET)
    give(db, study, words='=HYPERLINK("x")')
    left_out = give(db, study)
    enrolment.exclude(left_out, "pressed at random")
    gone = give(db, study, words="CANARY")
    enrolment.leave(db, gone, "withdrawn")
    enrol(db, study)  # and has done nothing yet
    return study.id


def export_of(database: Database, study_id: str, **options: Any) -> zipfile.ZipFile:
    target = io.BytesIO()
    with database.read() as db:
        exports.write(db, study_id, Zip(target), **options)
    return zipfile.ZipFile(target)


def sheet(export: zipfile.ZipFile, table: str, kind: str) -> bytes:
    (name,) = [n for n in export.namelist() if n.endswith(f"_description-{table}_data.{kind}")]
    return export.read(name)


def lines_of(export: zipfile.ZipFile, table: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in sheet(export, table, "jsonl").splitlines()]


def csv_of(content: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(content.decode(), newline="")))
