"""From an export to pictures, tables and words."""

import csv
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.patches import Rectangle

from app.analysis import study_values as values
from app.analysis.study_export import NotAnExport, StudyExport, read_export
from app.analysis.study_figures import Picture, comparisons, pictures
from app.analysis.study_page import Studies, page_text
from app.analysis.study_report import as_text, findings, summary, write_report
from app.cli import main
from app.services import exports
from app.services.export_package import Zip
from app.storage.database import Database
from tests.app.analysis.studies import (
    LIMIT_S,
    STRATEGIES,
    make_drive,
    make_export,
    make_response,
    make_study,
)
from tests.app.exported import make_whole_study


@pytest.fixture
def exported(database: Database, tmp_path: Path) -> Path:
    """A real export with somebody excluded and somebody withdrawn."""
    with database.write() as db:
        study_id = make_whole_study(db)
    path = tmp_path / "study.zip"
    with database.read() as db, path.open("wb") as file:
        exports.write(db, study_id, Zip(file))
    return path


def test_an_export_is_read_without_whom_was_excluded(exported: Path) -> None:
    export = read_export(exported)
    assert export.excluded == 1
    people = {row["participant"] for row in export.tables["participants"]}
    assert len(people) == 3
    assert {row["participant"] for row in export.tables["drives"]} < people
    assert len(export.tables["drives"]) == 4
    ticks = {each.drive: each.columns for each in export.ticks(["raw_x", "hand_z"])}
    assert ticks.keys() == {row["drive"] for row in export.tables["drives"]}
    assert all(len(columns["hand_z"]) == 90 for columns in ticks.values())


def test_a_folder_and_a_zip_are_read_alike(exported: Path, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    with zipfile.ZipFile(exported) as archive:
        archive.extractall(folder)
    assert read_export(folder).tables == read_export(exported).tables


@pytest.mark.parametrize("content", [b"", b"no zip at all"])
def test_what_is_no_export_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "broken.zip"
    path.write_bytes(content)
    with pytest.raises(NotAnExport, match="not a whole export"):
        read_export(path)
    with pytest.raises(NotAnExport, match="nothing at"):
        read_export(tmp_path / "missing.zip")


def test_an_export_cut_short_is_refused(exported: Path) -> None:
    content = exported.read_bytes()
    exported.write_bytes(content[: len(content) // 2])
    with pytest.raises(NotAnExport):
        read_export(exported)


FORK = b"\0\5\x16\7" + b"\0" * 159  # what a Mac leaves beside a file


def packed(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as target:
        for name, content in files.items():
            target.writestr(name, content)
    return path


def members(exported: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(exported) as source:
        return {name: source.read(name) for name in source.namelist()}


def fork_of(name: str) -> str:
    folder, _, file = name.rpartition("/")
    return f"{folder}/._{file}" if folder else f"._{file}"


@pytest.mark.parametrize(
    "change",
    [
        lambda files: {f"study/{name}": content for name, content in files.items()},
        lambda files: {f"a/b c/{name}": content for name, content in files.items()},
        lambda files: {fork_of(name): FORK for name in files} | files,
        lambda files: (
            {f"s/{name}": content for name, content in files.items()}
            | {f"__MACOSX/s/{fork_of(name)}": FORK for name in files}
        ),
        lambda files: files | {"protocol/version-1 copy.yaml": b"title: T", "notes.txt": b"x"},
        lambda files: files | {".DS_Store": b"x", "data/.~lock.x_data.parquet#": b"x"},
    ],
)
def test_an_export_that_was_packed_anew_is_read_as_it_was(
    change: Any, exported: Path, tmp_path: Path
) -> None:
    changed = change(members(exported))
    again = read_export(packed(tmp_path / "again.zip", changed))
    assert again.tables == read_export(exported).tables
    assert again.title == read_export(exported).title
    folder = tmp_path / "folder"
    for name, content in changed.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    assert read_export(folder).tables == again.tables


def foreign(**columns: list[Any]) -> bytes:
    file = io.BytesIO()
    pq.write_table(pa.table(columns), file)
    return file.getvalue()


def without(files: dict[str, bytes], part: str) -> dict[str, bytes]:
    return {name: content for name, content in files.items() if part not in name}


def replaced(files: dict[str, bytes], part: str, content: bytes) -> dict[str, bytes]:
    return {name: content if part in name else before for name, before in files.items()}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda files: without(files, "protocol/version"), "it has no protocol"),
        (lambda files: without(files, "-drives_data.parquet"), "it has no table 'drives'"),
        (lambda files: replaced(files, "protocol/version", b"{: ["), "cannot be read"),
        (lambda files: replaced(files, "protocol/version", b"- a"), "protocol with a title"),
        (lambda files: replaced(files, "-drives_data.parquet", b"PAR1"), "make it again"),
        (
            lambda files: replaced(files, "_data.parquet", foreign(id=[1, 2])),
            "it has no column 'participant' in its table 'participants'",
        ),
    ],
)
def test_what_is_not_a_whole_export_is_said_in_one_sentence(
    change: Any, said: str, exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = packed(tmp_path / "other.zip", change(members(exported)))
    assert main(["figures", str(path), "--out", str(tmp_path / "figures")]) == 2
    heard = capsys.readouterr().err
    assert said in heard
    assert heard.count("\n") == 1


def test_a_try_that_came_to_nothing_counts_with_the_time_there_was() -> None:
    drives = [
        make_drive("a", "no-align", is_success=False, end="given up", completion_time_s=7.0),
        make_drive("a", "all-priors", completion_time_s=20.0),
        make_drive("a", "no-priors", end="left", completion_time_s=3.0),
    ]
    times = values.objective(make_export(drives=drives), values.OBJECTIVE[0])["avoid"]
    assert times == {"no-align": {"a": LIMIT_S}, "all-priors": {"a": 20.0}}


def test_without_a_limit_it_counts_as_the_longest_try() -> None:
    drives = [
        make_drive("a", "no-align", "pour-cup", is_success=False, completion_time_s=7.0),
        make_drive("b", "no-align", "pour-cup", completion_time_s=33.0),
    ]
    export = make_export(drives=drives)
    export.protocols[1]["tasks"] = [{"task": "pour-cup", "time_limit_s": None}]
    times = values.objective(export, values.OBJECTIVE[0])["pour-cup"]["no-align"]
    assert times == {"a": 33.0, "b": 33.0}


def test_several_tries_and_tasks_are_one_value_of_a_person() -> None:
    drives = [make_drive("a", "no-align", undo_share=share) for share in (0.1, 0.3)]
    undo = values.objective(make_export(drives=drives), values.OBJECTIVE[2])
    assert undo["avoid"]["no-align"]["a"] == pytest.approx(20.0)
    said = [make_response("a", "no-align", "easy", number) for number in (2, 5, None)]
    (item,) = values.scale_items(make_export(drives=drives, responses=said))
    assert item.values == {"no-align": {"a": 3.5}}


def test_repeated_questions_say_how_alike_the_answers_are() -> None:
    def answer(query: str, h: tuple[float, float] | None) -> dict[str, object]:
        h_x, h_y = h or (None, None)
        return {"participant": "a", "query": query, "h_x": h_x, "h_y": h_y, "counts": True}

    def query(name: str, repeats: str | None) -> dict[str, object]:
        return {"participant": "a", "query": name, "task": "avoid", "repeats": repeats}

    export = make_export(
        queries=[query("1", None), query("2", "1"), query("3", None), query("4", "3")],
        answers=[
            answer("1", (0.5, 0.0)),
            answer("2", (0.0, 1.0)),
            answer("3", (1, 0)),
            answer("4", None),
        ],
    )
    (again,) = values.repeats(export)
    assert again.angle_deg == pytest.approx(90.0)
    assert again.length == pytest.approx(0.5)


def test_differences_that_are_there_are_found_and_others_are_not() -> None:
    found = comparisons(make_study(gain_s=5.0))
    by = {measure: [c for c in found if c.measure == measure] for measure in ("completion_time_s",)}
    assert all(each.is_significant for each in by["completion_time_s"])
    assert not any(each.is_significant for each in found if each.measure == "path_length_m")
    said = findings(found)
    assert any("Time, Go round: less under “Answers and priors”" in each for each in said)
    alike = comparisons(make_study(gain_s=0.0))
    assert not any(each.is_significant for each in alike if each.measure != "steering")
    driven = [each for each in alike if each.measure != "steering"]
    assert findings(driven) == [
        "No two strategies differ in any of 9 comparisons, of at most 10 people each."
    ]


def test_a_report_of_a_real_export_has_every_picture_and_number(
    exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "figures"
    assert main(["figures", str(exported), "--out", str(out)]) == 0
    assert "There is nothing to compare" in capsys.readouterr().out  # each drove one strategy
    index = json.loads((out / "figures.json").read_text())
    names = {each["name"] for each in index["pictures"]}
    assert names == {"objective", "responses", "preference", "trajectories", "stick"}
    for name in names:
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (out / f"{name}.svg").exists()
        assert f"({name}.png)" in (out / "report.md").read_text()
    rows = list(csv.DictReader(io.StringIO((out / "summary.csv").read_text())))
    times = [row for row in rows if row["measure"] == "completion_time_s"]
    assert {row["task"] for row in times} == {"avoid", "pour-cup"}
    assert all(float(row["mean"]) == pytest.approx(1.5, abs=0.01) for row in times if row["mean"])


def test_the_same_export_gives_the_same_files(exported: Path, tmp_path: Path) -> None:
    export = read_export(exported)
    for name in ("one", "two"):
        write_report(export, tmp_path / name)
    one, two = (
        {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}
        for name in ("one", "two")
    )
    assert one == two


def test_a_study_without_drives_has_a_report_too(tmp_path: Path) -> None:
    export = make_export()
    assert list(pictures(export, [])) == []
    assert "nothing to compare yet" in as_text(export, [], [])
    write_report(export, tmp_path / "out")


def test_bars_are_as_high_as_the_means_and_points_are_people() -> None:
    export = make_study(people=4)
    (picture,) = [each for each in pictures_of(export) if each.name == "objective"]
    panel = picture.figure.axes[0]
    heights = sorted(bar.get_height() for bar in panel.patches if isinstance(bar, Rectangle))
    means = sorted(row["mean"] for row in summary(export) if row["measure"] == "completion_time_s")
    assert heights == pytest.approx(means)
    spots = [spot for marks in panel.collections for spot in offsets_of(marks)]
    assert len(spots) == 4 * len(STRATEGIES)


def test_tries_are_drawn_in_the_order_in_which_they_were_made() -> None:
    times = {"a": [30.0, 20.0, 10.0], "b": [20.0, 16.0]}
    drives = [
        make_drive(who, "all-priors", completion_time_s=time_s)
        for who, made in times.items()
        for time_s in made
    ]
    export = make_export(drives=drives)
    (picture,) = [each for each in pictures_of(export) if each.name == "tries"]
    lines = [list(np.array(line.get_ydata())) for line in picture.figure.axes[0].lines]
    assert lines == [[30.0, 20.0, 10.0], [20.0, 16.0], [25.0, 18.0, 10.0]]
    once = make_export(drives=[drives[0], drives[3]])
    assert "tries" not in [each.name for each in pictures_of(once)]


def pictures_of(export: StudyExport) -> list[Picture]:
    """Those that need no ticks; the others are given none."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(StudyExport, "ticks", lambda _self, _names: iter(()))
        return list(pictures(export, []))


def offsets_of(marks: object) -> list[object]:
    offsets = np.asarray(marks.get_offsets())  # type: ignore[attr-defined]
    return list(offsets) if len(offsets) == 4 else []


@pytest.mark.parametrize(
    ("words", "said"),
    [(["nothing.zip"], "nothing at"), (["x.zip", "--about", "magic"], "magic")],
)
def test_bad_words_get_one_line(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", *words, "--out", str(tmp_path / "out")]) == 2
    heard = capsys.readouterr().err
    assert said in heard
    assert heard.count("\n") == 1


def test_the_page_counts_what_holds() -> None:
    one, alike = make_study(), make_study(gain_s=0.0, seed=2)
    alike.tables["responses"] = []
    text = page_text(Studies(one, one, alike), [])
    lines = {line.split(" | ")[0]: line for line in text.splitlines() if line.startswith("| ")}
    assert "held (2 of 2) | held (2 of 2)" in lines["| … significantly in time"]
    assert "not held (0 of 2)" in lines["| … and in path length"]
    assert "none finds a difference" in text
    assert "find a difference that is not there" in page_text(Studies(one, one, one), [])
