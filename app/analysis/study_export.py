"""An export of a study as it is read again: its tables, its protocol, and its drives' ticks."""

import io
import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from app.analysis.codebook import TABLES
from app.errors import JoymapError
from app.schemas import yaml_reader
from app.schemas.yaml_reader import NotReadable

_READ = ("participants", "queries", "answers", "alignments", "trainings", "drives", "responses")
_SAMPLES = "samples"
_ENDS = "_data.parquet"
_PROTOCOL = re.compile(r"protocol/version-(\d+)\.yaml")


class NotAnExport(JoymapError):
    """What was given is not a whole export."""


@dataclass(frozen=True)
class DriveTicks:
    """The ticks of one drive.

    Attributes:
        drive: Its pseudonym.
        columns: Those asked for, ``(n,)`` each.
    """

    drive: str
    columns: dict[str, np.ndarray]


@dataclass(frozen=True)
class StudyExport:
    """A study's export, without those who were excluded.

    Attributes:
        path: The zip or the folder.
        tables: The rows of each table but the ticks, by the table's name.
        protocols: Each version of the protocol, by its number.
        excluded: How many participants were left out.
    """

    path: Path
    tables: dict[str, list[dict[str, Any]]]
    protocols: dict[int, dict[str, Any]]
    excluded: int

    @property
    def title(self) -> str:
        """The study's, as it was last."""
        return str(self.protocols[max(self.protocols)]["title"])

    def ticks(self, columns: Sequence[str]) -> Iterator[DriveTicks]:
        """Every drive with these columns of its ticks, one drive after the other."""
        wanted = {row["drive"] for row in self.tables["drives"]}
        drive, parts = "", list[pa.RecordBatch]()
        with _Files(self.path) as files:
            sheet = pq.ParquetFile(files.open_table(_SAMPLES))
            for batch in sheet.iter_batches(columns=["drive", *columns]):
                for part in _runs(batch):
                    name = part.column("drive")[0].as_py()
                    if name != drive and parts:
                        yield _joined(drive, parts, columns)
                        parts = []
                    drive = name
                    if drive in wanted:
                        parts.append(part)
        if parts:
            yield _joined(drive, parts, columns)


def read_export(path: Path) -> StudyExport:
    """Read what 'joymap export' or the dashboard's button made.

    Args:
        path: The zip, or the folder.

    Raises:
        NotAnExport: If it is none, or not a whole one.
    """
    try:
        with _Files(path) as files:
            tables = {name: _table(files, name) for name in _READ}
            protocols = {
                int(found[1]): _protocol(files.read(name))
                for name in files.names
                if (found := _PROTOCOL.fullmatch(name))
            }
    except FileNotFoundError as error:
        raise NotAnExport(f"There is nothing at {path}.") from error
    except NotReadable as error:
        raise NotAnExport(f"A protocol in {path} cannot be read: {error.sentence}") from error
    except _Missing as error:
        raise NotAnExport(f"{path} is not a whole export: it has no {error}.") from error
    except (zipfile.BadZipFile, pa.ArrowException, EOFError, zlib.error) as error:
        raise NotAnExport(f"{path} is not a whole export; make it again.") from error
    if not protocols:
        raise NotAnExport(f"{path} is not a whole export: it has no protocol.")
    excluded = {row["participant"] for row in tables["participants"] if row["excluded"]}
    kept = {
        name: [row for row in rows if row["participant"] not in excluded]
        for name, rows in tables.items()
    }
    return StudyExport(path, kept, protocols, len(excluded))


class _Missing(Exception):
    """Something that every export has."""


def _table(files: "_Files", name: str) -> list[dict[str, Any]]:
    table = pq.read_table(files.open_table(name))
    missing = [each.name for each in TABLES[name].columns if each.name not in table.column_names]
    if missing:
        raise _Missing(f"column '{missing[0]}' in its table '{name}'")
    rows: list[dict[str, Any]] = table.to_pylist()
    return rows


def _protocol(source: bytes) -> dict[str, Any]:
    content = yaml_reader.read(source).content
    if not isinstance(content, dict) or "title" not in content:
        raise _Missing("protocol with a title")
    return content


class _Files:
    """A zip or a folder, by the paths in it, wherever in it the export lies.

    Who packs an export anew puts a folder around it, and some systems leave notes of their own.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._zip = None if path.is_dir() else zipfile.ZipFile(path)
        if self._zip is not None:
            names = self._zip.namelist()
        else:
            inside = (each for each in path.rglob("*") if each.is_file())
            names = [each.relative_to(path).as_posix() for each in inside]
        names = [name for name in names if not _is_note(name)]
        ends = f"-{_READ[0]}{_ENDS}"
        folders = [name.rpartition("/")[0] for name in names if name.endswith(ends)]
        self._root = min(folders, key=len, default="").removesuffix("data")
        self.names = [name[len(self._root) :] for name in names if name.startswith(self._root)]

    def __enter__(self) -> "_Files":
        return self

    def __exit__(self, *_error: object) -> None:
        if self._zip is not None:
            self._zip.close()

    def read(self, name: str) -> bytes:
        if self._zip is not None:
            return self._zip.read(self._root + name)
        return (self._path / self._root / name).read_bytes()

    def open_table(self, name: str) -> Any:
        found = [each for each in self.names if each.endswith(f"-{name}{_ENDS}")]
        if not found:
            raise _Missing(f"table '{name}'")
        # Parquet is not packed again in the zip, yet a member of a zip is slow to seek in.
        return io.BytesIO(self.read(found[0]))


def _is_note(name: str) -> bool:
    """Whether a file is a system's own: a fork beside another, a lock, a list of thumbnails."""
    *folders, file = name.split("/")
    return "__MACOSX" in folders or file.startswith((".", "~$", "._"))


def _runs(batch: pa.RecordBatch) -> Iterator[pa.RecordBatch]:
    """A batch cut where the drive changes."""
    if not len(batch):
        return
    names = batch.column("drive").to_numpy(zero_copy_only=False)
    edges = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1), len(names)]
    for begin, end in pairwise(edges):
        yield batch.slice(begin, end - begin)


def _joined(drive: str, parts: list[pa.RecordBatch], columns: Sequence[str]) -> DriveTicks:
    table = pa.Table.from_batches(parts)
    return DriveTicks(drive, {name: table.column(name).to_numpy() for name in columns})
