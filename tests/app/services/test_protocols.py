"""Protocols: YAML there and back, and errors that say where and why."""

import re
from pathlib import Path
from typing import Any

import pytest

from app.cli import main
from app.services import protocols, questionnaires
from app.services.protocols import BadProtocol
from app.settings import ROOT
from tests.app.factories import FREE, SMALL


@pytest.mark.parametrize("content", [SMALL, FREE])
def test_a_protocol_written_as_yaml_reads_back_the_same(content: dict[str, Any]) -> None:
    protocol = protocols.parse(content)
    assert protocols.parse_yaml(protocols.as_yaml(protocol)) == protocol
    assert protocols.parse(protocols.as_json(protocol)) == protocol


OWN = {"name": "own", "title": "Own", "items": [{"key": "a", "kind": "text", "text": "Why?"}]}
PLACES = ("after_each_strategy", "after_each_task", "at_the_end")
CHOICE = {"key": "a", "kind": "choice", "text": "Which?", "choices": ["Yes", "No", "YES "]}
SCALE = {"key": "a", "kind": "scale", "text": "How?", "low": 7, "high": 1}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tasks": []}, "tasks"),
        ({"tasks": [{"task": "juggle"}]}, "there is no task 'juggle'"),
        ({"tasks": [{"task": "plane"}]}, "no goal"),
        ({"tasks": [{"task": "avoid"}, {"task": "avoid"}]}, "there twice"),
        ({"tasks": [{"task": "avoid", "labels": 2}]}, "tasks.0.labels"),
        ({"tasks": [{"task": "avoid", "labels": 5, "repeats": 6}]}, "repeated"),
        ({"strategies": ["all-priors", "magic"]}, "there is no strategy 'magic'"),
        ({"strategies": ["ideal-align"]}, "ideal-align"),
        ({"questionnaires": {"at_the_end": ["horoscope"]}}, "questionnaires.at_the_end"),
        *(
            (
                {"questionnaires": {where: ["sus", "steering", "sus"]}},
                f"'sus' is there twice in {at}",
            )
            for where, at in ((each, f"questionnaires.{each}") for each in PLACES)
        ),
        (
            {"own_questionnaires": [OWN], "questionnaires": {"at_the_end": ["own", "own"]}},
            "'own' is there twice in questionnaires.at_the_end",
        ),
        ({"own_questionnaires": [OWN, OWN]}, "there twice"),
        ({"own_questionnaires": [OWN | {"items": [SCALE]}]}, "high end above its low end"),
        ({"completion": {"url": "javascript:alert(1)"}}, "completion.url"),
        ({"order": "latin"}, "order"),
        ({"practice_s": float("nan")}, "practice_s"),
        ({"colour": "blue"}, "colour"),
        ({"practise_s": 3}, "did you mean 'practice_s'"),
        ({"participants": True}, "participants: write a whole number (not true)"),
        ({"title": "\u200b"}, "title: this looks empty"),
        ({"tasks": [{"task": "avoid", "labels": 30, "unlabelled": 100}]}, "at least 150"),
        (
            {
                "tasks": [
                    {"task": "avoid", "labels": 12, "unlabelled": 100, "questions": "designed"}
                ]
            },
            "tasks.0.unlabelled: 12 labels with designed questions need 240 sampled moves",
        ),
        (
            {"own_questionnaires": [OWN | {"items": [SCALE | {"low": 0, "high": 5, "step": 2}]}]},
            "4 or 6",
        ),
        ({"own_questionnaires": [OWN | {"items": [CHOICE]}]}, "'YES ' looks like the choice 'Yes'"),
        (
            {"own_questionnaires": [OWN | {"items": [CHOICE | {"choices": ["a", " "]}]}]},
            "looks empty",
        ),
        ({"completion": {"url": "https://x.org/?cc={code}"}}, "no completion.code"),
        ({"is_free": True, "tasks": [{"task": "avoid"}]}, "asked nothing"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(BadProtocol) as refused:
        protocols.parse(SMALL | changes)
    assert said in refused.value.sentence
    assert refused.value.sentence.endswith(".")
    assert "\n" not in refused.value.sentence


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("title: [unclosed\ntasks: 3", "line 2: "),
        ("- a\n- b", "list of settings"),
        ("", "list of settings"),
        ("title: !!python/object/apply:os.system ['true']", "line 1"),
        ("[" * 5000, "nested too deeply"),
        ("title: T\ntasks:\n  - task: avoid\n    labels: 3", "line 4: tasks.0.labels: write a"),
        ("title: T\ntasks:\n  - labels: 7", "line 3: tasks.0.task: this is needed"),
        ("title: T\ntasks: [{task: avoid}]\ntitel: U", "line 3: titel: there is no such setting"),
        ("title: 2024\ntasks: [{task: avoid}]", "line 1: title: write text in quotes (not 2024)"),
        ("title: T\ntasks: [{task: avoid, labels: '7'}]", "a whole number without quotes"),
        (
            "title: T\ntasks: [{task: avoid}]\npractice_s: true",
            "line 3: practice_s: write a number",
        ),
        ("title: T\ntasks: [{task: avoid}]\nparticipants: 0b_", "line 3: participants: write a"),
        ("title: T\ntasks: [{task: avoid}]\nconsent: 2024-13-45\nconsent: x", "line 4: 'consent'"),
        ("title: '  '\ntasks: [{task: avoid}]", "line 1: title: this looks empty"),
        ('title: "a\\0b"\ntasks: [{task: avoid}]', "line 1: title: there is an invisible control"),
        ('title: "a\\u202eb"\ntasks: [{task: avoid}]', "control character (U+202E)"),
        ("title: T\ntasks: [{task: avoid}]\nstrategies: all-priors", "strategies: write a list"),
        ("title: T\ntasks: [{task: avoid}]\nstrategies: []", "strategies: write at least one"),
        ("title: T\ntasks: [{task: avoid}]\norder: wiliams", "order: write one of 'williams'"),
    ],
)
def test_text_that_is_no_protocol_is_refused_with_its_line(text: str, said: str) -> None:
    with pytest.raises(BadProtocol) as refused:
        protocols.parse_yaml(text)
    assert said in refused.value.sentence


def test_data_nested_beyond_all_sense_is_refused() -> None:
    content: Any = "x"
    for _ in range(900):
        content = {"a": [content]}
    with pytest.raises(BadProtocol, match="nested too deeply"):
        protocols.parse(SMALL | {"tasks": content})


def test_own_questionnaires_can_be_asked() -> None:
    content = SMALL | {"own_questionnaires": [OWN], "questionnaires": {"at_the_end": ["own"]}}
    protocol = protocols.parse(content)
    found = questionnaires.find(protocol, "own")
    assert found is not None
    assert found.title == "Own"


def examples() -> list[Any]:
    """Every piece of YAML in the documents, and every protocol beside them."""
    found = []
    for page in sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]):
        for number, text in enumerate(
            re.findall(r"```yaml\n(.*?)```", page.read_text(), re.DOTALL)
        ):
            found.append(pytest.param(text, id=f"{page.name}-{number}"))
    for file in sorted((ROOT / "examples").glob("*.yaml")):
        found.append(pytest.param(file.read_text(), id=file.name))
    return found


@pytest.mark.parametrize("text", examples())
def test_every_example_in_the_docs_can_be_run(text: str) -> None:
    rest = "" if re.search("^title:", text, re.MULTILINE) else "title: T\ntasks: [{task: avoid}]\n"
    assert protocols.parse_yaml(rest + text).tasks


def test_a_command_says_what_is_wrong_with_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad = tmp_path / "good.yaml", tmp_path / "bad.yaml"
    good.write_text("title: T\ntasks:\n  - task: avoid\n    labels: 7\n")
    bad.write_text("title: T\ntasks:\n  - task: avoid\n    labels: 3\npractice_s: -1\n")
    assert main(["check", str(good)]) == 0
    assert "can be run" in capsys.readouterr().out
    assert main(["check", str(good), str(bad), str(tmp_path / "none.yaml"), str(tmp_path)]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"{bad}: line 4: tasks.0.labels: write a number of at least 5 (not 3).",
        f"{bad}: line 5: practice_s: write a number of at least 0 (not -1).",
        f"{tmp_path / 'none.yaml'}: No such file or directory.",
        f"{tmp_path}: Is a directory.",
    ]
