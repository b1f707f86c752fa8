"""Somebody who takes part in a study, in a real Chromium."""

import uuid
from typing import Any

from playwright.sync_api import Browser, Page, expect

from app.schemas.protocol import NO_ALIGN
from tests.browser.visitor import Visitor
from tests.running_server import Participant, RunningServer

PROTOCOL: dict[str, Any] = {
    "title": "A small study",
    "tasks": [{"task": "avoid", "labels": 5, "unlabelled": 100}],
    "strategies": [NO_ALIGN, "no-priors"],
    "practice_s": 5,
    "questionnaires": {
        "after_each_strategy": ["steering"],
        "after_each_task": ["preference"],
        "at_the_end": ["nasa-tlx", "comments"],
    },
    "completion": {"code": "C0DE", "url": "https://example.org/done?cc={code}"},
}


def make_study(server: RunningServer, **changes: Any) -> str:
    """A study made by the experimenter; its id."""
    study_id = str(uuid.uuid4())
    wanted = {"id": study_id, "protocol": PROTOCOL | changes}
    server.experimenter().post("/api/v1/studies", json=wanted).raise_for_status()
    return study_id


def link_of(server: RunningServer, study_id: str) -> str:
    """A participant's own link."""
    made = server.experimenter().post(
        f"/api/v1/studies/{study_id}/participants", json={"id": str(uuid.uuid4())}
    )
    link: str = made.raise_for_status().json()["participants"][0]["link"]
    return link


def go_to(link: str, key: str) -> None:
    """Do by a program all that comes before the step whose key begins with ``key``."""
    person = Participant(link)
    session = person.session()
    while not session["key"].startswith(key):
        assert session["step"] not in ("block", "end"), f"{session['key']} comes before {key}"
        session = _take(person, session)


def _take(person: Participant, session: dict[str, Any]) -> dict[str, Any]:
    match session["step"]:
        case "consent":
            response = person.post("consent", version=session["consent"]["version"])
        case "practice":
            response = person.post("practice")
        case "queries":
            asked = next(each for each in session["queries"] if each["answer"] is None)
            response = person.answer(asked["id"], [0.5, 0.5])
        case "training":
            person.wait_for_training()
            response = person.post("driving")
        case _:
            items = session["questions"]["questionnaire"]["items"]
            given = {"value": None, "answered_at": "2026-01-01T00:00:00Z"}
            said = [{"item": item["key"]} | given for item in items]
            response = person.post("questions", key=session["key"], responses=said)
    taken: dict[str, Any] = response.raise_for_status().json()
    return taken


class StudyVisitor(Visitor):
    """Keeps what the page fetched and heard, and counts what it sent."""

    def __init__(self, browser: Browser, link: str, **options: Any) -> None:
        self.fetched: set[str] = set()
        self.heard: list[str] = []
        self.sent: list[str] = []
        super().__init__(browser, link, reduced_motion="reduce", **options)

    def open_tab(self) -> Page:
        self.context.on("request", self._note)
        return super().open_tab()

    def _note(self, request: Any) -> None:
        if request.method == "GET":
            self.fetched.add(request.url)
        elif "/api/" in request.url:
            self.sent.append(request.url.rsplit("/api/", 1)[1])

    def _hear(self, frame: Any) -> None:
        self.heard.append(str(frame))
        super()._hear(frame)

    def wait_for_item(self, item: str) -> None:
        expect(self.page.locator(f"[data-item={item}]")).to_be_visible()

    def drive_and_give_up(self) -> None:
        """One attempt, as far as the button to go on."""
        self.wait_for_step("block")
        self.click("give-up")
        expect(self.page.get_by_test_id("continue")).to_be_visible()

    def answer_all(self, choice: int = 0) -> None:
        for item in self.page.locator(".item").all():
            item.locator("input[type=radio]").nth(choice).check()
