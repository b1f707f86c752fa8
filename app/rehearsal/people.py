"""The people of a rehearsal in a file: a line each, so that a run that was stopped goes on."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.analysis.json_lines import JsonLines, open_lines
from app.analysis.simulation_journal import origin
from app.analysis.simulation_rows import SimulationError
from app.rehearsal.participant import Drove, Part

PEOPLE = "people.jsonl"
_APP = Path(__file__).resolve().parents[1]
# What decides how somebody answers and drives, beside the learning core.
_DECIDE = (
    "analysis/measures.py",
    "bots/*.py",
    "rehearsal/*.py",
    "services/queries.py",
    "teleop/*.py",
)


class People:
    """Those of a folder who have driven.

    Attributes:
        drives: Somebody's attempts by their number, in the order of the strategies.
        seconds: How long each took their worker, in [s].
    """

    def __init__(self, lines: JsonLines, folder: Path, part: Part) -> None:
        """Read what is there; :func:`open_people` is the way in."""
        self.drives: dict[int, tuple[Drove, ...]] = {}
        self.seconds: dict[int, float] = {}
        self._lines = lines
        self._folder = folder
        self._part = part
        self._origin = _origin()
        lines.read(self._take)

    def add(self, part: Part, drove: tuple[Drove, ...], seconds: float) -> None:
        """Keep what came of a part; when this returns it is on the disk."""
        self._lines.add(
            {
                "origin": self._origin,
                "seconds": round(seconds, 3),
                "part": asdict(part),
                "drives": [asdict(each) for each in drove],
            }
        )
        self.drives[part.number] = drove
        self.seconds[part.number] = seconds

    def missing(self, count: int) -> list[Part]:
        """The parts of the first ``count`` people that nobody has taken yet."""
        numbers = (number for number in range(count) if number not in self.drives)
        return [replace(self._part, number=number) for number in numbers]

    def values(self, measure: str, count: int) -> np.ndarray:
        """A measure of the first ``count`` people, ``(count, strategies)``, in its own unit."""
        return np.array(
            [[getattr(each, measure) for each in self.drives[n]] for n in range(count)], dtype=float
        )

    def _take(self, entry: Any) -> None:
        number, drove = entry["part"]["number"], [Drove(**each) for each in entry["drives"]]
        wanted = json.loads(json.dumps(asdict(replace(self._part, number=number))))
        other = [name for name in wanted if entry["part"][name] != wanted[name]]
        if entry["origin"] != self._origin:
            other = ["code, weights or libraries"]
        if other:
            raise SimulationError(
                f"{self._folder} holds people of other {', '.join(other)}; begin anew with "
                "--fresh, or give another --out."
            )
        self.drives[number] = tuple(drove)
        self.seconds[number] = float(entry["seconds"])


@contextmanager
def open_people(folder: Path, part: Part, *, is_fresh: bool) -> Iterator[People]:
    """The people of a folder, which is made if it is not there, for one process at a time.

    Args:
        folder: Where their file lies.
        part: What they do; its number does not count.
        is_fresh: Whether to send away who is there.

    Raises:
        SimulationError: If they did something else or their file is damaged, or another process is
            at it.
    """
    with open_lines(folder / PEOPLE, is_fresh=is_fresh) as lines:
        yield People(lines, folder, part)


def _origin() -> str:
    """Twelve digits for all that decides a person's line beside their part."""
    digest = hashlib.sha256(origin().encode())
    for path in sorted(path for pattern in _DECIDE for path in _APP.glob(pattern)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
