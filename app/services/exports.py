"""Everything a study gave, ready for analysis: tables, tensors, protocols, and what they mean.

Laid out as Psych-DS has it (psych-ds.github.io): ``dataset_description.json`` at the top, data
under ``data``, named ``study-<title>_description-<table>_data.csv``. It is written file by file,
person by person and drive by drive, each file from its beginning to its end: a long study needs no
more memory than a short one, and what is made can be sent at once.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa
from safetensors.numpy import save
from sqlalchemy.orm import Session

from app.analysis import codebook
from app.services import protocols, queries, studies
from app.services.export_lerobot import write_lerobot
from app.services.export_package import MANIFEST, Package
from app.services.export_sheets import as_tables, write_sheets
from app.services.export_tables import Source, TableRow, people, rows_of
from app.services.export_ticks import props_of, samples_of
from app.storage import participants
from app.storage import studies as storage
from app.storage.tables import ParticipantRow, StudyRow

_TICKS = {"samples": samples_of, "props": props_of}
_WORK = {"samples": 50, "props": 100}  # of a form of a table; the others' is 1


def write(
    db: Session,
    study_id: str,
    package: Package,
    *,
    with_excluded: bool = True,
    with_lerobot: bool = True,
    ticks_per_s: float = 60.0,
    note: Callable[[float], None] = lambda _done: None,
) -> dict[str, int]:
    """Write a study's export.

    Args:
        db: One read transaction: the export is the study at one moment.
        study_id: Whose.
        package: Where to; ended with it.
        with_excluded: Whether those marked as excluded are in it, marked.
        with_lerobot: Whether the drives are in it as a LeRobot dataset as well.
        ticks_per_s: Of the control loop.
        note: Called with the fraction done.

    Returns:
        How many rows each table has.

    Raises:
        NoSuchStudy: If there is none.
    """
    study = studies.find(db, study_id)
    who = people(db, study_id, with_excluded)
    source = Source(db)
    stem = f"data/study-{_slug(study.title)}_description"
    # Each table is gone through once for each form.
    work = 3 * sum(_WORK.get(name, 1) for name in codebook.TABLES) + with_lerobot * _WORK["samples"]
    done = 0.0

    def each(share: float) -> Iterator[ParticipantRow]:
        nonlocal done
        for participant in who:
            yield participant
            done += share / len(who)
            note(done / work)

    def rows(name: str) -> Iterable[pa.Table]:
        people = each(_WORK.get(name, 1))
        if name in _TICKS:
            return chain.from_iterable(_TICKS[name](source, one) for one in people)
        made = chain.from_iterable(rows_of(source, name, one) for one in people)
        return as_tables(made, codebook.TABLES[name].columns)

    counts = {}
    with package:
        _put_words(package, db, study, len(who), with_lerobot)
        for name, table in codebook.TABLES.items():
            sheets = f"{stem}-{name}_data"
            counts[name] = write_sheets(package, sheets, table.columns, partial(rows, name))
        for participant in who:
            _put_tensors(package, source, participant)
        if with_lerobot:
            drives = chain.from_iterable(rows_of(source, "drives", one) for one in who)
            write_lerobot(package, drives, rows("samples"), round(ticks_per_s))
    note(1.0)
    return counts


def _put_words(
    package: Package, db: Session, study: StudyRow, count: int, with_lerobot: bool
) -> None:
    """What the data are and mean."""
    package.put("dataset_description.json", _json(_description(study.title)))
    package.put("README.md", _readme(study.title, count, with_lerobot))
    package.put("codebook.json", _json(codebook.as_json()))
    package.put("codebook.md", codebook.as_text())
    changes = [f"* {datetime.now(UTC):%Y-%m-%d}: exported\n"]
    for row in storage.versions(db, study.id):
        version = protocols.as_yaml(protocols.of_row(row))
        package.put(f"protocol/version-{row.version}.yaml", version)
        when = "never used" if row.frozen_at is None else f"used from {row.frozen_at:%Y-%m-%d}"
        changes.append(f"* {row.created_at:%Y-%m-%d}: version {row.version}, {when}\n")
    package.put("CHANGES.md", "# Changes\n\n" + "".join(changes))


def _put_tensors(package: Package, source: Source, participant: ParticipantRow) -> None:
    """Labels ready for training, a file for each task with answers: s, h and s*."""
    protocol, _ = protocols.of_participant(source.db, participant)
    for task in protocol.tasks:
        if not participants.queries_of(source.db, participant.id, task.task):
            continue
        given = queries.labels_of(queries.asked(source.db, participant, task))
        if given:
            labels = queries.as_labels(given)
            tensors = {
                "s": np.ascontiguousarray(labels.states),
                "h": np.ascontiguousarray(labels.human_inputs),
                "s_star": np.ascontiguousarray(labels.next_states),
            }
            name = f"{source.names.of(participant.id)}_{task.task}"
            package.put(f"tensors/{name}.safetensors", save(tensors))


def _slug(title: str) -> str:
    """A title as Psych-DS wants values: letters and digits alone."""
    return re.sub(r"[^a-z0-9]", "", title.lower())[:40] or "untitled"


def _json(content: Any) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False)


def _description(title: str) -> TableRow:
    columns = {
        column.name: column for table in codebook.TABLES.values() for column in table.columns
    }
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": title,
        "description": f"{title}: how people want to steer a robot arm, and how they steered it.",
        "schemaVersion": "Psych-DS 1.0.0",
        "dateCreated": datetime.now(UTC).isoformat(timespec="seconds"),
        "variableMeasured": [
            {
                "@type": "PropertyValue",
                "name": name,
                "description": column.says,
                **({"unitText": column.unit} if column.unit else {}),
            }
            for name, column in columns.items()
        ],
    }


def _readme(title: str, count: int, with_lerobot: bool) -> str:
    tables = "\n".join(
        f"* `data/*_description-{name}_data.*`: a row is {table.row}"
        for name, table in codebook.TABLES.items()
    )
    lerobot = "* `lerobot/`: the drives as a LeRobot v3 dataset, if there are any\n"
    return (
        f"# {title}\n\n"
        f"{count} participants, under pseudonyms made for this export. Who withdrew is not in it;\n"
        "who was excluded is marked in the table of participants, with the reason. What people\n"
        "and experimenters wrote in their own words is as they wrote it: read it before you\n"
        "share it.\n\n"
        "Every table is there as CSV, as JSON Lines and as Parquet, with the same rows;\n"
        "`codebook.md` says what every column is.\n\n"
        f"{tables}\n"
        "* `tensors/<participant>_<task>.safetensors`: s, h and s*, ready for training\n"
        f"{lerobot if with_lerobot else ''}"
        "* `protocol/`: every version of the protocol\n"
        f"* `{MANIFEST}`: check it with `sha256sum -c {MANIFEST}`\n\n"
        "In the CSV files a ' stands before a text that a spreadsheet would take for a formula,\n"
        "and before one that begins with a '; the other files have it as it is.\n"
    )
