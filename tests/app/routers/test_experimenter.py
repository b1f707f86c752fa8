import uuid
from collections.abc import Generator

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import accounts
from app.settings import Settings
from app.storage.database import migrate
from models.panda_pack import default_folder


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


@pytest.fixture
def setup_token(client: TestClient) -> str:
    client.cookies.clear()
    with client.app.state.service.database.write() as db:
        return accounts.new_setup_link(db)


def test_the_setup_link_logs_in_once(client: TestClient, setup_token: str) -> None:
    assert client.get(f"/setup/{setup_token}").status_code == 200
    assert client.get(f"/setup/{setup_token}").status_code == 200  # looking uses nothing up
    response = client.post(f"/setup/{setup_token}", follow_redirects=False)
    assert response.status_code == 303
    assert response.headers["location"] == "/dashboard"
    cookie = response.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    assert client.get("/dashboard").status_code == 200
    client.cookies.clear()
    assert client.post(f"/setup/{setup_token}").status_code == 404
    assert client.get("/dashboard").status_code == 401


def test_a_new_start_makes_the_earlier_setup_link_worthless(
    client: TestClient, setup_token: str
) -> None:
    with client.app.state.service.database.write() as db:
        accounts.new_setup_link(db)
    assert client.post(f"/setup/{setup_token}").status_code == 404


@pytest.mark.parametrize("path", ["/dashboard", "/api/participants"])
def test_experimenters_pages_are_closed_to_others(client: TestClient, path: str) -> None:
    client.cookies.clear()
    for cookies in ({}, {"joymap_login": accounts.new_token()}):
        client.cookies.clear()
        client.cookies.update(cookies)
        response = client.get(path)
        assert response.status_code == 401
        assert "experimenter link" in response.json()["error"]["sentence"]
    client.cookies.clear()


def test_a_new_participants_link_works_and_shows_in_the_list(
    client: TestClient, setup_token: str
) -> None:
    client.post(f"/setup/{setup_token}")
    participant_id = str(uuid.uuid4())
    made = client.post("/api/participants", json={"id": participant_id})
    assert made.status_code == 201
    token = made.json()["link"].rsplit("/", 1)[1]
    assert client.get(f"/p/{token}/api/session").json()["step"] == "consent"
    lines = client.get("/api/participants").json()["participants"]
    (line,) = [line for line in lines if line["id"] == participant_id]
    assert line["label"] == made.json()["label"]
    assert line["step"] == "consent"
    assert client.post("/api/participants", json={"id": participant_id}).status_code == 409


def test_an_unopened_startup_link_is_replaced_not_piled_up(client: TestClient) -> None:
    database = client.app.state.service.database
    with database.write() as db:
        first = accounts.startup_link(db, "plane")
    with database.write() as db:
        second = accounts.startup_link(db, "plane")
    assert client.get(f"/p/{first}/api/session").status_code == 404
    assert client.get(f"/p/{second}/api/session").status_code == 200
    with database.write() as db:
        accounts.startup_link(db, "plane")
    assert client.get(f"/p/{second}/api/session").status_code == 200
