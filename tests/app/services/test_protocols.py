"""Protocols: YAML there and back, and errors that say where and why."""

from pathlib import Path
from typing import Any

import pytest

from app.services import protocols
from app.services.protocols import BadProtocol
from tests.app.factories import FREE, SMALL


@pytest.mark.parametrize("content", [SMALL, FREE])
def test_a_protocol_written_as_yaml_reads_back_the_same(content: dict[str, Any]) -> None:
    protocol = protocols.parse(content)
    assert protocols.parse_yaml(protocols.as_yaml(protocol)) == protocol
    assert protocols.parse(protocols.as_json(protocol)) == protocol


OWN = {"name": "own", "title": "Own", "items": [{"key": "a", "kind": "text", "text": "Why?"}]}
PLACES = ("after_each_strategy", "after_each_task", "at_the_end")
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
        ("title: [unclosed\ntasks: 3", "line"),
        ("- a\n- b", "list of settings"),
        ("", "list of settings"),
        ("title: !!python/object/apply:os.system ['true']", "line 1"),
        ("[" * 5000, "."),
    ],
)
def test_text_that_is_no_protocol_is_refused_with_its_line(text: str, said: str) -> None:
    with pytest.raises(BadProtocol) as refused:
        protocols.parse_yaml(text)
    assert said in refused.value.sentence


def test_own_questionnaires_can_be_asked() -> None:
    content = SMALL | {"own_questionnaires": [OWN], "questionnaires": {"at_the_end": ["own"]}}
    protocol = protocols.parse(content)
    found = protocols.find_questionnaire(protocol, "own")
    assert found is not None
    assert found.title == "Own"


def test_the_protocol_in_the_docs_can_be_run() -> None:
    text = (Path(__file__).resolve().parents[3] / "docs" / "studies.md").read_text()
    example = text.split("```yaml\n")[1].split("```")[0]
    assert len(protocols.parse_yaml(example).tasks) == 3
