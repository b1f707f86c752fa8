"""A real Chromium."""

from collections.abc import Generator

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.browser.find_browser import ARGUMENTS, find


@pytest.fixture(scope="session")
def browser() -> Generator[Browser]:
    path = find()
    assert path is not None, "no Chromium; 'python -m tests.browser.find_browser' gets one"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield browser
        browser.close()
