"""Rows of the simulation experiment: what varies, what is measured, and files of them."""

import csv
import io
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from models.experiment import Row

MEASURES = (
    "position_error",
    "rotation_error",
    "alignment_error",
    "motion_gain",
    "training_seconds",
)
COLUMNS = tuple(field.name for field in fields(Row))
# All that tells two settings apart; the rows of a setting differ by their seed alone.
FACTORS = tuple(name for name in COLUMNS if name not in ("seed", *MEASURES))


class SimulationError(Exception):
    """Why a simulation cannot be run or shown; the message is one sentence for a person."""


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of one measure.

    Attributes:
        mean: Over the seeds.
        sd: The sample's (n - 1); ``None`` for a single seed.
    """

    mean: float
    sd: float | None


@dataclass(frozen=True)
class Setting:
    """The rows that differ by their seed alone.

    Attributes:
        factors: Value by name, in the order of :data:`FACTORS`.
        n: How many seeds.
        spreads: By measure, in the order of :data:`MEASURES`.
    """

    factors: dict[str, str | int | float]
    n: int
    spreads: dict[str, Spread]


def summarise(rows: Iterable[Row]) -> list[Setting]:
    """One setting for all rows that differ by their seed alone, in the order of the rows."""
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(getattr(row, name) for name in FACTORS), []).append(row)
    return [
        Setting(
            {name: getattr(group[0], name) for name in FACTORS},
            len(group),
            {name: spread(values(group, name)) for name in MEASURES},
        )
        for group in groups.values()
    ]


def spread(found: np.ndarray) -> Spread:
    """Mean and standard deviation of at least one value ``(n,)``."""
    return Spread(float(found.mean()), float(found.std(ddof=1)) if len(found) > 1 else None)


def select(rows: Iterable[Row], **wanted: object) -> list[Row]:
    """The rows whose columns have these values, in their order."""
    if not wanted:
        return list(rows)
    columns = attrgetter(*wanted)
    target = tuple(wanted.values()) if len(wanted) > 1 else next(iter(wanted.values()))
    return [row for row in rows if columns(row) == target]


def values(rows: Sequence[Row], column: str) -> np.ndarray:
    """One column of numbers, ``(n,)``."""
    return np.array([getattr(row, column) for row in rows], dtype=float)


def distinct(rows: Iterable[Row], column: str) -> list[object]:
    """The values of a column, each once, in the order in which they come."""
    return list(dict.fromkeys(getattr(row, column) for row in rows))


def rows_csv(rows: Iterable[Row]) -> str:
    """A table with one line a row; numbers are written in full."""
    return _csv(COLUMNS, (asdict(row).values() for row in rows))


def summary_csv(settings: Iterable[Setting]) -> str:
    """A table with one line a setting: its factors, n, and each measure's mean and deviation."""
    pairs = [f"{measure}_{part}" for measure in MEASURES for part in ("mean", "sd")]
    lines = (
        [
            *setting.factors.values(),
            setting.n,
            *(part for found in setting.spreads.values() for part in (found.mean, found.sd)),
        ]
        for setting in settings
    )
    return _csv([*FACTORS, "n", *pairs], lines)


def read_rows(path: Path) -> list[Row]:
    """The rows of a file that :func:`rows_csv` filled.

    Raises:
        SimulationError: If there is no such file or it holds something else.
    """
    try:
        with path.open(newline="") as file:
            return [_parse(line) for line in csv.DictReader(file)]
    except FileNotFoundError:
        raise SimulationError(
            f"{path} is not there; 'joymap simulate --out {path.parent}' makes it."
        ) from None
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise SimulationError(f"{path} is not a table of rows ({error}).") from error


def write_file(path: Path, content: str) -> None:
    """Write a file that is either there and whole, or as it was before."""
    scratch = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        scratch.write_text(content, newline="")
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


def _csv(head: Sequence[str], lines: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(lines)
    return text.getvalue()


def _parse(line: dict[str, str]) -> Row:
    kinds: dict[object, Callable[[str], object]] = {str: str, int: int, float: float}
    columns: dict[str, Any] = {
        field.name: kinds[field.type](line[field.name]) for field in fields(Row)
    }
    return Row(**columns)
