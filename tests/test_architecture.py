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
        assert name not in ("model", "Model"), f"{path.name}: {ast.dump(node)[:80]}"


FOR_PEOPLE = {"title", "says", "field_says", "sentence", "look_from", "look_at", "camera"}


@pytest.mark.parametrize(
    "path", sorted((ROOT / "models").rglob("*.py")), ids=lambda path: str(path.relative_to(ROOT))
)
def test_the_learning_core_has_no_words_for_people_and_no_cameras(path: Path) -> None:
    nodes = list(ast.walk(ast.parse(path.read_text())))
    for node in nodes:
        names = {getattr(node, kind, None) for kind in ("id", "arg", "attr", "name")}
        assert not names & FOR_PEOPLE, f"{path.name}: {ast.dump(node)[:80]} belongs to app/texts.py"
    if path.parent.name == "tasks":
        # Errors are for those who program; any other string is a name.
        docstrings = [node.value for node in nodes if isinstance(node, ast.Expr)]
        raised = [node for node in nodes if isinstance(node, ast.Raise)]
        kept = {id(inner) for node in raised for inner in ast.walk(node)}
        kept |= {id(node) for node in docstrings}
        for node in nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                is_name = node.value == node.value.lower() and "." not in node.value
                assert id(node) in kept or is_name, f"{path.name}:{node.lineno}: {node.value}"


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
