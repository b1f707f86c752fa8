"""An export of a study as it is read again: its tables, its protocol, and its drives' ticks."""

import io
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from app.errors import JoymapError
from app.schemas import yaml_reader

_READ = ("participants", "queries", "answers", "alignments", "trainings", "drives", "responses")
_SAMPLES = "samples"


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
            tables = {name: pq.read_table(files.open_table(name)).to_pylist() for name in _READ}
            protocols = {
                int(name.removesuffix(".yaml").rsplit("-", 1)[1]): _yaml(files.read(name))
                for name in files.names
                if name.startswith("protocol/version-")
            }
    except FileNotFoundError as error:
        raise NotAnExport(f"There is nothing at {path}.") from error
    except (zipfile.BadZipFile, pa.ArrowInvalid, KeyError, EOFError) as error:
        raise NotAnExport(f"{path} is not a whole export; make it again.") from error
    excluded = {row["participant"] for row in tables["participants"] if row["excluded"]}
    kept = {
        name: [row for row in rows if row["participant"] not in excluded]
        for name, rows in tables.items()
    }
    return StudyExport(path, kept, protocols, len(excluded))


def _yaml(source: bytes) -> Any:
    return yaml_reader.read(source).content


class _Files:
    """A zip or a folder, by the paths in it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._zip = None if path.is_dir() else zipfile.ZipFile(path)
        if self._zip is not None:
            self.names = self._zip.namelist()
        else:
            inside = (each for each in path.rglob("*") if each.is_file())
            self.names = [each.relative_to(path).as_posix() for each in inside]

    def __enter__(self) -> "_Files":
        return self

    def __exit__(self, *_error: object) -> None:
        if self._zip is not None:
            self._zip.close()

    def read(self, name: str) -> bytes:
        if self._zip is not None:
            return self._zip.read(name)
        return (self._path / name).read_bytes()

    def open_table(self, name: str) -> Any:
        found = [each for each in self.names if each.endswith(f"-{name}_data.parquet")]
        if not found:
            raise KeyError(name)
        # Parquet is not packed again in the zip, yet a member of a zip is slow to seek in.
        return io.BytesIO(self.read(found[0]))


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
