"""The API as it describes itself, asked at random by schemathesis: nothing makes it stumble."""

import uuid
from collections.abc import Generator
from typing import Any

import pytest
import schemathesis
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis.core.result import Ok

from app.main import create_app
from app.services import accounts, enrolment, protocols
from app.settings import Settings
from app.storage.database import migrate
from app.storage.tables import StudyRow
from models.panda_pack import default_folder

HASH = accounts.hashed("correct horse")


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    chosen = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(chosen.database_path)
    with TestClient(create_app(chosen), raise_server_exceptions=False) as client:
        yield client


def log_in(client: TestClient) -> None:
    service = client.app.state.service  # type: ignore[attr-defined]
    with service.database.write() as db:
        link = accounts.new_setup_link(db)
        login = accounts.sign_up(db, link, uuid.uuid4().hex, HASH)
    client.cookies.clear()
    client.cookies.set("joymap_login", login)


def test_programs_get_the_description_once_they_are_let_in(client: TestClient) -> None:
    client.cookies.clear()
    assert client.get("/api/v1/openapi.json").status_code == 401
    log_in(client)
    described = client.get("/api/v1/openapi.json").json()
    assert "/api/v1/studies" in described["paths"]
    ids = [
        operation["operationId"]
        for path in described["paths"].values()
        for operation in path.values()
    ]
    assert len(ids) == len(set(ids))


class Asking:
    """Asks each operation some times, and keeps what was answered."""

    def __init__(self, client: TestClient, real: dict[str, str], examples: int) -> None:
        self.client, self.real, self.examples = client, real, examples
        self.codes: dict[str, set[int]] = {}
        self.stumbled: list[tuple[str, int, Any]] = []

    def about(self, operation: Any) -> None:
        name = f"{operation.method.upper()} {operation.path}"

        @settings(
            max_examples=self.examples,
            derandomize=True,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy(), is_real=st.integers(0, 3).map(bool))
        def ask(case: Any, is_real: bool) -> None:
            if is_real:  # most of the time, something that is there
                case.path_parameters = {
                    key: self.real.get(key, value)
                    for key, value in (case.path_parameters or {}).items()
                }
            self._send(name, case)

        ask()

    def _send(self, name: str, case: Any) -> None:
        service = self.client.app.state.service  # type: ignore[attr-defined]
        service.doorkeeper._knocks.clear()
        sent = case.as_transport_kwargs(base_url="http://testserver")
        answer = self.client.request(
            sent["method"],
            sent["url"],
            params=sent.get("params"),
            json=sent.get("json"),
            content=sent.get("data"),
            headers=dict(sent["headers"]),
            follow_redirects=False,
        )
        self.codes.setdefault(name, set()).add(answer.status_code)
        if answer.status_code >= 500:
            self.stumbled.append((name, answer.status_code, case.body))


@pytest.mark.parametrize("examples", [4, pytest.param(50, marks=pytest.mark.soak)])
def test_nothing_that_fits_the_description_makes_the_server_stumble(
    client: TestClient, examples: int
) -> None:
    service = client.app.state.service  # type: ignore[attr-defined]
    link, person = enrolment.new_token(), str(uuid.uuid4())
    with service.database.write() as db:
        demo = db.get_one(StudyRow, protocols.DEMO)
        enrolment.enrol(db, demo, link, participant_id=person, origin="experimenter")
    real = {"token": link, "participant_id": person, "study_id": protocols.DEMO, "view": "v"}
    asking = Asking(client, real, examples)
    schema = schemathesis.openapi.from_dict(client.app.openapi())  # type: ignore[attr-defined]
    for found in schema.get_all_operations():
        log_in(client)  # who was there may have been logged out
        assert isinstance(found, Ok)
        asking.about(found.ok())
    assert not asking.stumbled, sorted({stumbled[:2] for stumbled in asking.stumbled})
    assert len(asking.codes) > 50
    assert sum(bool(codes & {200, 201, 204}) for codes in asking.codes.values()) > 25
