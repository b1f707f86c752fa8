"""The plan guards itself: imports, names, settings and docs."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from app.settings import Settings

ROOT = Path(__file__).resolve().parents[1]
SOURCES = sorted(path for folder in ("app", "models") for path in (ROOT / folder).rglob("*.py"))


def test_imports_only_go_down() -> None:
    result = subprocess.run(
        [str(Path(sys.executable).parent / "lint-imports")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_is_called_just_model(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        name = getattr(node, "id", None) or getattr(node, "arg", None) or getattr(node, "name", "")
        assert name not in ("model", "Model"), f"{path.name}:{node.lineno}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_two_things(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 400


def test_every_setting_is_explained_in_the_docs() -> None:
    text = (ROOT / "docs" / "settings.md").read_text()
    for name, field in Settings.model_fields.items():
        assert f"`JOYMAP_{name.upper()}`" in text
        assert field.description
        assert field.description in text, name


def test_the_docs_name_files_that_exist() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    place = r"(?:app|models|static|tests|migrations|docs)/[\w./-]+\w"
    for page in pages:
        for path in re.findall(place, page.read_text()):
            exists = (ROOT / path).exists() or list(ROOT.glob(f"{path}*"))
            assert exists, f"{page.name} names {path}"


def test_the_readmes_commands_are_the_makefiles() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for command in re.findall(
        r"(?:^|`)make ([a-z]+)", (ROOT / "README.md").read_text(), re.MULTILINE
    ):
        assert re.search(rf"^{command}:", makefile, re.MULTILINE), command


@pytest.mark.parametrize("name", ["app", "models"])
def test_every_public_name_exists(name: str) -> None:
    package = importlib.import_module(name)
    for public in getattr(package, "__all__", []):
        assert hasattr(package, public)
