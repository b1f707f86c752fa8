"""A person's own stick: set by keys alone, kept through trouble, and the same on another device."""

from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.visitor import PHONE, Visitor
from tests.running_server import Participant, RunningServer


def pushed(visitor: Visitor, pad: str) -> tuple[float, float]:
    """Where a pad shows the stick."""
    stick = visitor.page.get_by_test_id(pad)
    return float(stick.get_attribute("data-x") or 0), float(stick.get_attribute("data-y") or 0)


def test_the_stick_is_set_by_keys_alone_through_a_lost_line_for_every_device(
    browser: Browser, server: RunningServer
) -> None:
    (link,) = server.new_links()
    visitor = Visitor(browser, link, has_picture=False)
    page, keyboard = visitor.page, visitor.page.keyboard
    visitor.wait_for_step("consent")
    visitor.click("begin")
    visitor.wait_for_step("practice")
    page.get_by_test_id("adjust-stick").focus()
    keyboard.press("Enter")
    saved = page.get_by_test_id("stick-saved")
    keyboard.down("ArrowUp")  # the pad to try has the focus
    visitor.wait(lambda: pushed(visitor, "stick-trial") == (0.0, 1.0))
    assert pushed(visitor, "stick") == (0.0, 0.0)
    keyboard.up("ArrowUp")
    page.get_by_test_id("stick-gain").focus()
    keyboard.press("ArrowRight")
    keyboard.press("ArrowRight")
    expect(page.get_by_test_id("stick-push")).to_have_text("Half way")
    expect(saved).to_have_text("Saved.")
    page.route("**/api/stick", lambda route: route.abort())
    page.get_by_test_id("stick-invert_y").focus()
    keyboard.press("Space")
    expect(saved).to_contain_text("The server cannot be reached just now.")
    page.unroute("**/api/stick")
    expect(saved).to_have_text("Saved.")
    stick = Participant(visitor.link).session()["stick"]
    assert stick["invert_y"]
    assert stick["gain"] == 2.0
    keyboard.press("Escape")
    expect(page.get_by_test_id("adjust-stick")).to_be_focused()
    # The stick is the person's again a moment after the dialog gives the focus back.
    expect(page.get_by_test_id("stick")).to_have_attribute("aria-disabled", "false")
    keyboard.down("ArrowUp")
    visitor.wait(lambda: pushed(visitor, "stick") == (0.0, -1.0))
    keyboard.up("ArrowUp")
    visitor.wait(lambda: pushed(visitor, "stick") == (0.0, 0.0))
    visitor.click("ready")
    visitor.wait_for_step("queries")
    assert visitor.complaints == []
    visitor.close()

    phone = Visitor(browser, link, PHONE, has_picture=False)
    phone.wait_for_step("queries")
    phone.answer(0.3, 0.1)
    x, y = Participant(phone.link).session()["queries"][0]["answer"]["h"]
    assert (x, y) == pytest.approx((0.6, 0.2), abs=0.05)
    assert phone.complaints == []
    phone.close()


def test_the_arm_holds_while_the_stick_is_set_and_then_follows_it(
    browser: Browser, server: RunningServer
) -> None:
    (link,) = server.new_links()
    participant = Participant(link)
    for number, query in enumerate(participant.begin()["queries"]):
        participant.answer(query["id"], (0.3 * (number - 3), 0.5)).raise_for_status()
    participant.wait_for_training()
    participant.post("driving").raise_for_status()
    visitor = Visitor(browser, link, has_picture=False)
    visitor.wait_for_step("driving")
    visitor.wait(lambda: visitor.status.get("mode") == "driving")
    visitor.click("adjust-stick")
    press_trial(visitor, 0.3, 0.0)
    visitor.wait(lambda: pushed(visitor, "stick-trial")[0] > 0.2)
    visitor.page.wait_for_timeout(300)
    assert visitor.status["stick"] == [0, 0]
    assert visitor.status["hold"] == "released"
    visitor.release_stick()
    visitor.page.get_by_test_id("stick-gain").fill("3")
    expect(visitor.page.get_by_test_id("stick-saved")).to_have_text("Saved.")
    visitor.click("close-stick")
    visitor.press_stick(0.3, 0.0)
    visitor.wait(lambda: visitor.status["stick"][0] > 0.8)
    visitor.release_stick()
    visitor.wait(lambda: visitor.status["stick"] == [0, 0])
    assert visitor.complaints == []
    visitor.close()


def press_trial(visitor: Visitor, x: float, y: float) -> None:
    box: Any = visitor.page.get_by_test_id("stick-trial").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    visitor.page.mouse.move(*middle)
    visitor.page.mouse.down()
    radius = box["width"] / 2
    visitor.page.mouse.move(middle[0] + x * radius, middle[1] - y * radius, steps=3)
