"""A participant's page as a program sees it: the right order works, everything else is refused."""

import json
import time
import uuid
from collections.abc import Generator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import consent, enrolment, protocols
from app.settings import Settings
from app.storage.database import migrate
from app.storage.tables import AnswerRow, DriveRow, EventRow, JobRow, ParticipantRow
from models.panda_pack import default_folder
from tests.patience import PATIENCE_S

VERSION = consent.version_of(protocols.demo_protocol(Settings()))


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder(), training_steps=60
    )
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


class Page:
    """A participant's page, without a browser."""

    def __init__(self, client: TestClient) -> None:
        self.client = client
        self.id, self.token = str(uuid.uuid4()), enrolment.new_token()
        service = client.app.state.service  # type: ignore[attr-defined]
        with service.database.write() as db:
            demo = protocols.demo(db, service.settings)
            enrolment.enrol(db, demo, self.token, participant_id=self.id, origin="experimenter")

    def get(self, path: str) -> Any:
        return self.client.get(f"/p/{self.token}/api/{path}")

    def post(self, path: str, **body: Any) -> Any:
        return self.client.post(
            f"/p/{self.token}/api/{path}",
            content=json.dumps({"id": str(uuid.uuid4())} | body),
            headers={"Content-Type": "application/json"},
        )

    def set_stick(self, **body: Any) -> Any:
        wanted = {"invert_x": False, "invert_y": False, "gain": 1, "one_axis": False}
        return self.client.put(
            f"/p/{self.token}/api/stick",
            content=json.dumps({"id": str(uuid.uuid4()), "steady": False} | wanted | body),
            headers={"Content-Type": "application/json"},
        )

    def begin(self) -> list[str]:
        self.post("consent", version=self.get("session").json()["consent"]["version"])
        return [query["id"] for query in self.post("practice").json()["queries"]]

    def answer(self, query_id: str, h: Any = (0.5, 0.5), **body: Any) -> Any:
        return self.post("answers", query_id=query_id, h=h, thinking_time_s=2.0, **body)

    def go_to(self, step: str) -> None:
        self.post("consent", version=VERSION)
        if step == "practice":
            return
        queries = [query["id"] for query in self.post("practice").json()["queries"]]
        if step == "queries":
            return
        for query_id in queries:
            self.answer(query_id)
        deadline_s = time.monotonic() + PATIENCE_S
        while step == "driving" and self.post("driving").status_code != 200:
            assert time.monotonic() < deadline_s
            time.sleep(0.05)

    def rows(self, table: Any) -> list[Any]:
        with self.client.app.state.service.database.read() as db:  # type: ignore[attr-defined]
            statement = db.query(table).filter(table.participant_id == self.id)
            rows = list(statement)
            db.expunge_all()
            return rows


@pytest.fixture
def page(client: TestClient) -> Page:
    return Page(client)


def sentence(response: Any) -> str:
    """The one sentence of a refusal."""
    found: str = response.json()["error"]["sentence"]
    assert found.endswith(".") or found.endswith("?")
    assert "\n" not in found
    return found


def test_the_steps_lead_from_consent_to_driving(page: Page) -> None:
    assert page.get("session").json()["step"] == "consent"
    assert page.post("consent", version=VERSION).json()["step"] == "practice"
    session = page.post("practice").json()
    assert session["step"] == "queries"
    assert len(session["queries"]) == 7
    for query in session["queries"]:
        response = page.answer(query["id"])
        assert response.status_code == 201
    assert response.json()["step"] == "training"
    assert len(page.rows(JobRow)) == 1


def test_the_same_answer_sent_again_is_the_same_row(page: Page) -> None:
    query_id = page.begin()[0]
    answer_id = str(uuid.uuid4())
    assert page.answer(query_id, id=answer_id).status_code == 201
    again = page.answer(query_id, id=answer_id)
    assert again.status_code == 200
    assert len(page.rows(AnswerRow)) == 1
    changed = page.answer(query_id, h=(0.1, 0.1), id=answer_id)
    assert changed.status_code == 409
    assert len(page.rows(AnswerRow)) == 1


def test_the_last_answer_sent_again_queues_one_training(page: Page) -> None:
    queries = page.begin()
    for query_id in queries[:-1]:
        page.answer(query_id)
    answer_id = str(uuid.uuid4())
    assert page.answer(queries[-1], id=answer_id).status_code == 201
    assert page.answer(queries[-1], id=answer_id).status_code == 200
    assert len(page.rows(JobRow)) == 1


def test_answers_can_be_changed_until_the_training_starts(page: Page) -> None:
    queries = page.begin()
    page.answer(queries[0], h=(1.0, 0.0))
    page.answer(queries[0], h=(0.0, -1.0))
    session = page.get("session").json()
    assert session["queries"][0]["answer"]["h"] == [0.0, -1.0]
    for query_id in queries[1:]:
        page.answer(query_id)
    late = page.answer(queries[0], h=(0.3, 0.3))
    assert late.status_code == 409
    assert "stay as they are" in sentence(late)


def test_the_same_step_sent_twice_at_once_counts_once(page: Page) -> None:
    event_id = str(uuid.uuid4())
    for _ in range(2):
        assert page.post("consent", id=event_id, version=VERSION).json()["step"] == "practice"
    assert len(page.rows(EventRow)) == 1


@pytest.mark.parametrize(
    "h",
    [
        [1.01, 0.0],
        [0.0, -1.5],
        [float("nan"), 0.0],
        [0.0, float("inf")],
        [1e999, 0.0],
        [0.5],
        [0.1, 0.2, 0.3],
        "up",
        ["0.5", None],
        {"x": 0.1, "y": 0.1},
        [True, {}],
    ],
)
def test_a_stick_that_is_no_stick_is_refused(page: Page, h: Any) -> None:
    query_id = page.begin()[0]
    response = page.answer(query_id, h=h)
    assert response.status_code == 422
    assert sentence(response) == "The stick must be two numbers between -1 and 1."
    assert page.rows(AnswerRow) == []


def test_an_answer_to_someone_elses_query_is_refused(client: TestClient, page: Page) -> None:
    other = Page(client)
    page.begin()
    theirs = other.begin()[0]
    response = page.answer(theirs)
    assert response.status_code == 404
    assert "not one of yours" in sentence(response)
    assert page.rows(AnswerRow) == []
    assert other.rows(AnswerRow) == []


def test_an_answer_to_no_query_at_all_is_refused(page: Page) -> None:
    page.begin()
    assert page.answer(str(uuid.uuid4())).status_code == 404
    assert page.answer("../../etc").status_code == 422
    assert page.rows(AnswerRow) == []


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "session"),
        ("GET", "training"),
        ("POST", "consent"),
        ("POST", "practice"),
        ("POST", "answers"),
        ("POST", "driving"),
        ("POST", "drives"),
        ("POST", "training/retry"),
        ("PUT", "stick"),
    ],
)
def test_an_unknown_link_opens_nothing(client: TestClient, method: str, path: str) -> None:
    response = client.request(method, f"/p/{enrolment.new_token()}/api/{path}", json={})
    assert response.status_code == 404
    assert "not known" in sentence(response)


def test_an_unknown_link_shows_a_page_that_says_so(client: TestClient) -> None:
    response = client.get("/p/nobody", headers={"Accept": "text/html"})
    assert response.status_code == 404
    assert response.headers["content-type"].startswith("text/html")
    assert "not known" in response.text


def test_someone_elses_link_shows_nothing_of_mine(client: TestClient, page: Page) -> None:
    queries = page.begin()
    page.answer(queries[0], h=(0.25, 0.75))
    other = Page(client)
    assert "0.75" not in other.get("session").text
    assert other.get("session").json()["step"] == "consent"


@pytest.mark.parametrize("declared", [True, False])
def test_a_body_over_one_mebibyte_is_refused(page: Page, declared: bool) -> None:
    query_id = page.begin()[0]
    body = json.dumps(
        {"id": str(uuid.uuid4()), "query_id": query_id, "h": [0, 0], "pad": "x" * (1 << 20)}
    ).encode()

    def in_parts() -> Generator[bytes]:
        for start in range(0, len(body), 1 << 16):
            yield body[start : start + (1 << 16)]

    response = page.client.post(
        f"/p/{page.token}/api/answers",
        content=body if declared else in_parts(),
        headers={"Content-Type": "application/json"},
    )
    assert response.status_code == 413
    assert "larger than 1024 KiB" in sentence(response)
    assert page.rows(AnswerRow) == []


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b'{"id": "x"}', b"\xff\xfe"])
def test_a_body_that_is_no_answer_is_refused(page: Page, body: bytes) -> None:
    page.begin()
    response = page.client.post(
        f"/p/{page.token}/api/answers", content=body, headers={"Content-Type": "application/json"}
    )
    assert response.status_code in (400, 422)
    assert sentence(response)
    assert page.rows(AnswerRow) == []


def test_a_form_from_another_site_is_refused(page: Page) -> None:
    response = page.client.post(
        f"/p/{page.token}/api/consent",
        json={"id": str(uuid.uuid4()), "version": VERSION},
        headers={"Origin": "http://evil.example"},
    )
    assert response.status_code == 403
    assert "another site" in sentence(response)
    assert page.get("session").json()["step"] == "consent"


def test_nobody_drives_before_the_training(page: Page) -> None:
    for go_on in (
        lambda: None,
        lambda: page.post("consent", version=VERSION),
        lambda: page.post("practice"),
    ):
        go_on()
        for response in (page.post("drives", strategy="all-priors"), page.post("driving")):
            assert response.status_code == 409
            assert sentence(response).startswith("It is too early for that: first")
    assert page.rows(DriveRow) == []


def test_there_is_no_drive_under_an_unknown_strategy(page: Page) -> None:
    response = page.post("drives", strategy="magic")
    assert response.status_code == 422
    assert "Choose one of: all-priors, task-space, no-priors, no-align" in sentence(response)


def test_consent_is_to_the_text_that_was_shown(page: Page) -> None:
    assert page.post("consent", version="0").status_code == 409
    assert page.get("session").json()["step"] == "consent"


def test_the_pages_may_not_be_framed_or_leak_their_address(page: Page) -> None:
    headers = page.client.get(f"/p/{page.token}").headers
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "unsafe" not in headers["Content-Security-Policy"]
    assert headers["Cache-Control"] == "no-store"


def test_only_the_hash_of_a_link_is_kept(page: Page) -> None:
    with page.client.app.state.service.database.read() as db:  # type: ignore[attr-defined]
        row = db.get_one(ParticipantRow, page.id)
        assert page.token not in str(vars(row))


NORMAL = {"invert_x": False, "invert_y": False, "gain": 1.0, "one_axis": False, "steady": False}


@pytest.mark.parametrize("erase", [True, False])
@pytest.mark.parametrize("step", ["practice", "queries", "training", "driving"])
def test_who_stops_trying_it_out_comes_to_a_last_page(page: Page, step: str, erase: bool) -> None:
    page.go_to(step)
    assert page.get("session").json()["step"] == step
    for _ in range(2):  # and when the page is loaded again
        page.post("withdraw", erase=erase)
        session = page.get("session").json()
        assert (session["state"], session["step"]) == ("withdrawn", "end")
        assert session["end"]["left"] == ("erased" if erase else "kept")
        assert session["way"][-1] == {"title": "Done", "is_here": True, "is_done": False}
        assert not session["may_withdraw"]
    assert page.post("practice").status_code == 409


def test_the_stick_stays_as_it_was_set_wherever_the_link_is_opened(page: Page) -> None:
    assert page.get("session").json()["stick"] == NORMAL
    page.begin()
    change = {"id": str(uuid.uuid4()), "invert_x": True, "gain": 2.5}
    for _ in range(2):
        response = page.set_stick(**change)
        assert response.status_code == 200
        assert response.json()["step"] == "queries"
        assert response.json()["stick"] == NORMAL | {"invert_x": True, "gain": 2.5}
    assert page.get("session").json()["stick"] == NORMAL | {"invert_x": True, "gain": 2.5}
    assert len([event for event in page.rows(EventRow) if event.kind == "stick"]) == 1
    assert Page(page.client).get("session").json()["stick"] == NORMAL


@pytest.mark.parametrize(
    "change",
    [
        {"gain": 0.99},
        {"gain": 4.01},
        {"gain": float("nan")},
        {"gain": 1e999},
        {"gain": "2"},
        {"gain": True},
        {"gain": None},
        {"invert_x": 1},
        {"steady": "yes"},
        {"one_axis": None},
        {"id": "7"},
        {"turbo": True},
    ],
)
def test_a_stick_set_to_what_it_cannot_be_stays_as_it_was(page: Page, change: Any) -> None:
    page.begin()
    assert page.set_stick(one_axis=True).status_code == 200
    response = page.set_stick(**change)
    assert response.status_code == 422
    assert sentence(response).startswith(next(iter(change)))
    assert page.get("session").json()["stick"] == NORMAL | {"one_axis": True}


def test_the_stick_is_not_set_before_the_person_agreed(page: Page) -> None:
    response = page.set_stick(steady=True)
    assert response.status_code == 409
    assert "first agree to take part" in sentence(response)
    assert page.get("session").json()["stick"] == NORMAL


def test_a_live_arm_is_steadied_at_once_and_when_it_comes_back(page: Page) -> None:
    service = page.client.app.state.service  # type: ignore[attr-defined]
    page.begin()

    def come() -> Any:
        with page.client.websocket_connect(f"/p/{page.token}/live?tab=a") as socket:
            socket.receive_json()
            return service.live.existing(page.id)

    session = come()
    assert not session._filter.is_steady
    assert page.set_stick(steady=True).status_code == 200
    assert session._filter.is_steady
    session.close("left")
    del service.live.loop.sessions[page.id]
    assert come()._filter.is_steady
    assert page.set_stick().status_code == 200
    assert not come()._filter.is_steady
