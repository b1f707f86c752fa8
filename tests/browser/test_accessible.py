"""Every page of a participant: axe-core in both colour schemes, 200 % zoom, calm, a stick to hear.

The dashboard's pages are looked at where they are tested.
"""

import re

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from tests.browser.study_visitor import (
    PROTOCOL,
    StudyVisitor,
    go_to,
    link_of,
    make_study,
)
from tests.browser.visitor import LAPTOP
from tests.running_server import RunningServer

ZOOMED = {"width": 640, "height": 400}  # a laptop at 200 %
NARROW = {"width": 390, "height": 844}


def check(page: Page, where: str) -> None:
    """No violations in either scheme, nothing moves by itself, no scrolling sideways."""
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        # What viser draws in its frame is a picture; its page is not ours.
        found = Axe().run(page, options={"iframes": False})
        assert found.violations_count == 0, f"{where}, {scheme}: {found.generate_report()}"
    assert page.evaluate("document.getAnimations().length") == 0, where
    for viewport in (ZOOMED, NARROW):
        page.set_viewport_size(viewport)  # type: ignore[arg-type]
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= viewport["width"], f"{where}: {wide} px"
    page.set_viewport_size(LAPTOP)


def test_every_page_of_a_study_is_accessible(browser: Browser, server: RunningServer) -> None:
    hand = {"key": "hand", "kind": "choice", "text": "Which hand?", "choices": ["Left", "Right"]}
    background = {"name": "background", "title": "About you", "intro": "A word.", "items": [hand]}
    asked = PROTOCOL["questionnaires"] | {"at_the_end": ["nasa-tlx", "comments", "background"]}
    study = make_study(
        server, questionnaires=asked, own_questionnaires=[background], arrows="switch"
    )
    shared = server.experimenter().post(f"/api/v1/studies/{study}/link").json()["link"]
    visitor = StudyVisitor(browser, shared, has_picture=False)
    page = visitor.page
    expect(page.get_by_test_id("join")).to_be_visible()
    check(page, "join")
    visitor.click("join")
    visitor.wait_for_step("consent")
    link = page.url
    check(page, "consent")
    visitor.click("begin")
    visitor.wait_for_step("practice")
    check(page, "practice")
    visitor.click("ready")
    visitor.wait_for_step("queries")
    check(page, "queries")
    page.get_by_test_id("stick").focus()
    page.keyboard.press("ArrowUp")
    check(page, "queries, answered")
    go_to(link, "training")
    page.reload()
    visitor.wait_for_step("training")
    expect(page.get_by_test_id("drive")).to_be_enabled()
    check(page, "training")
    visitor.click("drive")
    for way in (1, 2):
        visitor.wait_for_step("block")
        expect(page.get_by_test_id("give-up")).to_be_visible()
        if way == 2:
            check(page, "block")
        visitor.drive_and_give_up()
        if way == 2:
            check(page, "block, over")
        visitor.click("continue")
        visitor.wait_for_item("intuitive")
        if way == 1:
            visitor.click("send")
            check(page, "questions, still open")
        visitor.answer_all()
        visitor.click("send")
    for item in ("best", "mental", "comments", "hand"):
        visitor.wait_for_item(item)
        check(page, item)
        page.locator("[data-decline]").first.check()
        if item == "hand":
            visitor.click("withdraw")
            check(page, "withdraw")
            visitor.click("stay")
        for each in page.locator("[data-decline]").all():
            each.check()
        visitor.click("send")
    visitor.wait_for_step("end")
    expect(page.get_by_test_id("code")).to_be_visible()
    check(page, "end")
    assert visitor.complaints == []
    visitor.close()


def test_the_page_of_who_left_is_accessible(browser: Browser, server: RunningServer) -> None:
    link = link_of(server, make_study(server))
    go_to(link, "practice")
    visitor = StudyVisitor(browser, link, has_picture=False)
    visitor.wait_for_step("practice")
    visitor.click("withdraw")
    visitor.click("withdraw-erase")
    visitor.wait_for_step("end")
    check(visitor.page, "left")
    visitor.close()


def test_free_driving_is_accessible(browser: Browser, server: RunningServer) -> None:
    (link,) = server.new_links()
    go_to(link, "training")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page
    visitor.wait_for_step("training")
    expect(page.get_by_test_id("drive")).to_be_enabled()
    check(page, "training")
    visitor.click("drive")
    visitor.wait_for_step("driving")
    visitor.wait(lambda: visitor.status.get("mode") == "driving")
    check(page, "driving")
    visitor.click("adjust-stick")
    check(page, "stick settings")
    assert visitor.complaints == []
    visitor.close()


def test_a_study_of_many_stages_fits_a_phone(browser: Browser, server: RunningServer) -> None:
    tasks = [
        {"task": task, "labels": 5, "unlabelled": 100}
        for task in ("fetch-and-pour", "pour-cup", "avoid")
    ]
    link = link_of(server, make_study(server, tasks=tasks))
    go_to(link, "queries")
    visitor = StudyVisitor(browser, link, viewport=NARROW, has_picture=False)
    page = visitor.page
    visitor.wait_for_step("queries")
    stages = page.locator("#way li")
    expect(stages).to_have_count(7)

    def is_whole() -> bool:
        whole: bool = page.evaluate(
            "() => { const shown = document.querySelector('#way [aria-current] span');"
            " return shown.scrollWidth <= shown.clientWidth + 1 }"
        )
        return whole and page.evaluate("document.documentElement.scrollWidth") <= 390

    assert is_whole()
    # As the page would draw a study with five tasks more.
    page.evaluate(
        "() => { const list = document.querySelector('#way ol');"
        " for (let i = 0; i < 5; i += 1) list.append(list.lastChild.cloneNode(true)) }"
    )
    expect(stages).to_have_count(12)
    assert is_whole()
    last = stages.last.bounding_box()
    assert last is not None
    assert last["x"] + last["width"] <= 390
    visitor.close()


def test_the_stick_has_a_role_a_name_and_a_value(browser: Browser, server: RunningServer) -> None:
    link = link_of(server, make_study(server))
    go_to(link, "queries")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page = visitor.page
    visitor.wait_for_step("queries")
    stick = page.get_by_role("slider", name="Joystick: your answer")
    expect(stick).to_have_attribute("aria-roledescription", "joystick")
    expect(stick).to_have_attribute("aria-valuetext", "Nothing marked yet")
    expect(stick).to_have_accessible_description(page.locator("#stick-hint").inner_text())
    mark = page.get_by_test_id("stick")
    for name, says, axis in (("ArrowUp", "forward", "data-y"), ("ArrowRight", "right", "data-x")):
        page.keyboard.down(name)
        visitor.wait(lambda axis=axis: float(mark.get_attribute(axis) or 0) > 0.3)
        page.keyboard.up(name)
        expect(stick).to_have_attribute("aria-valuetext", re.compile(says))
    assert int(stick.get_attribute("aria-valuenow") or 0) > 0
    visitor.close()


def test_one_key_at_a_time_is_enough(browser: Browser, server: RunningServer) -> None:
    """Diagonal answers need no two keys at once, and no mouse."""
    link = link_of(server, make_study(server))
    go_to(link, "queries")
    visitor = StudyVisitor(browser, link, has_picture=False)
    page, stick = visitor.page, visitor.page.get_by_test_id("stick")
    visitor.wait_for_step("queries")
    for key, axis in (("w", "data-y"), ("d", "data-x")):
        page.keyboard.down(key)
        visitor.wait(lambda axis=axis: float(stick.get_attribute(axis) or 0) > 0.3)
        page.keyboard.up(key)
    assert float(stick.get_attribute("data-y") or 0) > 0.3
    page.keyboard.press("Enter")
    visitor.wait(lambda: visitor.question() == 2)
    visitor.close()
