"""The file of people: who is there stays, and only who did the same."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.analysis.simulation_rows import SimulationError
from app.bots.person import Habits
from app.rehearsal import people as people_file
from app.rehearsal.participant import Part
from app.rehearsal.people import open_people
from tests.app.rehearsal.parts import FIRST, take_at_once


def fill(folder: Path, count: int) -> None:
    with open_people(folder, FIRST, is_fresh=False) as people:
        for part in people.missing(count):
            people.add(part, take_at_once(part), 1.5)


def missing(folder: Path, count: int, part: Part = FIRST, is_fresh: bool = False) -> list[int]:
    with open_people(folder, part, is_fresh=is_fresh) as people:
        return [each.number for each in people.missing(count)]


def test_who_has_driven_need_not_again(tmp_path: Path) -> None:
    fill(tmp_path, 3)
    assert missing(tmp_path, 5) == [3, 4]
    assert len((tmp_path / "people.jsonl").read_text().splitlines()) == 3
    with open_people(tmp_path, FIRST, is_fresh=False) as people:
        assert people.drives[2] == take_at_once(replace(FIRST, number=2))
        assert people.seconds == dict.fromkeys(range(3), 1.5)


def test_a_line_that_was_cut_off_is_driven_again(tmp_path: Path) -> None:
    fill(tmp_path, 3)
    path = tmp_path / "people.jsonl"
    path.write_bytes(path.read_bytes()[:-20])
    assert missing(tmp_path, 3) == [2]
    fill(tmp_path, 3)
    assert missing(tmp_path, 3) == []


def test_values_are_by_person_and_strategy(tmp_path: Path) -> None:
    fill(tmp_path, 3)
    with open_people(tmp_path, FIRST, is_fresh=False) as people:
        times = people.values("completion_time_s", 2)
        assert times.tolist() == [[10.0, 20.0], [10.1, 20.3]]
        assert people.values("is_success", 3).sum(axis=0).tolist() == [3.0, 2.0]


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"limit_s": 61.0}, "limit_s"),
        ({"strategies": ("no-priors", "all-priors")}, "strategies"),
        ({"habits": Habits(motor_noise=0.2)}, "habits"),
        ({"seed": 1, "task": "pour-cup"}, "task, seed"),
    ],
)
def test_people_who_did_something_else_are_refused_until_one_begins_anew(
    tmp_path: Path, changed: dict[str, Any], named: str
) -> None:
    fill(tmp_path, 2)
    other = replace(FIRST, **changed)
    with pytest.raises(SimulationError, match=rf"people of other {named}; .*--fresh"):
        missing(tmp_path, 2, other)
    assert missing(tmp_path, 2) == []
    assert missing(tmp_path, 2, other, is_fresh=True) == [0, 1]


def test_people_of_other_code_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path, 2)
    monkeypatch.setattr(people_file, "origin", lambda: "another")
    with pytest.raises(SimulationError, match=r"other code.*--fresh"):
        missing(tmp_path, 2)


def test_all_that_decides_how_somebody_drives_counts_as_code() -> None:
    app = Path(people_file.__file__).parents[1]
    for pattern in people_file._DECIDE:
        assert list(app.glob(pattern)), pattern


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    fill(tmp_path, 2)
    path = tmp_path / "people.jsonl"
    path.write_text(path.read_text() + "{}\n")
    with pytest.raises(SimulationError, match=r"Line 3 of .* is damaged"):
        missing(tmp_path, 2)
