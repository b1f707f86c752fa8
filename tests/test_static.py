"""The front end's own unit tests, run by the node that comes with Playwright."""

import subprocess
from pathlib import Path

import playwright

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
