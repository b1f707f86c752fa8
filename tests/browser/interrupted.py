"""A whole study in a browser, with trouble at every step, and what the database then holds."""

import contextlib
import tempfile
from collections import Counter
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, expect

from app.storage.tables import AnswerRow, DriveRow, EventRow, JobRow, ResponseRow
from tests.browser.study_visitor import PROTOCOL, StudyVisitor, link_of, make_study
from tests.running_server import RunningServer

QUESTIONS = PROTOCOL["tasks"][0]["labels"] + 1  # one gets no stick input, and one is asked instead
WAYS = len(PROTOCOL["strategies"])
SETTINGS = {"training_steps": 20}

Act = Callable[[], None]
Trouble = Callable[[StudyVisitor, "Restartable", Act], None]


class Restartable:
    """A server that may be killed and started anew, at the same address and with the same data."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.now = RunningServer(folder, **SETTINGS)

    def start(self) -> None:
        self.now = RunningServer(self._folder, port=self.now.port, **SETTINGS)


def reload(visitor: StudyVisitor, _server: Restartable, act: Act) -> None:
    """The page is loaded anew."""
    visitor.page.reload()
    act()


def back(visitor: StudyVisitor, _server: Restartable, act: Act) -> None:
    """Somewhere else, and back by the button."""
    visitor.page.goto("about:blank")
    visitor.page.go_back()
    act()


def two_tabs(visitor: StudyVisitor, _server: Restartable, act: Act) -> None:
    """Another tab goes on; the first one stays open behind."""
    for old in visitor.context.pages[:-1]:
        old.close()
    visitor.page = visitor.open_tab()
    act()


def offline(for_s: float) -> Trouble:
    """The network is gone while the person goes on."""

    def trouble(visitor: StudyVisitor, _server: Restartable, act: Act) -> None:
        visitor.context.set_offline(True)
        act()
        visitor.page.wait_for_timeout(1000.0 * for_s)
        visitor.context.set_offline(False)

    return trouble


def restart(visitor: StudyVisitor, server: Restartable, act: Act) -> None:
    """The server is killed while the person goes on, and started anew."""
    server.now.kill()
    act()
    server.start()


def walk(browser: Browser, trouble: Trouble) -> dict[str, Any]:
    """Take part from consent to the end, in trouble at every step.

    Returns:
        The rows of each table, and what the page complained of.
    """
    with tempfile.TemporaryDirectory() as folder, _stopping(Path(folder)) as server:
        visitor = StudyVisitor(
            browser, link_of(server.now, make_study(server.now)), has_picture=False
        )
        _walk(visitor, lambda act: trouble(visitor, server, act))
        visitor.close()
        tables = (AnswerRow, DriveRow, EventRow, JobRow, ResponseRow)
        return {table.__tablename__: server.now.rows(table) for table in tables} | {
            "complaints": visitor.complaints
        }


@contextlib.contextmanager
def _stopping(folder: Path) -> Generator[Restartable]:
    server = Restartable(folder)
    try:
        yield server
    finally:
        server.now.stop()


def _walk(visitor: StudyVisitor, trouble: Callable[[Act], None]) -> None:
    def press(name: str) -> Act:
        return lambda: visitor.click(name)

    def nothing() -> None:
        pass

    visitor.wait_for_step("consent")
    trouble(press("begin"))
    visitor.wait_for_step("practice")
    trouble(press("ready"))
    for number in range(1, QUESTIONS + 1):
        visitor.wait_for_step("queries")
        visitor.wait(lambda number=number: visitor.question() == number)
        if number in (2, QUESTIONS):
            trouble(press("cant-say") if number == 2 else press_and_confirm(visitor))
        else:
            press_and_confirm(visitor)()
    visitor.wait_for_step("training")
    trouble(nothing)
    expect(visitor.page.get_by_test_id("drive")).to_be_enabled()
    trouble(press("drive"))
    for _ in range(WAYS):
        visitor.wait_for_step("block")
        visitor.wait(lambda: visitor.status.get("mode") == "driving")
        trouble(nothing)
        visitor.wait_for_step("block")
        visitor.drive_and_give_up()
        trouble(press("continue"))
        answer_and_send(visitor, "intuitive", trouble)
    answer_and_send(visitor, "best", trouble)
    answer_and_send(visitor, "mental", trouble)
    answer_and_send(visitor, "comments", trouble)
    visitor.wait_for_step("end")
    trouble(nothing)
    visitor.wait_for_step("end")
    expect(visitor.page.get_by_test_id("code")).to_have_text("C0DE")


def press_and_confirm(visitor: StudyVisitor) -> Act:
    """Answer the question on the screen."""

    def act() -> None:
        visitor.page.get_by_test_id("stick").wait_for()
        visitor.press_stick(0.3, 0.6)
        visitor.release_stick()
        visitor.click("confirm")

    return act


def answer_and_send(visitor: StudyVisitor, first_item: str, trouble: Callable[[Act], None]) -> None:
    """Fill in a questionnaire, in trouble before it is sent."""

    def fill_in() -> None:
        # Again after the trouble: another tab knows nothing of what is not sent yet.
        visitor.wait_for_item(first_item)
        for item in visitor.page.locator(".item").all():
            words = item.locator("textarea")
            if words.count():
                words.fill("well")
            else:
                item.locator("input[type=radio]").first.check()

    def act() -> None:
        fill_in()
        visitor.click("send")

    fill_in()
    trouble(act)


def assert_nothing_lost_or_doubled(found: dict[str, Any]) -> None:
    """Everything that was given is there once."""
    kinds = Counter(row.kind for row in found["event"])
    assert kinds["consent"] == 1
    given = Counter(row.query_id for row in found["answer"])
    assert len(given) == QUESTIONS
    assert set(given.values()) == {1}
    assert [row.h_x is None for row in found["answer"]].count(True) == 1
    assert [row.state for row in found["job"]] == ["succeeded"]
    assert all(row.end is not None for row in found["drive"])
    assert [row.end for row in found["drive"]].count("given up") == WAYS
    said = Counter((row.step, row.item) for row in found["response"])
    assert set(said.values()) == {1}
    assert len(said) == 6 * WAYS + 2 + 6 + 1
    assert found["complaints"] == []
