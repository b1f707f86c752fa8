"""A study as a zip: every table three times over, a codebook, the protocols, tensors, a manifest.

Laid out as Psych-DS has it (psych-ds.github.io): ``dataset_description.json`` at the top, data
under ``data``, named ``study-<id>_<table>_data.csv``. Written to a file of its own, table by table
and person by person, so that a long study needs no more memory than a short one.
"""

import csv
import hashlib
import io
import json
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from safetensors.numpy import save
from sqlalchemy.orm import Session

from app.services import protocols, queries, studies
from app.services.export_tables import TABLES, Column, Names, TableRow, people, rows_of
from app.storage import participants
from app.storage import studies as storage
from app.storage.tables import ParticipantRow

_BATCH = 20_000
_ARROW = {
    "text": pa.string(),
    "time": pa.string(),
    "integer": pa.int64(),
    "number": pa.float64(),
    "boolean": pa.bool_(),
}
# What a spreadsheet would take for a formula.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def write(
    db: Session,
    study_id: str,
    file: Path,
    *,
    with_excluded: bool = True,
    note: Callable[[float], None] = lambda _done: None,
) -> dict[str, int]:
    """Write a study's export to ``file``.

    Args:
        db: One read transaction: the export is the study at one moment.
        study_id: Whose.
        file: Where to.
        with_excluded: Whether those marked as excluded are in it, marked.
        note: Called with the fraction done.

    Returns:
        How many rows each table has.

    Raises:
        NoSuchStudy: If there is none.
    """
    study = studies.find(db, study_id)
    who = people(db, study_id, with_excluded)
    names = Names()
    stem = f"study-{study_id.split('-', maxsplit=1)[0]}"
    counts: dict[str, int] = {}
    sums: list[str] = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=4) as archive:

        def put(path: str, content: bytes) -> None:
            archive.writestr(path, content)
            sums.append(f"{hashlib.sha256(content).hexdigest()}  {path}\n")

        put("dataset_description.json", _json(_description(study.title, stem)))
        put("README.md", _readme(study.title, len(who)).encode())
        put("codebook.json", _json(codebook()))
        put("codebook.md", codebook_text().encode())
        for row in storage.versions(db, study_id):
            text = protocols.as_yaml(protocols.of_row(row))
            put(f"protocol/version-{row.version}.yaml", text.encode())
        for index, (table, columns) in enumerate(TABLES.items()):
            with _Sheets(archive, f"data/{stem}_{table}_data", columns, sums) as sheets:
                for place, participant in enumerate(who):
                    for line in rows_of(db, table, participant, names):
                        sheets.add(line)
                    note((index + (place + 1) / len(who)) / len(TABLES))
            counts[table] = sheets.count
        for participant in who:
            for path, content in _tensors(db, participant, names):
                put(path, content)
        archive.writestr("manifest-sha256.txt", "".join(sums))
    note(1.0)
    return counts


class _Sheets:
    """One table as CSV, JSON Lines and Parquet at once, put into the zip when it is whole."""

    def __init__(
        self, archive: zipfile.ZipFile, stem: str, columns: tuple[Column, ...], sums: list[str]
    ) -> None:
        self._archive, self._stem, self._sums = archive, stem, sums
        self._columns = columns
        self._texts = {each.name for each in columns if each.kind in ("text", "time")}
        self._schema = pa.schema([(each.name, _ARROW[each.kind]) for each in columns])
        self.count = 0
        self._batch: list[TableRow] = []

    def __enter__(self) -> "_Sheets":
        self._open = ExitStack()
        self._files: dict[str, IO[bytes]] = {
            kind: self._open.enter_context(tempfile.TemporaryFile())  # noqa: SIM115
            for kind in ("csv", "jsonl", "parquet")
        }
        self._text = io.TextIOWrapper(self._files["csv"], "utf-8", newline="", write_through=True)
        self._csv = csv.writer(self._text)
        self._csv.writerow([each.name for each in self._columns])
        self._parquet = pq.ParquetWriter(self._files["parquet"], self._schema)
        return self

    def add(self, row: TableRow) -> None:
        """Take in a row."""
        self.count += 1
        line = {each.name: _plain(row.get(each.name), each.kind) for each in self._columns}
        self._batch.append(line)
        if len(self._batch) >= _BATCH:
            self._flush()

    def _flush(self) -> None:
        for line in self._batch:
            self._csv.writerow(
                [
                    _harmless(value) if name in self._texts else _cell(value)
                    for name, value in line.items()
                ]
            )
            self._files["jsonl"].write(json.dumps(line, allow_nan=False).encode() + b"\n")
        self._parquet.write_table(pa.Table.from_pylist(self._batch, schema=self._schema))
        self._batch = []

    def __exit__(self, *failed: object) -> None:
        self._flush()
        self._parquet.close()
        self._text.flush()
        for kind, file in self._files.items():
            path = f"{self._stem}.{kind}"
            file.seek(0)
            digest = hashlib.sha256()
            with self._archive.open(path, "w", force_zip64=True) as target:
                while block := file.read(1 << 20):
                    digest.update(block)
                    target.write(block)
            self._sums.append(f"{digest.hexdigest()}  {path}\n")
        self._open.close()


def codebook() -> dict[str, Any]:
    """Every column of every table."""
    return {
        table: [
            {"name": each.name, "type": each.kind, "unit": each.unit, "description": each.says}
            for each in columns
        ]
        for table, columns in TABLES.items()
    }


def codebook_text() -> str:
    """The codebook for people."""
    parts = ["# Codebook\n"]
    for table, columns in TABLES.items():
        parts.append(f"\n## {table}\n\n| column | type | unit | what it is |\n|---|---|---|---|\n")
        parts += [f"| {c.name} | {c.kind} | {c.unit} | {c.says} |\n" for c in columns]
    return "".join(parts)


def _tensors(db: Session, participant: ParticipantRow, names: Names) -> Iterator[tuple[str, bytes]]:
    """Labels ready for training, a file for each task with answers: s, h and s*."""
    protocol, _ = protocols.of_participant(db, participant)
    for task in protocol.tasks:
        if not participants.queries_of(db, participant.id, task.task):
            continue
        given = queries.labels_of(queries.asked(db, participant, task))
        if given:
            labels = queries.as_labels(given)
            tensors = {
                "s": np.ascontiguousarray(labels.states),
                "h": np.ascontiguousarray(labels.human_inputs),
                "s_star": np.ascontiguousarray(labels.next_states),
            }
            yield f"tensors/{names.of(participant.id)}_{task.task}.safetensors", save(tensors)


def _plain(value: Any, kind: str) -> Any:
    if value is None or (kind == "number" and not np.isfinite(value)):
        return None
    return value


def _harmless(value: str | None) -> str:
    if value is None:
        return ""
    return f"'{value}" if value.startswith(_FORMULA) else value


def _cell(value: Any) -> Any:
    return "" if value is None else (str(value).lower() if isinstance(value, bool) else value)


def _json(content: Any) -> bytes:
    return json.dumps(content, indent=2, ensure_ascii=False).encode()


def _description(title: str, stem: str) -> dict[str, Any]:
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": title,
        "description": f"{title}: how people want to steer a robot arm ({stem}).",
        "variableMeasured": sorted({c.name for columns in TABLES.values() for c in columns}),
        "dateCreated": datetime.now(UTC).isoformat(timespec="seconds"),
        "schemaVersion": "Psych-DS 1.0.0",
    }


def _readme(title: str, count: int) -> str:
    tables = "\n".join(f"* `data/*_{table}_data.*`" for table in TABLES)
    return (
        f"# {title}\n\n"
        f"{count} participants, under pseudonyms made for this export. Who withdrew is not in it;\n"
        "who was excluded is marked, with the reason. Every table is there as CSV, as JSON Lines\n"
        "and as Parquet, with the same rows; `codebook.md` says what every column is.\n\n"
        f"{tables}\n"
        "* `tensors/<participant>_<task>.safetensors`: s, h and s*, ready for training\n"
        "* `protocol/`: every version of the protocol\n"
        "* `manifest-sha256.txt`: check it with `sha256sum -c manifest-sha256.txt`\n\n"
        "In the CSV files a text that a spreadsheet would take for a formula begins with a '.\n"
    )
