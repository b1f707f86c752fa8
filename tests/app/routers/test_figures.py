"""A study's figures over the API: drawn when asked for, renewed, and gone with who is in them."""

import sys
import time
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.services import enrolment
from app.storage.tables import ParticipantRow
from tests.app.exported import WAYS, drive, give
from tests.app.factories import make_study
from tests.app.routers.conftest import database_of
from tests.patience import PATIENCE_S


@pytest.fixture
def study_id(office: TestClient) -> str:
    with database_of(office).write() as db:
        study = make_study(db, **WAYS)
        for _ in range(2):
            give(db, study)
        return study.id


def drawn(office: TestClient, address: str) -> dict[str, Any]:
    """Order the figures and wait until nothing is drawn any more."""
    assert office.post(address).status_code == 202
    limit_s = time.monotonic() + PATIENCE_S
    while (found := office.get(address).json())["is_drawing"]:
        assert time.monotonic() < limit_s
        time.sleep(0.1)
    return dict(found)


def test_figures_are_drawn_renewed_and_forgotten(office: TestClient, study_id: str) -> None:
    address = f"/api/v1/studies/{study_id}/figures"
    first = office.get(address).json()
    assert (first["drawn_at"], first["pictures"], first["is_current"]) == (None, [], False)
    assert office.get(f"{address}/objective").status_code == 404
    found = drawn(office, address)
    assert found["is_current"]
    assert not found["has_failed"]
    assert found["drives"] == 4
    names = [each["name"] for each in found["pictures"]]
    assert names == ["objective", "responses", "preference", "trajectories", "stick"]
    for name in names:
        picture = office.get(f"{address}/{name}")
        assert picture.headers["content-type"] == "image/svg+xml"
        assert b"<svg" in picture.content
    # Nothing new: nothing is drawn.
    assert not office.post(address).json()["is_drawing"]
    tag = office.get(address).headers["etag"]
    assert office.get(address, headers={"If-None-Match": tag}).status_code == 304
    # Another drive: what there is goes on being shown, is not current, and is drawn anew.
    with database_of(office).write() as db:
        person = db.query(ParticipantRow).filter_by(study_id=study_id).first()
        assert person is not None
        drive(db, person, "avoid")
        person_id = person.id
    old = office.get(address).json()
    assert (old["is_current"], old["drawn_at"]) == (False, found["drawn_at"])
    assert office.get(f"{address}/objective").status_code == 200
    assert drawn(office, address)["drives"] == 5
    # Whoever leaves is in no figure any more.
    with database_of(office).write() as db:
        enrolment.leave(db, db.get_one(ParticipantRow, person_id), "withdrawn")
    left = office.get(address).json()
    assert (left["drawn_at"], left["pictures"]) == (None, [])
    assert office.get(f"{address}/objective").status_code == 404
    assert drawn(office, address)["drives"] == 2


def test_a_drawing_that_fails_says_so_and_can_be_tried_again(
    office: TestClient, study_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = f"/api/v1/studies/{study_id}/figures"
    with monkeypatch.context() as patched:
        patched.setattr(sys, "executable", "/bin/false")
        found = drawn(office, address)
    assert found["has_failed"]
    assert found["pictures"] == []
    assert drawn(office, address)["is_current"]


def test_there_are_none_of_no_study(office: TestClient) -> None:
    for answer in (
        office.get("/api/v1/studies/none/figures"),
        office.post("/api/v1/studies/none/figures"),
        office.get("/api/v1/studies/none/figures/objective"),
    ):
        assert answer.status_code == 404
        assert answer.json()["error"]["sentence"]
