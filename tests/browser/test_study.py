"""A whole study in a real browser: an experimenter makes it, people take part, one withdraws."""

import uuid
from collections.abc import Generator
from typing import Any

import httpx
import pytest
import yaml
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from app import texts
from app.schemas.protocol import LEARNABLE, NO_ALIGN
from models.tasks import TASKS
from tests.browser.visitor import LAPTOP, PHONE, Visitor, sign_up
from tests.running_server import Participant, RunningServer, running_server

PROTOCOL = {
    "title": "A small study",
    "tasks": [{"task": "avoid", "labels": 5, "unlabelled": 100}],
    "strategies": [NO_ALIGN, "no-priors"],
    "practice_s": 5,
    "questionnaires": {"after_each_strategy": ["steering"], "after_each_task": ["preference"]},
    "completion": {"code": "C0DE"},
}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Generator[RunningServer]:
    with running_server(tmp_path_factory.mktemp("study"), training_steps=20) as server:
        yield server


def assert_accessible(page: Page) -> None:
    # What viser draws in its frame is a picture; its page is not ours.
    found = Axe().run(page, options={"iframes": False})
    assert found.violations_count == 0, found.generate_report()


def test_people_take_part_in_a_study_made_in_the_browser(
    browser: Browser, server: RunningServer
) -> None:
    office = browser.new_context(viewport=LAPTOP, reduced_motion="reduce").new_page()
    errors: list[str] = []
    office.on("pageerror", lambda error: errors.append(str(error)))
    sign_up(office, server)
    office.get_by_test_id("new-study").click()
    expect(office.get_by_test_id("steps")).to_contain_text("way 3")
    for task in TASKS.values():  # a new one is there without a change to the page
        offered = office.get_by_label(texts.title_of(task.name), exact=True)
        expect(offered).to_have_count(int(task.has_goal))
    assert_accessible(office)
    office.get_by_test_id("yaml").fill("title: [")
    expect(office.get_by_test_id("protocol-error")).to_contain_text("line")
    office.get_by_test_id("yaml").fill(yaml.safe_dump(PROTOCOL))
    expect(office.get_by_test_id("steps")).to_contain_text("9 steps")
    office.get_by_test_id("make-study").click()
    office.wait_for_url("**/studies/*")
    study_page = office.url
    office.get_by_test_id("share").click()
    link = office.get_by_test_id("link").input_value()
    assert_accessible(office)

    sent: list[str] = []
    person = Joined(browser, link + "?PROLIFIC_PID=5f3c", sent)
    person.page.get_by_test_id("join").click()
    person.wait_for_step("consent")
    assert_accessible(person.page)
    own = person.page.url
    person.begin()
    assert_accessible(person.page)
    answer_everything(own)
    person.page.reload()
    person.wait_for_step("training")
    person.click("drive")
    for way in (1, 2):
        person.wait_for_step("block")
        expect(person.page.get_by_test_id("way-of-steering")).to_contain_text(f"{way} of 2")
        expect(person.page.get_by_test_id("attempt-says")).to_contain_text("Go once round")
        person.page.reload()  # and the attempt goes on
        person.wait_for_step("block")
        expect(person.page.get_by_test_id("attempt-says")).to_contain_text("Go once round")
        assert_accessible(person.page)
        if way == 1:
            watch(office, study_page)
        person.click("give-up")
        person.click("continue")
        person.wait_for_step("questions")
        fill_in(person, way)
    fill_in(person, 2)
    expect(person.page.get_by_test_id("code")).to_have_text("C0DE")
    assert_accessible(person.page)
    assert person.complaints == []
    assert len(person.scripts) > 20
    sent += [httpx.get(script).text for script in person.scripts]
    for name in (NO_ALIGN, *LEARNABLE):
        assert not any(name in text for text in sent), name

    person.page.goto(link + "?PROLIFIC_PID=5f3c")
    person.page.get_by_test_id("join").click()
    person.wait_for_step("end")  # the same browser, where they were
    other = Joined(browser, link, [], viewport=PHONE)
    other.page.get_by_test_id("join").click()
    other.wait_for_step("consent")
    other.begin()
    other.click("withdraw")
    assert_accessible(other.page)
    other.click("withdraw-erase")
    other.wait_for_step("end")
    expect(other.page.get_by_test_id("end")).to_have_attribute("data-state", "withdrawn")
    for visitor in (person, other):
        visitor.close()

    expect(office.locator("#summary")).to_contain_text("1 done, 0 under way, 0 gone, 1 withdrew")
    look_at_figures(office)
    office.get_by_role("link", name="P-2").click()
    expect(office.get_by_test_id("drives")).to_contain_text("given up")
    assert_accessible(office)
    play_a_move(office)
    office.get_by_test_id("reason").fill("was only trying")
    office.get_by_test_id("exclude").click()
    expect(office.locator("#facts")).to_contain_text("excluded: was only trying")
    office.goto(f"{server.base_url}/account")
    expect(office.locator("#audit")).to_contain_text("participant.exclude")
    assert_accessible(office)
    office.get_by_test_id("log-out").click()
    office.wait_for_url("**/login")
    assert_accessible(office)
    assert errors == []
    office.context.close()


def test_a_shared_link_brings_nobody_to_anothers_place(
    browser: Browser, server: RunningServer
) -> None:
    office, study = server.experimenter(), f"/api/v1/studies/{uuid.uuid4()}"
    made = {"id": study.rsplit("/", 1)[1], "protocol": PROTOCOL}
    office.post("/api/v1/studies", json=made).raise_for_status()
    link = office.post(f"{study}/link").raise_for_status().json()["link"]
    named = f"{link}?PROLIFIC_PID=5f3c"
    person, stranger = Joined(browser, named, []), Joined(browser, named, [])
    person.page.get_by_test_id("join").click()
    person.wait_for_step("consent")
    first = person.page.url
    stranger.page.get_by_test_id("join").click()
    expect(stranger.page.get_by_role("status")).to_contain_text("takes part with this id already")
    assert stranger.page.url == named
    assert_accessible(stranger.page)
    assert httpx.get(f"{first}/api/session").json()["step"] == "consent"
    person.page.goto(named)
    person.page.get_by_test_id("join").click()
    person.wait_for_step("consent")  # the same browser, where they were
    assert person.page.url != first
    assert httpx.get(f"{first}/api/session").status_code == 404
    for visitor in (person, stranger):
        visitor.close()


def play_a_move(office: Page) -> None:
    """An answer's move is played in the scene, with the stick they gave."""
    office.get_by_test_id("play-move").first.click()
    expect(office.locator("body")).to_have_attribute("data-ready", "true")
    expect(office.get_by_test_id("says")).to_contain_text("They gave")
    office.get_by_test_id("play").click()
    expect(office.locator("body")).to_have_attribute("data-tick", "60")
    assert_accessible(office)
    office.locator("#back").click()
    expect(office.locator("body")).to_have_attribute("data-ready", "true")


def look_at_figures(office: Page) -> None:
    """They are drawn when they are opened, and each can be seen."""
    office.get_by_text("Figures", exact=True).click()
    figures = office.get_by_test_id("figures")
    expect(figures).to_contain_text("from 2 drives")
    expect(figures.locator("img")).to_have_count(6)
    for picture in figures.locator("img").all():
        picture.scroll_into_view_if_needed()
        office.wait_for_function(
            "image => image.complete && image.naturalWidth > 100", arg=picture.element_handle()
        )
    assert_accessible(office)


class Joined(Visitor):
    """Somebody in a study; keeps which scripts their page loads and what the arm tells it."""

    def __init__(self, browser: Browser, link: str, sent: list[str], **options: Any) -> None:
        self.sent = sent
        self.scripts: set[str] = set()
        super().__init__(browser, link, has_picture=False, reduced_motion="reduce", **options)

    def open_tab(self) -> Page:
        self.context.on("response", self._note)
        return super().open_tab()

    def _note(self, response: Any) -> None:
        # What the API answers is read in tests/app/routers/test_study_visit.py: of a page that is
        # left meanwhile, a browser gives nothing out.
        if response.url.endswith(".js"):
            self.scripts.add(response.url)

    def _hear(self, frame: Any) -> None:
        self.sent.append(str(frame))
        super()._hear(frame)


def watch(office: Page, study_page: str) -> None:
    """Find who drives, and look at their arm."""
    office.get_by_role("link", name="Studies").click()
    expect(office.get_by_test_id("jobs")).to_contain_text("avoid")
    expect(office.get_by_test_id("jobs")).to_contain_text("Done")
    live = office.get_by_test_id("live")
    expect(live.get_by_role("row", name="P-2")).to_contain_text("A small study")
    expect(live).to_contain_text("round")
    assert_accessible(office)
    live.get_by_role("link", name="P-2").click()
    office.get_by_test_id("look").click()
    expect(office.locator(".stage iframe")).to_be_visible()
    # The veil lifts when the picture says that it is there; it covers what is cut off.
    expect(office.locator(".stage-veil")).to_be_hidden()
    frame = office.frame_locator(".stage iframe")
    expect(frame.locator("canvas").first).to_be_visible()
    assert_accessible(office)
    office.get_by_test_id("look").click()
    expect(office.locator(".stage iframe")).to_have_count(0)
    office.goto(study_page)


def answer_everything(link: str) -> None:
    """By a program, as the person would."""
    participant = Participant(link)
    session = participant.session()
    while session["step"] == "queries":
        query = next(each for each in session["queries"] if each["answer"] is None)
        session = participant.answer(query["id"], [0.5, 0.5]).json()
    participant.wait_for_training()


def fill_in(person: Joined, choice: int) -> None:
    """Answer a questionnaire; a reload in between loses nothing."""
    items = person.page.locator(".item")
    expect(items.first).to_be_visible()
    title, count = person.page.locator("h1").inner_text(), items.count()
    person.click("send")
    expect(person.page.get_by_test_id("questions-state")).to_contain_text("still open")
    assert_accessible(person.page)
    for item in items.all():
        radios = item.locator("input[type=radio]")
        radios.nth(min(choice, 1, radios.count() - 1)).check()
    person.page.reload()
    expect(person.page.locator("input:checked")).to_have_count(count)
    person.click("send")
    expect(person.page.locator("h1")).not_to_have_text(title)


def test_a_phone_at_any_step_needs_no_scrolling_sideways(
    browser: Browser, server: RunningServer
) -> None:
    (link,) = server.participant_links(1)
    zoomed = {"width": 640, "height": 400}  # 200 % of a laptop
    visitor = Visitor(browser, link, zoomed, has_picture=False)
    for step in ("consent", "practice", "queries"):
        visitor.wait_for_step(step)
        wide = visitor.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= 640, step
        if step != "queries":
            visitor.click("begin" if step == "consent" else "ready")
    visitor.close()
