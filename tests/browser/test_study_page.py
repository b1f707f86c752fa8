"""A participant's page in a study: by keyboard, reloaded, pressed twice, offline, in two tabs."""

import re
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

from app.storage.tables import DriveRow, EventRow, ResponseRow
from tests.browser.study_visitor import StudyVisitor, go_to, link_of, make_study
from tests.browser.visitor import PHONE
from tests.running_server import Participant, RunningServer, running_server

NAMES = re.compile("no-align|no-priors|all-priors|task-space")
SMALL_PICTURE = {"device_scale_factor": 0.5}


@pytest.fixture(scope="module")
def study(server: RunningServer) -> str:
    return make_study(server)


def rows_of(server: RunningServer, table: Any, study: str, link: str) -> list[Any]:
    """What the database holds of the person with a link."""
    lines = server.experimenter().get(f"/api/v1/studies/{study}/participants?limit=200")
    label = {line["id"]: line for line in lines.raise_for_status().json()["participants"]}
    key = Participant(link).session()["key"]
    # Everyone here is at a step of their own; the newest of those at this step is meant.
    at_it = [line for line in label.values() if line["step"]["key"] == key]
    participant_id = max(at_it, key=lambda line: line["created_at"])["id"]
    return [row for row in server.rows(table) if row.participant_id == participant_id]


def press_until(page: Page, key: str, wanted: str, limit: int = 80) -> None:
    """Press a key until what has the focus matches a selector."""
    for _ in range(limit):
        if page.evaluate("wanted => document.activeElement.matches(wanted)", wanted):
            return
        page.keyboard.press(key)
    raise AssertionError(f"{key} did not lead to {wanted}")


def tab_to(page: Page, name: str) -> None:
    press_until(page, "Tab", f"[data-testid='{name}']")


def test_a_whole_study_by_keyboard_alone(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    visitor = StudyVisitor(browser, link, **SMALL_PICTURE)
    page, keyboard = visitor.page, visitor.page.keyboard
    stick = page.get_by_test_id("stick")

    def press(name: str) -> None:
        tab_to(page, name)
        keyboard.press("Enter")

    visitor.wait_for_step("consent")
    press("begin")
    visitor.wait_for_step("practice")
    press("ready")
    visitor.wait_for_step("queries")
    for number in range(1, 6):
        visitor.wait(lambda number=number: visitor.question() == number)
        keyboard.down("ArrowUp")
        visitor.wait(lambda: float(stick.get_attribute("data-y") or 0) > 0.3)
        keyboard.up("ArrowUp")
        keyboard.press("Enter")
    visitor.wait_for_step("training")
    expect(page.get_by_test_id("drive")).to_be_enabled()
    press("drive")
    for way in (1, 2):
        visitor.wait_for_step("block")
        expect(page.locator("h1")).to_be_focused()
        expect(page.locator("h1")).to_have_text(f"Go round: way of steering {way} of 2")
        expect(page.get_by_test_id("another-way")).to_have_count(way - 1)
        visitor.wait(lambda: visitor.status.get("mode") == "driving")
        steered = visitor.steered
        keyboard.down("ArrowDown")
        visitor.wait(lambda before=steered: visitor.steered > before)
        keyboard.up("ArrowDown")
        press("give-up")
        expect(page.get_by_test_id("continue")).to_be_focused()  # where the hand goes on
        keyboard.press("Enter")
        visitor.wait_for_step("questions")
        visitor.wait_for_item("intuitive")
        for _ in range(6):
            keyboard.press("Tab")
            keyboard.press("Space")
            keyboard.press("ArrowRight")
        expect(page.locator("input[value='2']:checked")).to_have_count(6)
        press("send")
    visitor.wait_for_item("best")
    keyboard.press("Tab")
    keyboard.press("ArrowDown")
    expect(page.get_by_label("Second way")).to_be_checked()
    keyboard.press("Tab")
    keyboard.type("it did what I meant")
    press("send")
    visitor.wait_for_item("mental")
    for _ in range(6):
        keyboard.press("Tab")
        keyboard.press("ArrowUp")  # round to the last: would rather not say
    expect(page.locator("[data-decline]:checked")).to_have_count(6)
    press("send")
    visitor.wait_for_item("comments")
    press("send")
    expect(page.locator("textarea")).to_be_focused()  # it is open still
    keyboard.type("none")
    press("send")
    visitor.wait_for_step("end")
    press("copy")
    expect(page.locator(".code-line [role=status]")).not_to_be_empty()
    tab_to(page, "return")
    expect(page.get_by_test_id("return")).to_have_attribute(
        "href", "https://example.org/done?cc=C0DE"
    )
    said = {row.item: row.value for row in rows_of(server, ResponseRow, study, link)}
    assert said["best"] == "2"
    assert said["why"] == '"it did what I meant"'
    assert said["mental"] is None
    assert visitor.complaints == []
    visitor.close()


def test_nothing_that_the_page_gets_names_a_way_of_steering(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    visitor = StudyVisitor(browser, link, **SMALL_PICTURE)
    visitor.begin()
    go_to(link, "training")
    visitor.page.reload()
    visitor.wait_for_step("training")
    visitor.click("drive")
    visitor.drive_and_give_up()
    visitor.click("continue")
    visitor.wait_for_item("intuitive")
    texts = {url: httpx.get(url).text for url in visitor.fetched if url.startswith("http")}
    assert any(url.endswith("/session") for url in texts)
    assert any(url.endswith("/training") for url in texts)
    assert any("/scene/" in url for url in texts)
    assert any(url.endswith("steps/block.js") for url in texts)
    assert any(url.endswith(".css") for url in texts)
    assert len(visitor.heard) > 20
    for url, text in texts.items():
        assert NAMES.search(text) is None, url
    for frame in visitor.heard:
        assert NAMES.search(frame) is None, frame
    visitor.close()


def test_a_block_that_is_reloaded_goes_on_with_the_same_attempt(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    for _ in range(2):
        visitor.wait_for_step("block")
        visitor.wait(lambda: visitor.status.get("drive_id") is not None)
        first = visitor.status["drive_id"]
        visitor.page.reload()
        visitor.wait_for_step("block")
        visitor.status = {}
        visitor.wait(lambda: visitor.status.get("drive_id") is not None)
        assert visitor.status["drive_id"] == first
    visitor.drive_and_give_up()
    visitor.page.reload()
    visitor.wait_for_step("block")
    visitor.page.wait_for_timeout(2500)  # longer than a lost drive is left lost
    expect(visitor.page.get_by_test_id("banner")).to_have_count(0)
    expect(visitor.page.get_by_test_id("again")).to_be_hidden()
    visitor.click("continue")
    visitor.wait_for_item("intuitive")
    assert len(rows_of(server, DriveRow, study, link)) == 1
    assert visitor.complaints == []
    visitor.close()


def test_every_button_pressed_twice_does_its_thing_once(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page

    def press_twice(name: str) -> None:
        """The second time when the page has followed the first already."""
        box = page.get_by_test_id(name).bounding_box()
        assert box is not None
        where = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(*where)
        for count in (1, 2):
            page.mouse.down(click_count=count)
            page.mouse.up(click_count=count)
            page.wait_for_timeout(150)

    visitor.wait_for_step("consent")
    press_twice("begin")
    visitor.wait_for_step("practice")
    press_twice("ready")
    visitor.wait_for_step("queries")
    press_twice("cant-say")
    visitor.wait(lambda: visitor.question() == 2)
    page.wait_for_timeout(500)
    assert visitor.sent.count("answers") == 1
    go_to(link, "training")
    page.reload()
    visitor.wait_for_step("training")
    expect(page.get_by_test_id("drive")).to_be_enabled()
    press_twice("drive")
    visitor.wait_for_step("block")
    expect(page.get_by_test_id("attempt-says")).to_contain_text("Go once round")
    press_twice("give-up")
    expect(page.get_by_test_id("continue")).to_be_visible()
    press_twice("continue")
    visitor.wait_for_item("intuitive")
    visitor.answer_all()
    page.get_by_test_id("send").scroll_into_view_if_needed()
    press_twice("send")
    visitor.wait_for_step("block")
    page.wait_for_timeout(500)
    assert visitor.step() == "block"
    for path in ("consent", "practice", "driving", "block", "questions"):
        assert visitor.sent.count(path) == 1, path
    events = rows_of(server, EventRow, study, link)
    assert len({event.id for event in events}) == len(events)
    expect(page.get_by_test_id("banner")).to_have_count(0)
    visitor.close()


def test_the_rest_of_a_double_click_does_not_answer_the_next_question(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    go_to(link, "queries")
    visitor = StudyVisitor(browser, link, has_picture=False)
    visitor.wait_for_step("queries")
    # By the page itself: a browser without a graphics card is too slow for a real double click.
    visitor.page.evaluate(
        """() => new Promise((done) => {
          const heading = document.querySelector('[data-testid=question]')
          const button = document.querySelector('[data-testid=cant-say]')
          const again = new MouseEvent('click', { bubbles: true, cancelable: true, detail: 2 })
          new MutationObserver((_, self) => {
            if (!/Question 2/.test(heading.textContent)) return
            self.disconnect()
            setTimeout(() => done(button.disabled || button.dispatchEvent(again)), 100)
          }).observe(heading, { childList: true, characterData: true, subtree: true })
          button.click()
        })"""
    )
    visitor.page.wait_for_timeout(800)
    assert visitor.sent.count("answers") == 1
    visitor.click("cant-say")  # and one that is meant does
    visitor.wait(lambda: visitor.question() == 3)
    visitor.close()


def test_a_block_that_is_over_stays_over_when_the_server_is_killed(
    browser: Browser, tmp_path: Path
) -> None:
    server = RunningServer(tmp_path, training_steps=20)
    link = link_of(server, make_study(server))
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page
    visitor.drive_and_give_up()
    page.wait_for_timeout(500)
    server.kill()
    expect(page.get_by_test_id("banner")).to_be_visible()
    visitor.status = {}
    with running_server(tmp_path, port=server.port, training_steps=20):
        visitor.wait(lambda: visitor.status != {})
        expect(page.get_by_test_id("banner")).to_be_hidden()
        page.wait_for_timeout(2000)
        assert visitor.sent.count("drives") == 1
        visitor.click("continue")
        visitor.wait_for_item("intuitive")
    visitor.close()


def test_what_was_said_outlives_a_reload_and_the_back_button(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page
    visitor.drive_and_give_up()
    visitor.click("continue")
    visitor.wait_for_item("intuitive")
    page.locator("[data-item=easy] input[value='6']").check()
    page.locator("[data-item=undo] [data-decline]").check()
    page.reload()
    visitor.wait_for_item("intuitive")
    page.goto("about:blank")
    page.go_back()
    visitor.wait_for_item("intuitive")
    expect(page.locator("[data-item=easy] input[value='6']")).to_be_checked()
    expect(page.locator("[data-item=undo] [data-decline]")).to_be_checked()
    expect(page.locator("input:checked")).to_have_count(2)
    visitor.click("send")
    expect(page.get_by_test_id("questions-state")).to_contain_text("4 questions are still open")
    expect(page.get_by_test_id("questions-state")).to_contain_text("The arm moved as I expected")
    expect(page.locator("[data-item=intuitive] input").first).to_be_focused()
    expect(page.locator("[data-missing]")).to_have_count(4)
    page.locator("[data-item=intuitive] input").first.check()
    expect(page.locator("[data-missing]")).to_have_count(3)
    assert "questions" not in visitor.sent
    visitor.close()


def test_words_and_declining_exclude_each_other(browser: Browser, server: RunningServer) -> None:
    only_words = {"at_the_end": [], "after_each_strategy": ["comments"], "after_each_task": []}
    study = make_study(server, questionnaires=only_words, strategies=["no-align"])
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page, area = visitor.page, visitor.page.locator("textarea")
    visitor.drive_and_give_up()
    visitor.click("continue")
    visitor.wait_for_item("comments")
    area.fill("something")
    page.locator("[data-decline]").check()
    expect(area).to_have_value("")
    area.fill("after all")
    expect(page.locator("[data-decline]")).not_to_be_checked()
    area.fill("  ")
    visitor.click("send")
    expect(page.get_by_test_id("questions-state")).to_contain_text("Still open")
    area.fill("<b>after all</b>")
    page.reload()
    expect(area).to_have_value("<b>after all</b>")
    visitor.click("send")
    visitor.wait_for_step("end")
    (row,) = rows_of(server, ResponseRow, study, link)
    assert row.value == '"<b>after all</b>"'
    assert abs((row.received_at - row.answered_at).total_seconds()) < 60.0
    assert page.evaluate("sessionStorage.length") == 0
    visitor.close()


def test_offline_nothing_is_lost_and_the_page_goes_on_by_itself(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page
    visitor.drive_and_give_up()
    visitor.context.set_offline(True)
    visitor.click("continue")
    expect(page.get_by_test_id("continue")).to_be_disabled()
    page.wait_for_timeout(1000)
    assert visitor.step() == "block"
    visitor.context.set_offline(False)
    visitor.wait_for_item("intuitive")
    visitor.answer_all()
    visitor.context.set_offline(True)
    visitor.click("send")
    expect(page.get_by_test_id("questions-state")).to_contain_text("trying again")
    visitor.context.set_offline(False)
    visitor.wait_for_step("block")
    responses = rows_of(server, ResponseRow, study, link)
    assert len(responses) == 6
    assert all(row.value == "1" for row in responses)
    visitor.close()


def test_a_second_tab_that_is_behind_catches_up_and_changes_nothing(
    browser: Browser, server: RunningServer, study: str
) -> None:
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, has_picture=False)
    visitor.drive_and_give_up()
    visitor.click("continue")
    visitor.wait_for_item("intuitive")
    first = visitor.page
    visitor.answer_all(choice=3)
    visitor.page = visitor.open_tab()
    visitor.wait_for_item("intuitive")
    visitor.answer_all(choice=5)
    visitor.click("send")
    visitor.wait_for_step("block")
    first.get_by_test_id("send").click()
    expect(first.locator("body")).to_have_attribute("data-step", "block")
    responses = rows_of(server, ResponseRow, study, link)
    assert [row.value for row in responses] == ["6"] * 6
    visitor.close()


@pytest.mark.parametrize(
    ("choice", "words"), [("keep", "marked as withdrawn"), ("erase", "erased")]
)
def test_who_stops_hears_what_becomes_of_what_they_gave(
    browser: Browser, server: RunningServer, study: str, choice: str, words: str
) -> None:
    link = link_of(server, study)
    go_to(link, "block")
    visitor = StudyVisitor(browser, link, viewport=PHONE, has_picture=False)
    page = visitor.page
    visitor.drive_and_give_up()
    visitor.click("continue")
    visitor.wait_for_item("intuitive")
    visitor.answer_all()
    visitor.click("withdraw")
    expect(page.get_by_test_id("stay")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    visitor.click("withdraw")
    page.get_by_test_id(f"withdraw-{choice}").dblclick()
    visitor.wait_for_step("end")
    for _ in range(2):
        expect(page.get_by_test_id("end")).to_have_attribute("data-state", "withdrawn")
        expect(page.get_by_test_id("farewell")).to_contain_text(words)
        page.reload()
        visitor.wait_for_step("end")
    expect(page.get_by_test_id("withdraw")).to_be_hidden()
    assert visitor.sent.count("withdraw") == 1
    kept = page.evaluate("Object.keys(sessionStorage)")
    assert not any(place.startswith("joymap questions") for place in kept)
    assert visitor.complaints == []
    visitor.close()
