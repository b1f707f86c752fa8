"""An export: whole, checked by its own manifest, described to the last column, and readable."""

import csv
import gc
import hashlib
import io
import json
import re
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.torch import load

from app.analysis.codebook import (
    BEAD_COLUMNS,
    CUP_COLUMNS,
    MEASURES,
    SAMPLE_COLUMNS,
    TABLES,
    Column,
)
from app.analysis.measures import Measures
from app.services import exports, overview, protocols, questionnaires
from app.services.export_package import Folder, Zip
from app.services.export_sheets import as_tables, write_sheets
from app.storage.database import Database
from app.storage.tables import (
    AlignmentRow,
    AnswerRow,
    DriveRow,
    JobRow,
    ParticipantRow,
    QueryRow,
    SampleChunkRow,
)
from app.storage.ticks import COLUMNS, unpack_props
from tests.app.exported import (
    EPISODES,
    SECRET,
    TICKS,
    WAYS,
    csv_of,
    export_of,
    give,
    lines_of,
    make_whole_study,
    sheet,
)
from tests.app.factories import make_study


@pytest.fixture
def study_id(database: Database) -> str:
    with database.write() as db:
        return make_whole_study(db)


@pytest.fixture
def export(database: Database, study_id: str) -> zipfile.ZipFile:
    return export_of(database, study_id)


def assert_same(columns: tuple[Column, ...], sheet: bytes, lines: bytes, parquet: bytes) -> None:
    """The three forms of a table hold the same rows."""
    rows = [json.loads(line) for line in lines.splitlines()]
    assert pq.read_table(io.BytesIO(parquet)).to_pylist() == rows
    cells = csv_of(sheet)
    assert len(cells) == len(rows)
    for cell, row in zip(cells, rows, strict=True):
        for column in columns:
            value, written = row[column.name], cell[column.name]
            if value is None:
                assert written == ""
            elif column.kind == "boolean":
                assert written == str(value).lower()
            elif column.kind in ("integer", "number"):
                assert float(written) == value
            else:
                assert written.removeprefix("'") == value.removeprefix("'")
                assert not written.startswith(("=", "+", "-", "@", "\t", "\r", "\0"))


def test_the_manifest_verifies_and_names_every_file(
    database: Database, study_id: str, tmp_path: Path
) -> None:
    with database.read() as db:
        exports.write(db, study_id, Folder(tmp_path / "export"))
    files = [path for path in (tmp_path / "export").rglob("*") if path.is_file()]
    listed = (tmp_path / "export" / "manifest-sha256.txt").read_text().splitlines()
    assert len(listed) == len(files) - 1
    checked = subprocess.run(
        ["sha256sum", "--strict", "-c", "manifest-sha256.txt"],
        cwd=tmp_path / "export",
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout
    assert checked.stdout.count(": OK") == len(listed)


def test_a_zip_holds_what_its_manifest_says(export: zipfile.ZipFile) -> None:
    lines = export.read("manifest-sha256.txt").decode().splitlines()
    sums = {path: digest for digest, path in (line.split("  ") for line in lines)}
    assert set(sums) == set(export.namelist()) - {"manifest-sha256.txt"}
    for path, digest in sums.items():
        assert hashlib.sha256(export.read(path)).hexdigest() == digest


@pytest.mark.parametrize("table", TABLES)
def test_a_table_is_the_same_in_every_form_and_not_empty(
    export: zipfile.ZipFile, table: str
) -> None:
    forms = [sheet(export, table, kind) for kind in ("csv", "jsonl", "parquet")]
    assert_same(TABLES[table].columns, *forms)
    assert forms[1]
    assert len(pd.read_csv(io.BytesIO(forms[0]))) == len(forms[1].splitlines())


def values_for(column: Column) -> st.SearchStrategy[Any]:
    kinds: dict[str, st.SearchStrategy[Any]] = {
        "text": st.text(st.characters(exclude_categories=()), max_size=12),
        "time": st.datetimes().map(lambda moment: moment.isoformat(timespec="milliseconds")),
        "integer": st.integers(-(2**53), 2**53),
        "number": st.floats(),
        "boolean": st.booleans(),
    }
    return st.none() | kinds[column.kind]


COLUMNS_OF_ALL_KINDS = tuple(
    Column(f"a_{kind}", kind, "", "") for kind in ("text", "integer", "number", "boolean", "time")
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(
        st.fixed_dictionaries({each.name: values_for(each) for each in COLUMNS_OF_ALL_KINDS}),
        max_size=8,
    )
)
def test_whatever_the_rows_all_forms_hold_the_same(rows: list[dict[str, Any]]) -> None:
    target = io.BytesIO()
    columns = COLUMNS_OF_ALL_KINDS
    with Zip(target) as package:
        count = write_sheets(package, "t", columns, lambda: as_tables(rows, columns))
    written = zipfile.ZipFile(target)
    assert count == len(rows)
    forms = [written.read(f"t.{kind}") for kind in ("csv", "jsonl", "parquet")]
    assert_same(columns, *forms)
    back = pq.read_table(io.BytesIO(forms[2])).to_pylist()
    for row, given_row in zip(back, rows, strict=True):
        text = given_row["a_text"]
        wanted = text if text is None else text.encode("utf-8", "replace").decode()
        assert row["a_text"] == wanted
        for name in ("a_integer", "a_boolean", "a_time"):
            assert row[name] == given_row[name]
        number = given_row["a_number"]
        is_kept = number is not None and np.isfinite(number)
        assert row["a_number"] == (number if is_kept else None)


def test_the_codebook_describes_every_column_there_is(export: zipfile.ZipFile) -> None:
    book = json.loads(export.read("codebook.json"))
    text = export.read("codebook.md").decode()
    measured = json.loads(export.read("dataset_description.json"))["variableMeasured"]
    for table in TABLES:
        header = next(csv.reader(io.StringIO(sheet(export, table, "csv").decode())))
        described = book[table]["columns"]
        assert [column["name"] for column in described] == header
        assert book[table]["row"]
        assert f"## {table}\n" in text
        for column in described:
            assert column["description"]
            assert column["type"] in ("text", "time", "integer", "number", "boolean")
            assert f"| {column['name']} | {column['type']} | {column['unit']} |" in text
        assert set(header) <= {each["name"] for each in measured}
    assert set(book) == {
        re.search(r"_description-(\w+)_data\.csv$", name)[1]  # type: ignore[index]
        for name in export.namelist()
        if name.endswith(".csv")
    }


def test_every_level_in_the_data_is_in_the_codebook(export: zipfile.ZipFile) -> None:
    seen = 0
    for table, described in TABLES.items():
        for column in described.columns:
            levels = {level for level, _ in column.levels}
            for row in lines_of(export, table) if levels and column.kind != "boolean" else ():
                value = row[column.name]
                assert value is None or str(value) in levels, (table, column.name)
                seen += value is not None
    assert seen > TICKS


def test_no_sample_and_no_measure_is_forgotten() -> None:
    assert [column.name for column in SAMPLE_COLUMNS] == list(COLUMNS)
    assert {column.name for column in MEASURES} == set(Measures.__dataclass_fields__)


def test_the_layout_is_psych_ds(export: zipfile.ZipFile) -> None:
    names = export.namelist()
    assert {"dataset_description.json", "README.md", "CHANGES.md"} <= set(names)
    described = json.loads(export.read("dataset_description.json"))
    assert described["@type"] == "Dataset"
    assert described["name"] == "A small study"
    sheets = [Path(name).name for name in names if name.endswith(".csv")]
    assert len(sheets) == len(TABLES)
    for name in sheets:
        assert re.fullmatch(r"study-[a-z0-9]+_description-[a-z]+_data\.csv", name)


def test_nobody_can_be_recognised_and_who_withdrew_is_not_there(
    export: zipfile.ZipFile, database: Database
) -> None:
    whole = b"".join(export.read(name) for name in export.namelist())
    for secret in (SECRET, "CANARY", "ada-of-the-lab", "experimenter-1"):
        assert secret.encode() not in whole
    tables: tuple[Any, ...] = (ParticipantRow, QueryRow, AnswerRow, DriveRow, JobRow, AlignmentRow)
    with database.read() as db:
        ids = [row.id for table in tables for row in db.query(table)]
        ids += [row.token_hash or "?" for row in db.query(ParticipantRow)]
    for real in ids:
        assert real.encode() not in whole
    excluded = [row["excluded"] for row in lines_of(export, "participants")]
    assert excluded == [None, None, "pressed at random", None]


def test_the_excluded_can_be_left_out_of_everything(database: Database, study_id: str) -> None:
    export = export_of(database, study_id, with_excluded=False)
    kept = {row["participant"] for row in lines_of(export, "participants")}
    assert len(kept) == 3
    for table in TABLES:
        assert {row["participant"] for row in lines_of(export, table)} <= kept
    assert len(pq.read_table(io.BytesIO(export.read(EPISODES)))) == 4


def test_counts_are_those_of_the_dashboard(
    export: zipfile.ZipFile, database: Database, study_id: str
) -> None:
    with database.read() as db:
        shown = overview.page(
            db,
            study_id,
            state=None,
            search=None,
            after=0,
            limit=50,
            connected=set(),
            ticks_per_s=60.0,
        ).participants
    shown = [line for line in shown if line.state != "withdrawn"]
    people = lines_of(export, "participants")
    assert [line.state for line in shown] == [row["state"] for row in people]
    for line, person in zip(shown, people, strict=True):

        def count(table: str, who: str = person["participant"], **where: Any) -> int:
            return sum(
                row["participant"] == who and all(row[k] == v for k, v in where.items())
                for row in lines_of(export, table)
            )

        assert line.answers == count("answers", counts=True)
        assert line.drives == count("drives")
        assert line.driven_s == pytest.approx(count("samples") / 60.0, abs=0.05)


def test_an_export_of_the_same_data_is_the_same_up_to_the_pseudonyms(
    export: zipfile.ZipFile, database: Database, study_id: str
) -> None:
    def canonical(content: str) -> str:
        found: dict[str, str] = {}
        # Pseudonyms are 16 hexadecimal digits; each is called by the order of its appearance.
        return re.sub(
            r"\b[0-9a-f]{16}\b", lambda m: found.setdefault(m[0], f"#{len(found)}"), content
        )

    other = export_of(database, study_id)
    for table in TABLES:
        one, two = (sheet(each, table, "csv").decode() for each in (export, other))
        assert canonical(one) == canonical(two)
        assert one != two


def test_cells_cannot_run_and_numbers_stay_numbers(export: zipfile.ZipFile) -> None:
    said = [row["value"] for row in csv_of(sheet(export, "responses", "csv"))]
    assert '\'=HYPERLINK("x")' in said
    assert '\'=HYPERLINK("x")' in [row["text"] for row in csv_of(sheet(export, "notes", "csv"))]
    answers = pd.read_csv(io.BytesIO(sheet(export, "answers", "csv")))
    assert set(answers["h_x"].dropna()) == {-0.25}
    parquet = pq.read_table(io.BytesIO(sheet(export, "responses", "parquet")))
    assert '=HYPERLINK("x")' in parquet["value"].to_pylist()


def test_answers_say_which_counts_and_queries_which_repeats(export: zipfile.ZipFile) -> None:
    who = lines_of(export, "participants")[0]["participant"]
    answers = [row for row in lines_of(export, "answers") if row["participant"] == who]
    assert [row["counts"] for row in answers] == [False, *[True] * 6]
    assert (answers[-1]["h_x"], answers[-1]["h_y"]) == (None, None)
    queries = [row for row in lines_of(export, "queries") if row["participant"] == who]
    assert queries[-1]["repeats"] == queries[0]["query"]
    assert json.loads(queries[0]["hand_path"]) == [[0.0, 0.1, 0.2]] * 2


def test_responses_are_scored_and_say_which_strategy_was_chosen(export: zipfile.ZipFile) -> None:
    person = lines_of(export, "participants")[0]
    rows = [r for r in lines_of(export, "responses") if r["participant"] == person["participant"]]
    by_item = {row["item"]: row for row in rows}
    order = person["order"].split(">")
    assert (by_item["intuitive"]["number"], by_item["intuitive"]["strategy"]) == (6, order[0])
    assert (by_item["again"]["number"], by_item["again"]["is_declined"]) == (None, True)
    assert (by_item["best"]["number"], by_item["best"]["chosen"]) == (None, order[1])
    assert by_item["why"]["value"] == "fine"
    (score,) = [r for r in lines_of(export, "scores") if r["participant"] == person["participant"]]
    assert (score["score"], score["value"], score["strategy"]) == ("sus", 50.0, order[0])


def test_a_study_with_its_own_sus_gets_no_score(database: Database) -> None:
    own = questionnaires.SUS.model_copy(update={"title": "Not Brooke's"}).model_dump(mode="json")
    with database.write() as db:
        study = make_study(db, **WAYS, own_questionnaires=[own])
        give(db, study)
        study_id = study.id
    assert lines_of(export_of(database, study_id), "scores") == []


def test_drives_have_their_measures(export: zipfile.ZipFile) -> None:
    avoid, pour = lines_of(export, "drives")[:2]
    assert avoid["ticks"] == pour["ticks"] == TICKS
    assert avoid["completion_time_s"] == pytest.approx(TICKS / 60)
    assert (avoid["touches"], avoid["spills"]) == (0, None)
    assert pour["touches"] is None
    assert pour["spills"] is not None
    assert (avoid["way"], avoid["is_success"]) == (1, True)
    assert json.loads(avoid["counts"]) == {"touches": 0}


def test_props_are_where_they_were(export: zipfile.ZipFile, database: Database) -> None:
    table = pq.read_table(io.BytesIO(sheet(export, "props", "parquet"))).to_pandas()
    assert len(table) == 3 * TICKS
    assert table["tick"].tolist() == [*range(TICKS)] * 3
    with database.read() as db:
        kept = db.query(SampleChunkRow).order_by(SampleChunkRow.id)
        (first,) = [chunk for chunk in kept if len(chunk.props or b"") > 100][:1]
        row = unpack_props(first.props or b"", first.ticks)[0]
    columns = [column.name for column in (*CUP_COLUMNS, *BEAD_COLUMNS)]
    np.testing.assert_allclose(table.iloc[0][columns].to_numpy(float), row, atol=1e-6)


def test_tensors_are_ready_for_training(export: zipfile.ZipFile) -> None:
    found = [name for name in export.namelist() if name.startswith("tensors/")]
    assert len(found) == 3
    tensors = load(export.read(found[0]))
    assert tensors["s"].shape == tensors["s_star"].shape == (5, 7)
    assert tensors["h"].shape == (5, 2)
    assert tensors["h"][0].tolist() == [-0.25, 0.5]


def test_the_protocol_is_in_it_with_its_history(export: zipfile.ZipFile) -> None:
    text = export.read("protocol/version-1.yaml").decode()
    assert protocols.parse_yaml(text).title == "A small study"
    assert "version 1, used from" in export.read("CHANGES.md").decode()


def test_lerobot_can_be_left_out(database: Database, study_id: str) -> None:
    export = export_of(database, study_id, with_lerobot=False)
    assert not [name for name in export.namelist() if name.startswith("lerobot/")]
    assert "lerobot" not in export.read("README.md").decode()


def test_an_export_that_broke_off_does_not_look_whole(database: Database, study_id: str) -> None:
    target = io.BytesIO()

    def give_up(done: float) -> None:
        if done > 0.5:
            raise OSError("the disk is full")

    with database.read() as db, pytest.raises(OSError, match="full"):
        exports.write(db, study_id, Zip(target), note=give_up)
    gc.collect()
    assert len(target.getvalue()) > 10_000
    assert not zipfile.is_zipfile(target)


def test_progress_rises_to_the_end(database: Database, study_id: str) -> None:
    seen: list[float] = []
    export_of(database, study_id, note=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert len(seen) > len(TABLES)
