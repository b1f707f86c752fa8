"""A study that older code ran: today's code opens it, shows it, goes on with it and exports it."""

import hashlib
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models.checkpoints import read_checkpoint
from tests.frozen import learning
from tests.frozen.compare import differences
from tests.frozen.exported import FORMATS, Export, read_csv
from tests.frozen.made import FIGURES
from tests.frozen.today import TodaysServer

# When somebody last did something, which a test sets anew, and when a key or an account was used.
SEEN = ("seen_at",)
# When an export was made, and words for people.
DATES_AND_WORDS = ("dateCreated", "description", "row", "levels")
WORDS = ("says", "title", "test", "findings")
TABLES = (
    "participants",
    "consents",
    "events",
    "queries",
    "answers",
    "trainings",
    "alignments",
    "drives",
    "responses",
    "scores",
    "notes",
    "samples",
    "props",
)


def test_the_dashboard_says_of_the_old_study_what_it_said(
    old_answers: dict[str, Any], new_answers: dict[str, Any]
) -> None:
    assert len(old_answers["api"]) > 20
    assert differences(old_answers["api"], new_answers, ignored=SEEN) == []


def test_each_participants_page_is_where_it_was(
    old_answers: dict[str, Any], new_sessions: dict[str, Any]
) -> None:
    states = {session["state"] for session in old_answers["sessions"].values()}
    assert states == {"active", "completed", "withdrawn"}
    assert differences(old_answers["sessions"], new_sessions) == []


def test_who_stopped_before_a_drive_makes_it_with_what_was_learned(
    told: list[dict[str, Any]], data_dir: Path
) -> None:
    end = told[-1]["progress"]["end"]
    assert end in ("given up", "time limit")  # whichever comes first
    assert any(message["mode"] == "driving" for message in told)
    with closing(sqlite3.connect(data_dir / "joymap.db")) as db:
        kept = "SELECT alignment_id IS NOT NULL FROM drive WHERE id = ?"
        assert db.execute(kept, (told[-1]["drive_id"],)).fetchone() == (1,)


def test_an_old_drive_is_played(server: TodaysServer, old_answers: dict[str, Any]) -> None:
    drives = [answer for address, answer in old_answers["api"].items() if address[:7] == "drives/"]
    assert len(drives) == 4
    status = server.replay(drives[0]["id"])
    assert status["ticks"] == drives[0]["ticks"]


def test_every_alignment_of_the_old_study_can_drive(data_dir: Path) -> None:
    with closing(sqlite3.connect(data_dir / "joymap.db")) as db:
        kept = db.execute("SELECT task, strategy, file, weights_sha256 FROM alignment").fetchall()
    assert len(kept) == 24
    for task, strategy, file, digest in kept:
        stem = data_dir / "alignments" / file
        learning.read_alignment(stem, task)
        assert read_checkpoint(stem).facts["strategy"] == strategy
        assert hashlib.sha256(stem.with_suffix(".safetensors").read_bytes()).hexdigest() == digest


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("table", TABLES)
def test_the_old_study_is_exported_as_it_was(
    table: str, kind: str, old_export: Export, new_export: Export
) -> None:
    columns = old_export.columns(table, kind)
    assert [name for name in new_export.columns(table, kind) if name in columns] == columns
    old, new = old_export.rows(table, kind), new_export.rows(table, kind)
    assert old
    assert differences(old, new) == []


def test_no_table_and_no_file_has_gone_from_the_export(
    old_export: Export, new_export: Export
) -> None:
    assert old_export.tables == sorted(TABLES)
    assert set(old_export.files) <= set(new_export.files)


def test_what_is_learned_from_is_exported_to_the_bit(
    old_export: Export, new_export: Export
) -> None:
    old, new = old_export.tensors(), new_export.tensors()
    assert len(old) == 9  # four people's two tasks, and the one answer of a fifth
    for name, tensors in old.items():
        for key, values in tensors.items():
            np.testing.assert_array_equal(values, new[name][key], err_msg=f"{name} {key}")
            assert values.dtype == new[name][key].dtype


def test_what_tells_programs_of_the_export_says_what_it_said(
    old_export: Export, new_export: Export
) -> None:
    assert differences(old_export.about(), new_export.about(), ignored=DATES_AND_WORDS) == []
    old, new = (
        {name: table["columns"] for name, table in export.about()["codebook.json"].items()}
        for export in (old_export, new_export)
    )
    for table, columns in old.items():
        for name, column in columns.items():
            assert set(column["levels"]) <= set(new[table][name]["levels"]), name


def test_the_drives_are_the_lerobot_dataset_that_they_were(
    old_export: Export, new_export: Export
) -> None:
    old = old_export.lerobot()
    assert old["lerobot/meta/info.json"]["total_episodes"] == 28
    assert differences(old, new_export.lerobot()) == []


@pytest.mark.parametrize("which", ["old_export", "new_export"])
def test_the_list_of_an_exports_files_is_right(which: str, request: Any) -> None:
    export: Export = request.getfixturevalue(which)
    sums = {name: hashlib.sha256(content).hexdigest() for name, content in export.real_files()}
    del sums["manifest-sha256.txt"]
    assert export.manifest() == sums


def test_the_old_export_gives_the_figures_that_it_gave(figures: Path) -> None:
    for name in ("summary.csv", "comparisons.csv"):
        old, new = (read_csv((folder / name).read_bytes()) for folder in (FIGURES, figures))
        assert old
        assert differences(old, new) == []
    old_index, new_index = (
        json.loads((folder / "figures.json").read_text()) for folder in (FIGURES, figures)
    )
    assert differences(old_index, new_index, ignored=WORDS) == []
    drawn = [
        f"{picture['name']}.{kind}" for picture in new_index["pictures"] for kind in ("png", "svg")
    ]
    assert all((figures / name).stat().st_size > 1000 for name in drawn)
