"""A study's shared link: an external id gets a place, and only its browser gets it again."""

import threading
import uuid
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.routers.join import BROWSER_COOKIE
from app.services import enrolment
from app.settings import Settings
from app.storage.tables import ParticipantRow, StudyRow
from tests.app.factories import enrol, make_study
from tests.app.routers.conftest import database_of

PID = "5f3c"


class Browser:
    """Somebody's browser, in which cookies stay."""

    def __init__(self, office: TestClient, **address: Any) -> None:
        self.http = TestClient(office.app, **address)

    def join(self, link: str, external_id: str | None = PID, **body: Any) -> Any:
        """Open a shared link and press the button."""
        assert self.http.get(f"/join/{link}").status_code == 200
        return self.press(link, external_id, **body)

    def press(self, link: str, external_id: str | None = PID, **body: Any) -> Any:
        return self.http.post(f"/join/{link}", json={"external_id": external_id} | body)

    def step(self, own: str) -> str | None:
        """The step that a participant's own link leads to, if it is one."""
        found = self.http.get(f"/p/{own}/api/session")
        return found.json()["step"] if found.status_code == 200 else None


def own_link(joined: Any) -> str:
    assert joined.status_code == 201, joined.text
    link: str = joined.json()["link"]
    return link.rsplit("/", 1)[1]


def shared_link(office: TestClient, **changes: Any) -> tuple[str, str]:
    """A study's shared link and its id."""
    link = enrolment.new_token()
    with database_of(office).write() as db:
        study = make_study(db, **changes)
        study.link_hash = enrolment.hash_of(link)
        return link, study.id


def person_of(office: TestClient, study_id: str) -> dict[str, Any]:
    """The study's one participant, column by column."""
    with database_of(office).read() as db:
        row = db.query(ParticipantRow).filter_by(study_id=study_id).one()
        return {column.name: getattr(row, column.name) for column in row.__table__.columns}


@pytest.mark.parametrize("state", ["active", "abandoned", "completed", "withdrawn"])
def test_who_only_names_a_taken_id_changes_nothing(office: TestClient, state: str) -> None:
    link, study_id = shared_link(office)
    own_link(Browser(office).join(link))
    with database_of(office).write() as db:
        db.query(ParticipantRow).filter_by(study_id=study_id).one().state = state
    before = person_of(office, study_id)
    stranger = Browser(office)
    for refused in (stranger.join(link), stranger.join(link)):
        assert refused.status_code == 409
        assert refused.json()["error"]["kind"] == "id-taken"
        assert "ask the experimenter" in refused.json()["error"]["sentence"]
    assert person_of(office, study_id) == before


def test_who_takes_part_goes_on_and_is_not_erased_by_a_stranger(office: TestClient) -> None:
    link, study_id = shared_link(office)
    victim = Browser(office)
    own = own_link(victim.join(link))
    version = victim.http.get(f"/p/{own}/api/session").json()["consent"]["version"]
    agreed = {"id": str(uuid.uuid4()), "version": version}
    assert victim.http.post(f"/p/{own}/api/consent", json=agreed).status_code == 200
    stranger = Browser(office)
    got = stranger.join(link).json()
    assert "link" not in got
    guessed = own_link(stranger.join(link, "another-id"))
    leave = {"id": str(uuid.uuid4()), "erase": True}
    assert stranger.http.post(f"/p/{guessed}/api/withdraw", json=leave).status_code == 200
    assert victim.step(own) == "practice"
    with database_of(office).read() as db:
        kept = db.query(ParticipantRow).filter_by(study_id=study_id, external_id=PID).one()
        assert kept.state == "active"


def test_the_browser_that_joined_gets_its_place_again(office: TestClient) -> None:
    link, study_id = shared_link(office)
    browser = Browser(office)
    first = own_link(browser.join(link))
    with database_of(office).write() as db:
        row = db.query(ParticipantRow).filter_by(study_id=study_id).one()
        row.place, row.state = 1, "abandoned"
    second = own_link(browser.join(link))
    assert (browser.step(first), browser.step(second)) == (None, "practice")
    assert person_of(office, study_id)["state"] == "active"


def test_who_never_heard_that_they_joined_presses_again(office: TestClient) -> None:
    """The first answer is lost on its way: no cookie of it, no link of it."""
    link, study_id = shared_link(office)
    browser = Browser(office)
    browser.http.get(f"/join/{link}")
    before = dict(browser.http.cookies)
    browser.press(link)
    browser.http.cookies.clear()
    browser.http.cookies.update(before)
    assert browser.step(own_link(browser.press(link))) == "consent"
    assert person_of(office, study_id)["external_id"] == PID


def test_a_program_that_never_looked_at_the_page_is_remembered_too(office: TestClient) -> None:
    link, _ = shared_link(office)
    program = Browser(office)
    own_link(program.press(link))
    assert program.step(own_link(program.press(link))) == "consent"
    assert Browser(office).press(link).status_code == 409


def test_one_browser_takes_part_in_two_studies_and_as_two_people(office: TestClient) -> None:
    (one, _), (other, _) = shared_link(office), shared_link(office)
    browser = Browser(office)
    joined = [(link, name) for link in (one, other) for name in (PID, "77aa")]
    for link, name in joined:
        own_link(browser.join(link, name))
    for link, name in joined:
        assert browser.step(own_link(browser.join(link, name))) == "consent"
    cookies = {each.value for each in browser.http.cookies.jar if each.name == BROWSER_COOKIE}
    assert len(cookies) == 2
    with database_of(office).read() as db:
        kept = [row.browser_hash for row in db.query(ParticipantRow).filter_by(external_id="77aa")]
    assert set(map(enrolment.hash_of, cookies)) == set(kept)


def test_the_cookie_is_for_the_shared_link_and_not_for_scripts(office: TestClient) -> None:
    link, _ = shared_link(office)
    for base, is_secure in (("http://testserver", False), ("https://testserver", True)):
        browser = Browser(office, base_url=base)
        given = browser.http.get(f"/join/{link}").headers["set-cookie"]
        parts = {part.strip().lower() for part in given.split(";")[1:]}
        assert {"httponly", "samesite=lax", f"path=/join/{link}".lower()} <= parts
        assert ("secure" in parts) == is_secure
        value = given.split(";")[0].partition("=")[2]
        assert len(value) >= 43  # 256 bits
        kept = browser.join(link, f"over-{base.split(':')[0]}").headers["set-cookie"]
        assert kept.split(";")[0] == given.split(";")[0]


def test_behind_a_prefix_the_cookie_has_the_path_that_browsers_see(
    office: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    link, _ = shared_link(office)
    monkeypatch.setattr(Settings, "base_url", "https://lab.example/joymap")
    given = Browser(office).http.get(f"/join/{link}").headers["set-cookie"]
    assert f"Path=/joymap/join/{link};" in given


@pytest.mark.parametrize("change", ["link", "revoke"])
def test_who_came_with_anothers_id_loses_the_place_for_good_to_the_experimenter(
    office: TestClient, change: str
) -> None:
    link, study_id = shared_link(office)
    first_come = Browser(office)
    taken = own_link(first_come.join(link))
    participant_id = person_of(office, study_id)["id"]
    changed = office.post(f"/api/v1/participants/{participant_id}/{change}")
    assert changed.is_success
    assert first_come.step(taken) is None
    assert first_come.join(link).status_code == 409
    if change == "link":
        renewed = changed.json()["link"].rsplit("/", 1)[1]
        assert Browser(office).step(renewed) == "consent"


def test_who_was_enrolled_before_browsers_were_known_keeps_their_place(office: TestClient) -> None:
    link, study_id = shared_link(office)
    with database_of(office).write() as db:
        enrol(db, db.get_one(StudyRow, study_id), external_id=PID)
    assert person_of(office, study_id)["browser_hash"] is None
    before = person_of(office, study_id)
    browser = Browser(office)
    assert browser.join(link).status_code == 409
    assert browser.press(link).status_code == 409
    assert person_of(office, study_id) == before


def test_who_was_erased_is_known_no_more_and_may_join_anew(office: TestClient) -> None:
    link, study_id = shared_link(office)
    browser = Browser(office)
    own = own_link(browser.join(link))
    leave = {"id": str(uuid.uuid4()), "erase": True}
    assert browser.http.post(f"/p/{own}/api/withdraw", json=leave).status_code == 200
    kept = person_of(office, study_id)
    assert (kept["external_id"], kept["browser_hash"]) == (None, None)
    assert browser.step(own_link(Browser(office).join(link))) == "consent"


def test_of_two_who_come_at_once_with_one_id_one_gets_in(office: TestClient) -> None:
    link, study_id = shared_link(office)
    browsers = [Browser(office) for _ in range(8)]
    answers: list[Any] = []
    threads = [
        threading.Thread(target=lambda one=browser: answers.append(one.join(link)))
        for browser in browsers
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(answer.status_code for answer in answers) == [201] + [409] * 7
    entered = next(answer for answer in answers if answer.status_code == 201)
    assert browsers[0].step(own_link(entered)) == "consent"
    assert person_of(office, study_id)["external_id"] == PID


def test_who_brings_no_id_is_somebody_new_each_time(office: TestClient) -> None:
    link, _ = shared_link(office)
    browser = Browser(office)
    links = {own_link(browser.join(link, None)) for _ in range(2)}
    assert {browser.step(own) for own in links} == {"consent"}


@pytest.mark.parametrize("external_id", [None, PID])
def test_a_press_whose_answer_was_lost_is_sent_again_and_enrols_once(
    office: TestClient, external_id: str | None
) -> None:
    link, study_id = shared_link(office)
    browser, press = Browser(office), str(uuid.uuid4())
    lost, heard = (browser.join(link, external_id, id=press) for _ in range(2))
    assert browser.step(own_link(lost)) is None
    assert browser.step(own_link(heard)) == "consent"
    assert person_of(office, study_id)["id"] == press


def test_anothers_press_gives_away_no_place(office: TestClient) -> None:
    link, study_id = shared_link(office)
    browser, press = Browser(office), str(uuid.uuid4())
    own = own_link(browser.join(link, None, id=press))
    before = person_of(office, study_id)
    stranger = Browser(office)
    assert stranger.join(link, None, id=press).status_code == 409
    assert person_of(office, study_id) == before
    assert browser.step(own) == "consent"
    elsewhere, _ = shared_link(office)
    assert browser.join(elsewhere, None, id=press).status_code == 409


NOBODY = [
    "{{%PROLIFIC_PID%}}",
    "%SURVEY_CODE%",
    "undefined",
    "ASSIGNMENT_ID_NOT_AVAILABLE",
    " ",
    "",
]


@pytest.mark.parametrize("given", NOBODY)
def test_what_names_nobody_is_nobodys_place(office: TestClient, given: str) -> None:
    link, study_id = shared_link(office)
    for _ in range(2):
        own_link(Browser(office).join(link, given))
    with database_of(office).read() as db:
        people = db.query(ParticipantRow).filter_by(study_id=study_id).all()
        assert [person.external_id for person in people] == [None, None]


@pytest.mark.parametrize("given", [*NOBODY, None])
def test_where_an_id_is_required_who_has_none_reads_what_to_do(
    office: TestClient, given: str | None
) -> None:
    link, study_id = shared_link(office, external_ids="required")
    refused = Browser(office).join(link, given)
    assert refused.status_code == 422
    sentence = refused.json()["error"]["sentence"]
    assert "does not say who you are" in sentence
    assert "go back to where you found it" in sentence
    with database_of(office).read() as db:
        assert db.query(ParticipantRow).filter_by(study_id=study_id).count() == 0
    own_link(Browser(office).join(link, "Anna B."))
    assert person_of(office, study_id)["external_id"] == "Anna B."


def test_where_no_ids_are_wanted_none_is_kept(office: TestClient) -> None:
    link, study_id = shared_link(office, external_ids="none")
    own_link(Browser(office).join(link))
    assert person_of(office, study_id)["external_id"] is None


def test_an_id_is_one_however_it_is_composed_and_spaced(office: TestClient) -> None:
    link, study_id = shared_link(office)
    browser = Browser(office)
    for given in ("Zo\u00eb K", "Zoe\u0308 K", "  Zo\u00eb K "):
        own_link(browser.join(link, given))
    assert person_of(office, study_id)["external_id"] == "Zo\u00eb K"
    assert Browser(office).join(link, "zo\u00eb K").status_code == 201  # another person


def test_a_full_study_says_so_before_the_press(office: TestClient) -> None:
    link, _ = shared_link(office, participants=2)
    for _ in range(2):
        assert Browser(office).http.get(f"/join/{link}/study").json()["is_open"]
        own_link(Browser(office).join(link, None))
    assert not Browser(office).http.get(f"/join/{link}/study").json()["is_open"]
