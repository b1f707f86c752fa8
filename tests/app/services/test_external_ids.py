"""Which names are somebody's: whatever people are called, and never a placeholder."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.services import external_ids

PEOPLE = [
    *("5f3c9b2e1a7d4c0012345678", "A1B2C3D4E5F6G7", "Anna B.", "a+b@example.org", "Müller", "7"),
    *("李雷", "Анна Иванова", "محمد", "Ngô Thị", "O'Neil", "x_y-z", "Null", "Nan", "Noneta", "id7"),
    *("(12)", "100%", "C#4", "$7", "a=b&c", "Test", "P-12"),
]
NOBODY = [
    *("{{%PROLIFIC_PID%}}", "{{PROLIFIC_PID}}", "%SURVEY_CODE%", "${e://Field/PROLIFIC_PID}"),
    *(
        "${workerId}",
        "{id}",
        "[ID]",
        "[%workerId%]",
        "<your id>",
        "$PROLIFIC_PID",
        "#{id}",
        "@@id@@",
    ),
    *("undefined", "null", "None", "NaN", "[object Object]", "", " ", "-", "???", "\u200b"),
    *(
        "ASSIGNMENT_ID_NOT_AVAILABLE",
        "HIT_ID_NOT_AVAILABLE",
        "not_available",
        "YOUR_ID",
        "insert id",
    ),
    *("your-participant-id-here", "a\0b", "\ud800", "x" * 201, "__ID__", "@@id@@"),
    "insert id",
]


@pytest.mark.parametrize("name", PEOPLE)
def test_whatever_people_are_called_is_let_in_as_it_is(name: str) -> None:
    assert external_ids.read(name) == name
    assert external_ids.read(f"  {unicodedata.normalize('NFD', name)}\t") == name


@pytest.mark.parametrize("name", NOBODY)
def test_what_stands_for_nobody_is_nobody(name: str) -> None:
    assert external_ids.read(name) is None


@given(st.text(max_size=250))
def test_what_is_kept_reads_back_as_itself(text: str) -> None:
    kept = external_ids.read(text)
    assert external_ids.read(kept) == kept
