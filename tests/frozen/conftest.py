"""What today's code makes of the old things, once for all tests."""

from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from tests.frozen import today
from tests.frozen.exported import Export
from tests.frozen.made import EXPORT
from tests.frozen.today import TodaysServer
from tests.running_server import Participant


@pytest.fixture(scope="session")
def old_answers() -> dict[str, Any]:
    return today.old_answers()


@pytest.fixture(scope="session")
def data_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The old server's folder, with its database brought up to date."""
    folder = today.unpack_data(tmp_path_factory.mktemp("old"))
    assert today.migrate(folder).code == 0
    return folder


@pytest.fixture(scope="session")
def old_export() -> Export:
    return Export(EXPORT)


@pytest.fixture(scope="session")
def new_export(
    data_dir: Path, old_answers: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> Export:
    """Of the old database, before anything is added to it."""
    out = tmp_path_factory.mktemp("export") / "export.zip"
    command = today.export(data_dir, old_answers["study"], out)
    assert command.code == 0, command.err
    return Export(out)


@pytest.fixture(scope="session")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Those of the old export."""
    out = tmp_path_factory.mktemp("figures")
    command = today.draw_figures(out)
    assert command.code == 0, command.err
    return out


@pytest.fixture(scope="session")
def simulation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The old run, gone on with; what the command said is in a file ``said`` beside it."""
    folder = tmp_path_factory.mktemp("simulation") / "run"
    command = today.go_on_simulating(folder)
    assert command.code == 0, command.err
    folder.with_name("said").write_text(command.err)
    return folder


@pytest.fixture(scope="session")
def server(data_dir: Path, new_export: Export) -> Generator[TodaysServer]:
    """A server on the old data."""
    assert new_export.files  # the export is of the data before anything is added to them
    with today.todays_server(data_dir) as server:
        yield server


@pytest.fixture(scope="session")
def new_answers(server: TodaysServer, old_answers: dict[str, Any]) -> dict[str, Any]:
    """What the dashboard is told, by address, before anybody comes back."""
    return {address: server.get(address) for address in old_answers["api"]}


@pytest.fixture(scope="session")
def visits(
    server: TodaysServer, old_answers: dict[str, Any], new_answers: dict[str, Any]
) -> dict[str, Participant]:
    """Everybody's page, by a new link."""
    assert new_answers  # who comes back is not silent any more
    return {each: server.visit(each) for each in old_answers["sessions"]}


@pytest.fixture(scope="session")
def new_sessions(visits: dict[str, Participant]) -> dict[str, Any]:
    """What everybody's page is told, before anybody goes on."""
    return {each: page.session() for each, page in visits.items()}


@pytest.fixture(scope="session")
def told(
    server: TodaysServer,
    visits: dict[str, Participant],
    new_sessions: dict[str, Any],
    old_answers: dict[str, Any],
) -> list[dict[str, Any]]:
    """What the page of who stopped before a drive is told while they make it."""
    assert new_sessions  # which say that they have not made it yet
    return server.drive(visits[today.half_way(old_answers)])
