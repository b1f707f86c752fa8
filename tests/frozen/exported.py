"""What an export holds, without what every export has of its own: pseudonyms and the day."""

import csv
import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import yaml
from safetensors.numpy import load

_PSEUDONYM = re.compile(r"(?<![0-9a-f])[0-9a-f]{16}(?![0-9a-f])")
_TABLE = re.compile(r"data/study-(\w+)_description-(\w+)_data\.(csv|jsonl|parquet)")
# Where things are met first, in an order that is always the same, and so numbered.
_FIRST = ("participants", "queries", "trainings", "alignments", "drives", "notes")
FORMATS = ("csv", "jsonl", "parquet")


class Export:
    """An export whose pseudonyms are replaced by numbers, in the order in which they come."""

    def __init__(self, path: Path) -> None:
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
            self._raw = {name: archive.read(name) for name in archive.namelist()}
        self._numbers: dict[str, str] = {}
        self._tables: dict[tuple[str, str], bytes] = {}
        for name, content in self._raw.items():
            found = _TABLE.fullmatch(name)
            if found:
                self.slug = found[1]
                self._tables[found[2], found[3]] = content
        for table in _FIRST:
            self.rows(table, "jsonl")  # which numbers what it meets
        self.files = {self.named(name): content for name, content in self._raw.items()}

    @property
    def tables(self) -> list[str]:
        return sorted({table for table, _ in self._tables})

    def columns(self, table: str, kind: str) -> list[str]:
        """The columns of a table in one of the formats, in order."""
        content = self._tables[table, kind]
        match kind:
            case "csv":
                return next(csv.reader(io.StringIO(content.decode(), newline="")))
            case "jsonl":
                lines = content.splitlines()
                return list(json.loads(lines[0])) if lines else []
            case _:
                return list(pq.read_schema(io.BytesIO(content)).names)

    def rows(self, table: str, kind: str) -> list[dict[str, Any]]:
        """The rows of a table in one of the formats."""
        content = self._tables[table, kind]
        match kind:
            case "csv":
                found = read_csv(content)
            case "jsonl":
                found = [json.loads(line) for line in content.splitlines()]
            case _:
                found = pq.read_table(io.BytesIO(content)).to_pylist()
        return [self._numbered(row) for row in found]

    def tensors(self) -> dict[str, dict[str, np.ndarray]]:
        return {
            name: load(content)
            for name, content in self.files.items()
            if name.startswith("tensors/")
        }

    def lerobot(self) -> dict[str, Any]:
        """LeRobot's files by name, as JSON."""
        return {
            name: self._numbered(_read(name, content))
            for name, content in self.files.items()
            if name.startswith("lerobot/")
        }

    def about(self) -> dict[str, Any]:
        """The other files that programs read; lists of named things by their names."""
        names = ["codebook.json", "dataset_description.json"]
        names += [name for name in self.files if name.startswith("protocol/")]
        return {name: _by_name(_read(name, self.files[name])) for name in names}

    def manifest(self) -> dict[str, str]:
        """The SHA-256 of each file by its real name."""
        lines = self._raw["manifest-sha256.txt"].decode().splitlines()
        return {name: digest for digest, name in (line.split("  ", 1) for line in lines)}

    def real_files(self) -> Iterator[tuple[str, bytes]]:
        yield from self._raw.items()

    def named(self, text: str) -> str:
        """A text with its pseudonyms numbered."""
        return _PSEUDONYM.sub(lambda found: self._number(found[0]), text)

    def _number(self, pseudonym: str) -> str:
        return self._numbers.setdefault(pseudonym, f"#{len(self._numbers)}")

    def _numbered(self, content: Any) -> Any:
        if isinstance(content, dict):
            return {key: self._numbered(value) for key, value in content.items()}
        if isinstance(content, list):
            return [self._numbered(value) for value in content]
        return self._number(content) if _is_pseudonym(content) else content


def read_csv(content: bytes) -> list[dict[str, str | float]]:
    """The rows of a CSV file, with numbers where there are some."""
    lines = csv.DictReader(io.StringIO(content.decode(), newline=""))
    return [{name: _number_or_text(text) for name, text in line.items()} for line in lines]


def _number_or_text(text: str) -> str | float:
    if _is_pseudonym(text):  # which may be all digits
        return text
    try:
        return float(text)
    except ValueError:
        return text


def _is_pseudonym(content: Any) -> bool:
    return isinstance(content, str) and _PSEUDONYM.fullmatch(content) is not None


def _by_name(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _by_name(value) for key, value in content.items()}
    if isinstance(content, list) and all(isinstance(e, dict) and "name" in e for e in content):
        return {each["name"]: _by_name(each) for each in content}
    return content


def _read(name: str, content: bytes) -> Any:
    if name.endswith(".parquet"):
        return pq.read_table(io.BytesIO(content)).to_pylist()
    if name.endswith(".yaml"):
        return yaml.safe_load(content)
    return json.loads(content)
