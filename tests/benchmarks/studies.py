"""How long an experimenter waits for a page of a large study, and a participant for a commit."""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright
from rich.progress import track
from sqlalchemy.orm import Session

from app.storage.database import Database, migrate
from tests.app.crowds import write_at_once
from tests.app.exported import WAYS, give
from tests.app.factories import make_study
from tests.browser.find_browser import ARGUMENTS, find
from tests.browser.visitor import LAPTOP, sign_up
from tests.running_server import running_server

PEOPLE = 1000
LOADS = 10
WRITERS, WRITES, PAUSE_S = 200, 5, 5.0

Row = tuple[str, str, str, str]


def rows() -> Iterator[Row]:
    """What, median, worst, aim."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joymap.db"
        migrate(path)
        database = Database(path)
        with database.write() as db:
            study_id, person_id = populate(db)
        database.close()
        waits = page_waits(Path(folder), study_id, person_id)
    for name, found in waits.items():
        yield (
            f"{name}, {PEOPLE} participants, until it is drawn in Chromium",
            f"{1000 * np.median(found):.0f} ms",
            f"{1000 * max(found):.0f} ms",
            "≤ 300 ms",
        )
    for pause_s, how in ((PAUSE_S, f"each every {PAUSE_S:g} s"), (0.0, "each again at once")):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "joymap.db"
            migrate(path)
            database = Database(path)
            found, wrong = write_at_once(database, WRITERS, WRITES, pause_s)
            database.close()
        assert wrong == []
        yield (
            f"{WRITERS} writers, {how}: a transaction, p99 for worst",
            f"{1000 * np.median(found):.1f} ms",
            f"{1000 * np.quantile(found, 0.99):.1f} ms",
            "≤ 50 ms",
        )


def populate(db: Session) -> tuple[str, str]:
    """A study of people who answered, learned, drove and were asked; its id, and one of theirs."""
    study = make_study(db, **WAYS)
    people = [give(db, study) for _ in track(range(PEOPLE), description="people")]
    return study.id, people[-1].id


def page_waits(folder: Path, study_id: str, person_id: str) -> dict[str, list[float]]:
    """How long until each page shows what it is for, in [s]."""
    pages = {
        "studies": ("dashboard", "#studies a"),
        "a study": (f"studies/{study_id}", "#participants tbody tr"),
        "a participant": (f"participants/{person_id}", "#drives tbody tr"),
        "account and audit trail": ("account", "#audit tr"),
    }
    with running_server(folder) as server, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find(), args=list(ARGUMENTS))
        page = browser.new_context(viewport=LAPTOP).new_page()
        sign_up(page, server)
        waits = {
            name: [_load(page, f"{server.base_url}/{address}", shown) for _ in range(LOADS + 1)]
            for name, (address, shown) in track(pages.items(), description="pages")
        }
        browser.close()
    return {name: found[1:] for name, found in waits.items()}  # the first one reads the scripts


def _load(page: Page, address: str, shown: str) -> float:
    began_s = time.monotonic()
    page.goto(address, wait_until="commit")
    page.locator(shown).first.wait_for()
    return time.monotonic() - began_s
