"""A real Chromium, and one server for all tests that leave it running."""

from collections.abc import Generator

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

from tests.browser.find_browser import ARGUMENTS, find
from tests.patience import PATIENCE_S
from tests.running_server import RunningServer, running_server


@pytest.fixture(scope="session")
def browser() -> Generator[Browser]:
    path = find()
    assert path is not None, "no Chromium; 'python -m tests.browser.find_browser' gets one"
    expect.set_options(timeout=1000 * PATIENCE_S)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Generator[RunningServer]:
    """For tests with participants or a study of their own; how well is learned is not theirs."""
    with running_server(tmp_path_factory.mktemp("browser"), training_steps=20) as server:
        yield server
