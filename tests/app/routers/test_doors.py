"""The doors in between: how often one may ask, from where, and with what."""

import uuid
from collections.abc import Generator

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import accounts, doorkeeping, enrolment, protocols
from app.settings import Settings
from app.storage.database import migrate
from app.storage.tables import StudyRow
from models.panda_pack import default_folder

PASSWORD = "correct horse"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


@pytest.fixture(autouse=True)
def owner(client: TestClient) -> str:
    """An owner who is logged in; their name."""
    service = client.app.state.service  # type: ignore[attr-defined]
    service.doorkeeper._knocks.clear()
    client.cookies.clear()
    with service.database.write() as db:
        token = accounts.new_setup_link(db)
    name = f"owner-{uuid.uuid4().hex[:8]}"
    made = client.post(f"/setup/{token}", json={"name": name, "password": PASSWORD})
    assert made.status_code == 204
    return name


def test_an_address_tries_so_many_names_a_minute(client: TestClient) -> None:
    codes = [
        client.post("/api/v1/login", json={"name": f"n{k}", "password": "no"}).status_code
        for k in range(doorkeeping.LOG_INS + 1)
    ]
    assert codes.count(401) == doorkeeping.LOG_INS - 1  # the set-up counted
    refused = client.post("/api/v1/login", json={"name": "x", "password": "no"})
    assert refused.status_code == 429
    assert 1 <= int(refused.headers["retry-after"]) <= 60
    assert refused.json()["error"]["kind"] == "too-often"
    assert (
        client.post(f"/setup/{'x' * 43}", json={"name": "x", "password": "no"}).status_code == 429
    )


def test_wrong_links_are_limited_and_good_ones_never(client: TestClient) -> None:
    service = client.app.state.service  # type: ignore[attr-defined]
    token = enrolment.new_token()
    with service.database.write() as db:
        demo = db.get_one(StudyRow, protocols.DEMO)
        enrolment.enrol(db, demo, token, participant_id=str(uuid.uuid4()), origin="experimenter")
    wrong = [client.get(f"/p/{k:043d}/api/session").status_code for k in range(65)]
    assert wrong == [404] * doorkeeping.WRONG_LINKS + [429] * 5
    page = client.get(f"/p/{'x' * 43}", headers={"Accept": "text/html"})
    assert page.status_code == 429
    assert "Retry-After" in page.headers
    good = {client.get(f"/p/{token}/api/session").status_code for _ in range(70)}
    assert good == {200}


def test_a_login_and_a_key_ask_so_often_each(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.routers.dependencies.REQUESTS", 5)
    token_id = str(uuid.uuid4())
    made = client.post("/api/v1/tokens", json={"id": token_id, "name": "robot", "scope": "read"})
    key = {"Authorization": f"Bearer {made.json()['token']}"}
    assert [client.get("/api/v1/me").status_code for _ in range(5)] == [200] * 4 + [429]
    assert [client.get("/api/v1/me", headers=key).status_code for _ in range(6)] == [200] * 5 + [
        429
    ]


def test_a_key_says_when_it_was_used_and_may_not_do_what_is_done_in_person(
    client: TestClient,
) -> None:
    token_id = str(uuid.uuid4())
    made = client.post("/api/v1/tokens", json={"id": token_id, "name": "robot", "scope": "write"})
    key = {"Authorization": f"Bearer {made.json()['token']}"}

    def used() -> str | None:
        (found,) = (
            token
            for token in client.get("/api/v1/tokens").json()["tokens"]
            if token["id"] == token_id
        )
        moment: str | None = found["used_at"]
        return moment

    assert used() is None
    assert client.get("/api/v1/me", headers=key).status_code == 200
    assert used() is not None
    new = {"id": str(uuid.uuid4()), "name": "more", "scope": "write"}
    refused = client.post("/api/v1/tokens", json=new, headers=key)
    assert (refused.status_code, refused.json()["error"]["kind"]) == (403, "not-by-key")


def test_ones_logins_are_listed_and_ended(client: TestClient, owner: str) -> None:
    here = client.cookies["joymap_login"]
    client.cookies.clear()
    who = {"name": owner, "password": PASSWORD}
    assert client.post("/api/v1/login", json=who).status_code == 200
    there = client.cookies["joymap_login"]
    logins = client.get("/api/v1/logins").json()["logins"]
    assert [login["is_this"] for login in logins].count(True) == 1
    (other,) = (login["id"] for login in logins if not login["is_this"])
    assert client.delete(f"/api/v1/logins/{other}").status_code == 204
    assert client.delete(f"/api/v1/logins/{other}").status_code == 404
    client.cookies.clear()
    client.cookies.set("joymap_login", here)
    assert client.get("/api/v1/me").status_code == 401
    client.cookies.clear()
    client.cookies.set("joymap_login", there)
    assert client.get("/api/v1/me").status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 201),  # a program
        ({"Origin": "http://testserver"}, 201),
        ({"Sec-Fetch-Site": "same-origin"}, 201),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-site"}, 403),
    ],
)
def test_another_sites_page_changes_nothing(
    client: TestClient, headers: dict[str, str], status: int
) -> None:
    asked = client.post("/api/v1/invitations", json={"role": "viewer"}, headers=headers)
    assert asked.status_code == status


def test_a_link_from_another_site_opens_a_page(client: TestClient) -> None:
    came = client.get("/dashboard", headers={"Sec-Fetch-Site": "cross-site"})
    assert came.status_code == 200


def test_the_cookie_is_for_https_where_there_is_https(client: TestClient) -> None:
    service = client.app.state.service  # type: ignore[attr-defined]
    with service.database.write() as db:
        token = accounts.new_setup_link(db)
    who = {"name": f"owner-{uuid.uuid4().hex[:8]}", "password": PASSWORD}
    made = client.post(f"https://testserver/setup/{token}", json=who)
    assert "Secure" in made.headers["set-cookie"]
    assert "HttpOnly" in made.headers["set-cookie"]
