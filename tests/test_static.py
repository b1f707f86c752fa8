"""The front end's own unit tests, run by the node that comes with Playwright."""

import re
import subprocess
from pathlib import Path

import playwright
import pytest

from app import texts
from app.services import drives
from models.strategies import STRATEGIES
from models.tasks import TASKS

ROOT = Path(__file__).resolve().parents[1]
NODE = Path(playwright.__file__).parent / "driver" / "node"


def test_the_front_ends_units() -> None:
    files = sorted((ROOT / "tests" / "static").glob("*.test.mjs"))
    assert files
    result = subprocess.run(
        [NODE, "--test", *files], capture_output=True, text=True, check=False, timeout=120
    )
    assert result.returncode == 0, result.stdout
    assert "# fail 0" in result.stdout or "ℹ fail 0" in result.stdout


def test_every_script_is_well_formed_and_short() -> None:
    for path in (ROOT / "static").rglob("*.js"):
        result = subprocess.run(
            [NODE, "--check", "--input-type=module"],
            input=path.read_text(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, f"{path.name}: {result.stderr}"
        assert len(path.read_text().splitlines()) <= 250, path.name


# Names that are words of the language or of JavaScript, too: these may stand in a page, but not as
# a string of their own.
WORDS = {"random", "fixed", "consistency"}


@pytest.mark.parametrize("name", [*TASKS, *STRATEGIES, *texts.ORDERS])
def test_no_page_names_what_the_server_offers(name: str) -> None:
    alone = rf"(?<![\w-]){re.escape(name)}(?![\w-])"
    quoted = rf"['\"`]{re.escape(name)}['\"`]"
    for path in (ROOT / "static").rglob("*"):
        if path.suffix in (".js", ".html"):
            found = re.search(quoted if name in WORDS else alone, path.read_text())
            assert found is None, f"{path.name}: {name}"


TITLES = [
    *(each.title for each in texts.TASKS.values() if " " in each.title),
    *texts.STRATEGIES.values(),
    *(choice.title for choice in drives.STRATEGIES),
    *texts.ORDERS.values(),
]


@pytest.mark.parametrize("title", TITLES)
def test_no_page_has_the_title_of_what_the_server_offers(title: str) -> None:
    for path in (ROOT / "static").rglob("*.js"):
        assert title not in path.read_text(), path.name
