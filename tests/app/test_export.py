"""An export: whole, checked by its own manifest, described to the last column, and readable."""

import csv
import hashlib
import io
import json
import subprocess
import sys
import uuid
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from safetensors.torch import load

from app.cli import main
from app.services import enrolment, exports, flow, protocols
from app.services.export_tables import TABLES
from app.storage.database import Database
from app.storage.tables import (
    AnswerRow,
    DriveRow,
    EventRow,
    ParticipantRow,
    QueryRow,
    ResponseRow,
    SampleChunkRow,
)
from app.storage.ticks import COLUMNS, pack
from tests.app.factories import enrol, make_study, now

ROOT = Path(__file__).resolve().parents[2]
SECRET = "5f3c-external"
TICKS = 90


def give(db: Any, study: Any, words: str = "fine", **given: Any) -> ParticipantRow:
    """Somebody who answered, drove once and filled in a questionnaire."""
    participant = enrol(db, study, **given)
    rng = np.random.default_rng(participant.number)
    for position in range(1, 6):
        query_id = str(uuid.uuid4())
        db.add(
            QueryRow(
                id=query_id,
                participant_id=participant.id,
                task="avoid",
                repeats=None,
                position=position,
                pool_index=position,
                controller_hash="c",
                s=rng.normal(size=7).tolist(),
                z=[0.1, 0.2],
                next_s=rng.normal(size=7).tolist(),
                path=[[0.0] * 7] * 2,
                hand_path=[[0.0] * 3] * 2,
            )
        )
        db.flush()
        db.add(
            AnswerRow(
                id=str(uuid.uuid4()),
                participant_id=participant.id,
                query_id=query_id,
                h_x=-0.25,
                h_y=0.5,
                thinking_time_s=1.5,
                answered_at=now(),
            )
        )
    step = next(step for step in flow.here(db, participant).steps if step.kind == "block")
    drive_id = str(uuid.uuid4())
    db.add(
        DriveRow(
            id=drive_id,
            participant_id=participant.id,
            task="avoid",
            step=step.key,
            strategy=step.strategies[0],
            alignment_id=None,
            boot="b",
            started_at=now(),
            started_monotonic_s=0.0,
            ended_at=now(),
            end="done",
            outcome={"fraction": 1.0, "counts": {}, "is_success": True},
        )
    )
    db.flush()
    ticks = rng.normal(size=(TICKS, len(COLUMNS)))
    ticks[:, 0] = np.arange(TICKS) / 60
    ticks[:, COLUMNS.index("touching")] = 0.0
    db.add(
        SampleChunkRow(
            drive_id=drive_id, first_tick=0, ticks=TICKS, last_monotonic_s=2.0, samples=pack(ticks)
        )
    )
    for item, value in (("intuitive", 6), ("again", None), ("why", words)):
        db.add(
            ResponseRow(
                participant_id=participant.id,
                step="questions/avoid/1/steering",
                questionnaire="steering",
                item=item,
                value=None if value is None else json.dumps(value),
                answered_at=now(),
                received_at=now(),
            )
        )
    event = {"kind": "consent", "detail": {"version": "v"}, "at": now()}
    db.add(EventRow(id=str(uuid.uuid4()), participant_id=participant.id, **event))
    db.flush()
    return participant


@pytest.fixture
def study_id(database: Database) -> str:
    with database.write() as db:
        study = make_study(db)
        give(db, study, external_id=SECRET)
        give(db, study, words='=HYPERLINK("x")')
        left_out = give(db, study)
        enrolment.exclude(left_out, "pressed at random")
        gone = give(db, study, words="CANARY")
        enrolment.leave(db, gone, "withdrawn")
        return study.id


@pytest.fixture
def export(database: Database, study_id: str, tmp_path: Path) -> zipfile.ZipFile:
    with database.read() as db:
        counts = exports.write(db, study_id, tmp_path / "export.zip")
    assert counts["participants"] == 3
    assert counts["samples"] == 3 * TICKS
    return zipfile.ZipFile(tmp_path / "export.zip")


def sheet(export: zipfile.ZipFile, table: str, kind: str) -> bytes:
    (name,) = [n for n in export.namelist() if n.endswith(f"_{table}_data.{kind}")]
    return export.read(name)


def test_the_manifest_verifies_and_names_every_file(export: zipfile.ZipFile) -> None:
    lines = export.read("manifest-sha256.txt").decode().splitlines()
    sums = {path: digest for digest, path in (line.split("  ") for line in lines)}
    assert set(sums) == set(export.namelist()) - {"manifest-sha256.txt"}
    for path, digest in sums.items():
        assert hashlib.sha256(export.read(path)).hexdigest() == digest


@pytest.mark.parametrize("table", TABLES)
def test_a_table_is_the_same_in_every_form(export: zipfile.ZipFile, table: str) -> None:
    lines = [json.loads(line) for line in sheet(export, table, "jsonl").splitlines()]
    parquet = pq.read_table(io.BytesIO(sheet(export, table, "parquet"))).to_pylist()
    assert parquet == lines
    rows = list(csv.DictReader(io.StringIO(sheet(export, table, "csv").decode())))
    assert len(rows) == len(lines) == len(pd.read_csv(io.BytesIO(sheet(export, table, "csv"))))
    for row, line in zip(rows, lines, strict=True):
        for name, value in line.items():
            if isinstance(value, float):
                assert float(row[name]) == value
            elif isinstance(value, bool):
                assert row[name] == str(value).lower()
            else:
                assert row[name].removeprefix("'") == ("" if value is None else str(value))


def test_the_codebook_describes_every_column_there_is(export: zipfile.ZipFile) -> None:
    book = json.loads(export.read("codebook.json"))
    for table in TABLES:
        header = next(csv.reader(io.StringIO(sheet(export, table, "csv").decode())))
        assert [column["name"] for column in book[table]] == header
        assert all(column["description"] and column["type"] for column in book[table])
    samples = [column["name"] for column in book["samples"]]
    assert samples[-len(COLUMNS) :] == list(COLUMNS)


def test_nobody_can_be_recognised_and_who_withdrew_is_not_there(
    export: zipfile.ZipFile, database: Database
) -> None:
    whole = b"".join(export.read(name) for name in export.namelist())
    assert SECRET.encode() not in whole
    assert b"CANARY" not in whole
    with database.read() as db:
        for row in db.query(ParticipantRow):
            assert row.id.encode() not in whole
            assert (row.token_hash or "?").encode() not in whole
    excluded = [
        json.loads(line)["excluded"] for line in sheet(export, "participants", "jsonl").splitlines()
    ]
    assert sorted(excluded, key=str) == [None, None, "pressed at random"]


def test_cells_cannot_run_and_numbers_stay_numbers(export: zipfile.ZipFile) -> None:
    said = [
        row["value"]
        for row in csv.DictReader(io.StringIO(sheet(export, "responses", "csv").decode()))
    ]
    assert '\'=HYPERLINK("x")' in said
    answers = pd.read_csv(io.BytesIO(sheet(export, "answers", "csv")))
    assert answers["h_x"].tolist() == [-0.25] * 15


def test_tensors_are_ready_for_training(export: zipfile.ZipFile) -> None:
    found = [name for name in export.namelist() if name.startswith("tensors/")]
    assert len(found) == 3
    tensors = load(export.read(found[0]))
    assert tensors["s"].shape == tensors["s_star"].shape == (5, 7)
    assert tensors["h"].shape == (5, 2)


def test_the_frozen_protocol_is_in_it(export: zipfile.ZipFile) -> None:
    text = export.read("protocol/version-1.yaml").decode()
    assert protocols.parse_yaml(text).title == "A small study"


def test_the_command_writes_it_and_the_example_reads_it(
    database: Database, study_id: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    del database
    monkeypatch.setenv("JOYMAP_DATA_DIR", str(tmp_path))
    out = tmp_path / "out.zip"
    assert main(["export", study_id, "--out", str(out), "--without-excluded"]) == 0
    assert "2 participants" in capsys.readouterr().out
    assert main(["export", "no such study", "--out", str(out)]) == 2
    assert capsys.readouterr().err == "There is no such study.\n"
    read = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "read_export.py"), str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert read.returncode == 0, read.stderr
    assert "2 participants" in read.stdout
