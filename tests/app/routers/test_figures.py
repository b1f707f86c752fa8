"""A study's figures over the API: drawn when asked for, renewed, and gone with who is in them."""

import sys
import time
from collections.abc import Generator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import accounts, enrolment
from app.settings import Settings
from app.storage.database import Database, migrate
from app.storage.tables import ParticipantRow
from models.panda_pack import default_folder
from tests.app.exported import WAYS, give
from tests.app.factories import make_study


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        with database_of(client).write() as db:
            login = accounts.sign_up(db, accounts.new_setup_link(db), "somebody", "not a hash")
        client.cookies.set("joymap_login", login)
        yield client


@pytest.fixture
def study_id(client: TestClient) -> str:
    with database_of(client).write() as db:
        study = make_study(db, **WAYS)
        for _ in range(2):
            give(db, study)
        return study.id


def database_of(client: TestClient) -> Database:
    return client.app.state.service.database  # type: ignore[attr-defined,no-any-return]


def drawn(client: TestClient, address: str) -> dict[str, Any]:
    """Order the figures and wait until nothing is drawn any more."""
    assert client.post(address).status_code == 202
    limit_s = time.monotonic() + 90.0
    while (found := client.get(address).json())["is_drawing"]:
        assert time.monotonic() < limit_s
        time.sleep(0.1)
    return found


def test_figures_are_drawn_renewed_and_forgotten(client: TestClient, study_id: str) -> None:
    address = f"/api/v1/studies/{study_id}/figures"
    first = client.get(address).json()
    assert (first["drawn_at"], first["pictures"], first["is_current"]) == (None, [], False)
    assert client.get(f"{address}/objective").status_code == 404
    found = drawn(client, address)
    assert found["is_current"]
    assert not found["has_failed"]
    assert found["drives"] == 4
    names = [each["name"] for each in found["pictures"]]
    assert names == ["objective", "responses", "preference", "trajectories", "stick"]
    for name in names:
        picture = client.get(f"{address}/{name}")
        assert picture.headers["content-type"] == "image/svg+xml"
        assert b"<svg" in picture.content
    # Nothing new: nothing is drawn.
    assert not client.post(address).json()["is_drawing"]
    tag = client.get(address).headers["etag"]
    assert client.get(address, headers={"If-None-Match": tag}).status_code == 304
    # Somebody more: what there is goes on being shown, and is not current.
    with database_of(client).write() as db:
        person = db.query(ParticipantRow).filter_by(study_id=study_id).first()
        assert person is not None
        person.place += 1
        person_id = person.id
    assert client.get(address).json()["is_current"]
    # Whoever leaves is in no figure any more.
    with database_of(client).write() as db:
        enrolment.leave(db, db.get_one(ParticipantRow, person_id), "withdrawn")
    left = client.get(address).json()
    assert (left["drawn_at"], left["pictures"]) == (None, [])
    assert client.get(f"{address}/objective").status_code == 404
    assert drawn(client, address)["drives"] == 2


def test_a_drawing_that_fails_says_so_and_can_be_tried_again(
    client: TestClient, study_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = f"/api/v1/studies/{study_id}/figures"
    with monkeypatch.context() as patched:
        patched.setattr(sys, "executable", "/bin/false")
        found = drawn(client, address)
    assert found["has_failed"]
    assert found["pictures"] == []
    assert drawn(client, address)["is_current"]


def test_there_are_none_of_no_study(client: TestClient) -> None:
    for answer in (
        client.get("/api/v1/studies/none/figures"),
        client.post("/api/v1/studies/none/figures"),
        client.get("/api/v1/studies/none/figures/objective"),
    ):
        assert answer.status_code == 404
        assert answer.json()["error"]["sentence"]
