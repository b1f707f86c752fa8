"""What a form may offer: everything there is, all of which the server takes."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.services import questionnaires
from models.tasks import TASKS


def names(offered: list[dict[str, Any]]) -> list[str]:
    return [each["name"] for each in offered]


def test_every_task_and_questionnaire_is_offered_with_its_title(office: TestClient) -> None:
    choices = office.get("/api/v1/choices").json()
    assert names(choices["tasks"]) == list(TASKS)
    assert names(choices["questionnaires"]) == list(questionnaires.LIBRARY)
    assert {"name": "avoid", "title": "Go round"}.items() <= choices["tasks"][3].items()
    for offered in ("tasks", "strategies", "orders", "questionnaires"):
        assert all(each["title"] for each in choices[offered])


@pytest.mark.parametrize("what", ["tasks", "strategies", "order", "questionnaires"])
def test_whatever_is_offered_is_taken_in_a_protocol(office: TestClient, what: str) -> None:
    choices = office.get("/api/v1/choices").json()
    changes: dict[str, list[dict[str, Any]]] = {
        "tasks": [
            {"tasks": [{"task": each["name"]}]} for each in choices["tasks"] if each["has_goal"]
        ],
        "strategies": [{"strategies": [name]} for name in names(choices["strategies"])],
        "order": [{"order": name} for name in names(choices["orders"])],
        "questionnaires": [
            {"questionnaires": {"at_the_end": [name]}} for name in names(choices["questionnaires"])
        ],
    }
    assert len(changes[what]) > 1
    for change in changes[what]:
        checked = office.post(
            "/api/v1/protocols/check", json={"protocol": choices["template"] | change}
        )
        assert checked.status_code == 200, checked.text
        sent, kept = change[what], checked.json()["protocol"][what]
        if what == "tasks":
            assert [task["task"] for task in kept] == [task["task"] for task in sent]
        else:
            assert sent == kept or sent.items() <= kept.items()


def test_what_a_task_gets_by_itself_is_what_is_said(office: TestClient) -> None:
    choices = office.get("/api/v1/choices").json()
    content = choices["template"] | {"tasks": [{"task": "avoid"}]}
    (task,) = office.post("/api/v1/protocols/check", json={"protocol": content}).json()["protocol"][
        "tasks"
    ]
    (said,) = (each for each in choices["tasks"] if each["name"] == "avoid")
    assert (said["labels"], said["unlabelled"]) == (task["labels"], task["unlabelled"])


def test_unchanged_choices_are_not_sent_again(office: TestClient) -> None:
    tag = office.get("/api/v1/choices").headers["ETag"]
    assert office.get("/api/v1/choices", headers={"If-None-Match": tag}).status_code == 304
