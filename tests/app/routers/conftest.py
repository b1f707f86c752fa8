"""A service in this process, and an owner of it who is logged in."""

from collections.abc import Generator

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import accounts
from app.settings import Settings
from app.storage.database import Database, migrate
from models.panda_pack import default_folder


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        with database_of(client).write() as db:
            login = accounts.sign_up(db, accounts.new_setup_link(db), "somebody", "not a hash")
        client.cookies.set("joymap_login", login)
        yield client


def database_of(client: TestClient) -> Database:
    return client.app.state.service.database  # type: ignore[attr-defined,no-any-return]
