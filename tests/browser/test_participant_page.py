"""The page as people treat it: reloading, going back, two tabs, keys alone, a server that dies."""

import re
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.study_visitor import go_to, make_study
from tests.browser.visitor import PHONE, Visitor, sign_up
from tests.running_server import Participant, RunningServer, running_server

HALF_PIXELS: dict[str, Any] = {"device_scale_factor": 0.5}


@pytest.fixture
def visitor(browser: Browser, server: RunningServer) -> Generator[Visitor]:
    (link,) = server.new_links()
    visitor = Visitor(browser, link, has_picture=False)
    yield visitor
    assert visitor.complaints == []
    visitor.close()


@pytest.fixture
def onlooker(browser: Browser, server: RunningServer) -> Generator[Visitor]:
    """A visitor whose page draws the picture."""
    (link,) = server.new_links()
    visitor = Visitor(browser, link, **HALF_PIXELS)
    yield visitor
    assert visitor.complaints == []
    visitor.close()


def answers(visitor: Visitor) -> list[object]:
    return [query["answer"] for query in Participant(visitor.link).session()["queries"]]


def test_reloading_at_every_step_keeps_the_place_and_what_was_given(visitor: Visitor) -> None:
    def reload_at(step: str) -> None:
        visitor.wait_for_step(step)
        visitor.page.reload()
        visitor.wait_for_step(step)

    reload_at("consent")
    visitor.click("begin")
    reload_at("practice")
    visitor.click("ready")
    reload_at("queries")
    visitor.answer(0.5, 0.5)
    visitor.answer(-0.5, 0.5)
    given = answers(visitor)
    reload_at("queries")
    assert visitor.question() == 3
    assert answers(visitor) == given
    for number in range(3, 8):
        visitor.answer(0.2 * (number - 5), -0.7)
    reload_at("training")
    visitor.click("drive")
    reload_at("driving")
    visitor.press_stick(0.0, 0.8)
    visitor.wait(lambda: visitor.status.get("hold") is None and visitor.status != {})
    visitor.release_stick()
    assert len([answer for answer in answers(visitor) if answer is not None]) == 7


def test_leaving_and_coming_back_with_the_back_button_repeats_nothing(visitor: Visitor) -> None:
    visitor.begin()
    visitor.answer(0.5, 0.5)
    given = answers(visitor)
    visitor.page.goto("about:blank")
    visitor.page.go_back()
    visitor.wait_for_step("queries")
    assert visitor.question() == 2
    assert answers(visitor) == given


def test_an_earlier_answer_can_be_seen_and_changed(visitor: Visitor) -> None:
    visitor.begin()
    visitor.answer(0.6, 0.0)
    visitor.click("query-dot-1")
    visitor.wait(lambda: visitor.question() == 1)
    stick = visitor.page.get_by_test_id("stick")
    expect(stick).to_have_attribute("data-x", re.compile(r"^0\.[56]"))
    visitor.press_stick(0.0, -0.7)
    visitor.release_stick()
    visitor.click("confirm")
    visitor.wait(lambda: answers(visitor)[0]["h"][1] < -0.5)  # type: ignore[index]


def test_i_cannot_say_brings_another_question(visitor: Visitor) -> None:
    visitor.begin()
    assert "of 7" in visitor.text("question")
    visitor.click("cant-say")
    visitor.wait(lambda: "of 8" in visitor.text("question"))
    assert answers(visitor)[0]["h"] is None  # type: ignore[index]


def test_keys_alone_are_enough_even_after_a_click_into_the_picture(onlooker: Visitor) -> None:
    keyboard = onlooker.page.keyboard
    onlooker.wait_for_step("consent")
    onlooker.page.get_by_test_id("begin").focus()
    keyboard.press("Enter")
    onlooker.wait_for_step("practice")
    onlooker.page.get_by_test_id("ready").focus()
    keyboard.press("Enter")
    onlooker.wait_for_step("queries")
    onlooker.page.locator("iframe").click()
    for number in range(1, 8):
        onlooker.wait(lambda number=number: onlooker.question() == number)
        key, axis = ("ArrowUp", "data-y") if number % 2 else ("d", "data-x")
        keyboard.down(key)
        stick = onlooker.page.get_by_test_id("stick")
        onlooker.wait(lambda: float(stick.get_attribute(axis) or 0) > 0.4)  # noqa: B023
        keyboard.up(key)
        keyboard.press("Enter")
    onlooker.wait_for_step("training")
    given = [answer["h"] for answer in answers(onlooker)]  # type: ignore[index]
    assert all(h[1] > 0.3 and abs(h[0]) < 0.1 for h in given[::2])
    assert all(h[0] > 0.3 and abs(h[1]) < 0.1 for h in given[1::2])


def start_driving(visitor: Visitor) -> None:
    go_to(visitor.link, "training")
    visitor.page.reload()
    visitor.wait_for_step("training")
    visitor.click("drive")
    visitor.wait_for_step("driving")
    visitor.wait(lambda: visitor.status.get("mode") == "driving")


def test_a_line_lost_for_ten_seconds_comes_back_steering(visitor: Visitor) -> None:
    start_driving(visitor)
    hold = visitor.page.get_by_test_id("hold")
    visitor.page.keyboard.down("ArrowUp")
    expect(hold).to_have_attribute("data-hold", "moving")
    visitor.context.set_offline(True)
    expect(hold).to_have_attribute("data-hold", "offline")
    visitor.page.keyboard.up("ArrowUp")
    visitor.page.wait_for_timeout(10_000)
    visitor.context.set_offline(False)
    expect(hold).to_have_attribute("data-hold", "released")
    # What the server learns of the old line's end takes nothing away.
    visitor.page.wait_for_timeout(3000)
    assert visitor.status["has_stick"]
    expect(visitor.page.get_by_test_id("take-stick")).to_be_hidden()
    visitor.page.keyboard.down("ArrowDown")
    expect(hold).to_have_attribute("data-hold", re.compile("moving|edge"))
    visitor.page.keyboard.up("ArrowDown")
    visitor.complaints.clear()  # of a line that is cut, browsers complain


@pytest.mark.soak
def test_a_push_held_still_for_a_minute_keeps_driving(visitor: Visitor) -> None:
    start_driving(visitor)
    visitor.press_stick(0.02, 0.1)
    visitor.wait(lambda: visitor.status["hold"] is None)
    visitor.page.wait_for_timeout(500)
    holds = set()
    for _ in range(600):
        visitor.page.wait_for_timeout(100)
        holds.add(visitor.status["hold"])
    assert holds <= {None, "edge"}
    visitor.release_stick()
    visitor.wait(lambda: visitor.status["hold"] == "released")


def test_the_newest_tab_steers_and_the_older_one_says_so(visitor: Visitor) -> None:
    start_driving(visitor)
    older = visitor.page
    visitor.page = visitor.open_tab()
    visitor.wait_for_step("driving")
    expect(older.get_by_test_id("take-stick")).to_be_visible()
    older.bring_to_front()
    older.get_by_test_id("take-stick").click()
    expect(older.get_by_test_id("take-stick")).to_be_hidden()
    expect(visitor.page.get_by_test_id("take-stick")).to_be_visible()


def test_the_page_outlives_a_killed_server(browser: Browser, tmp_path: Path) -> None:
    server = RunningServer(tmp_path)
    visitor = Visitor(browser, server.participant_link, **HALF_PIXELS)
    visitor.begin()
    visitor.answer(0.5, 0.5)
    server.kill()
    expect(visitor.page.get_by_test_id("banner")).to_be_visible()
    visitor.press_stick(-0.5, 0.5)
    visitor.release_stick()
    visitor.click("confirm")  # nobody is there to take it
    visitor.page.wait_for_timeout(1500)
    with running_server(tmp_path, port=server.port):
        visitor.wait(lambda: visitor.question() == 3)
        given = answers(visitor)
        assert [answer is not None for answer in given] == [True, True, *[False] * 5]
        expect(visitor.page.get_by_test_id("banner")).to_be_hidden()
        # The picture came back by itself: the next move is played in it.
        frame = visitor.page.frame_locator("iframe")
        expect(frame.locator("canvas").first).to_be_visible()
    visitor.close()


def test_who_stops_trying_it_out_hears_that_everything_is_erased(visitor: Visitor) -> None:
    visitor.begin()
    visitor.answer(0.5, 0.5)
    visitor.click("withdraw")
    visitor.click("withdraw-erase")
    visitor.wait_for_step("end")
    for _ in range(2):
        expect(visitor.page.get_by_test_id("farewell")).to_contain_text("erased")
        visitor.page.reload()
        visitor.wait_for_step("end")
    assert visitor.page.get_by_test_id("stick").count() == 0


def test_the_picture_is_the_arm_and_the_table_alone(onlooker: Visitor) -> None:
    onlooker.begin()
    frame = onlooker.page.frame_locator("iframe")
    expect(frame.locator("canvas").first).to_be_visible()
    visible = frame.locator("body *:visible").evaluate_all(
        "nodes => nodes.filter(n => n.tagName !== 'CANVAS' && !n.querySelector('canvas'))"
        ".map(n => n.outerHTML.slice(0, 80))"
    )
    assert visible == []


def test_a_phone_needs_no_scrolling_to_answer_or_to_steer(
    browser: Browser, server: RunningServer
) -> None:
    (link,) = server.new_links()
    visitor = Visitor(browser, link, PHONE, has_touch=True, is_mobile=True, has_picture=False)
    visitor.begin()
    for name in ("stick", "confirm", "cant-say", "play-again", "question"):
        box = visitor.page.get_by_test_id(name).bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["y"] >= 0
        assert box["x"] + box["width"] <= PHONE["width"] + 1
        assert box["y"] + box["height"] <= PHONE["height"] + 1, name
    visitor.close()


def test_the_dashboard_gives_out_a_link_that_works(browser: Browser, server: RunningServer) -> None:
    study = make_study(server)
    office = server.experimenter()
    invited = office.post("/api/v1/invitations", json={"role": "owner"}).raise_for_status()
    page = browser.new_page()
    sign_up(page, server, invited.json()["link"])
    page.get_by_test_id(f"study-{study}").click()
    page.get_by_test_id("new-participant").click()
    link = page.get_by_test_id("link")
    expect(link).to_be_visible()
    assert Participant(link.input_value()).session()["step"] == "consent"
    (made,) = office.get(f"/api/v1/studies/{study}/participants").json()["participants"]
    expect(page.get_by_test_id(f"participant-{made['label']}")).to_be_visible()
    page.close()
