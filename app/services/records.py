"""What was recorded of a drive, put together again, and what it says."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.analysis.measures import Measures, heat_map, measure, trajectory
from app.errors import JoymapError
from app.storage import drives
from app.storage.tables import DriveRow
from app.storage.ticks import COLUMNS, unpack, unpack_props
from models.beads import BeadCounts, count_beads_by_tick
from models.props import Props
from models.tasks import Task, get_task

_POINTS = 600  # at most, of what is drawn
_CUP = 7  # numbers of the cup's pose in a row of props


class NoSuchDrive(JoymapError):
    """A drive that nobody made."""

    status_code = 404
    kind = "no-such-drive"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such drive.")


class NothingRecorded(JoymapError):
    """A drive that ended before its first tick was kept."""

    status_code = 409
    kind = "nothing-recorded"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("Nothing was recorded of this drive: it ended at once.")


@dataclass(frozen=True)
class Record:
    """A drive, tick by tick.

    Attributes:
        drive: The drive's row.
        task: Which task was driven.
        rows: The ticks, ``(n, columns)``.
        cups: The cup's position and orientation at each tick, ``(n, 7)``, or ``(n, 0)``.
        beads: The beads' positions at each tick, ``(n, beads, 3)`` in [m].
    """

    drive: DriveRow
    task: Task
    rows: np.ndarray
    cups: np.ndarray
    beads: np.ndarray

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The ticks by the names of their columns."""
        return {name: self.rows[:, index] for index, name in enumerate(COLUMNS)}

    def measures(self) -> Measures:
        """How it went."""
        found = measure(self.rows, COLUMNS, self.drive.outcome, beads=self.bead_counts())
        return found if self.task.props.obstacle is not None else replace(found, touches=None)

    def bead_counts(self) -> list[BeadCounts]:
        """How many beads were where, at each tick; empty without beads."""
        if not self.beads.size:
            return []
        cups = self.cups
        return count_beads_by_tick(self.task.props, self.beads, cups[:, :3], cups[:, 3:])

    def path(self) -> list[list[float]]:
        """The hand's way, thinned out, in [m]."""
        points = trajectory(self.columns)
        chosen = points[:: max(1, -(-len(points) // _POINTS))]
        return [[round(value, 4) for value in point] for point in chosen.tolist()]

    def stick_map(self) -> list[list[float]]:
        """See :func:`heat_map`."""
        shares: list[list[float]] = heat_map(self.columns).round(5).tolist()
        return shares


def read(db: Session, drive_id: str) -> Record:
    """A drive's record.

    Raises:
        NoSuchDrive: If there is none.
        NothingRecorded: If it has not a single tick.
    """
    drive = drives.by_id(db, drive_id)
    if drive is None:
        raise NoSuchDrive
    task = get_task(drive.task)
    chunks = drives.chunks(db, drive_id)
    if not chunks:
        raise NothingRecorded
    db.expunge(drive)
    props = [
        unpack_props(chunk.props, chunk.ticks)
        if chunk.props is not None
        else np.zeros((chunk.ticks, 0))
        for chunk in chunks
    ]
    cups, beads = split_props(np.concatenate(props), task.props)
    rows = np.concatenate([unpack(chunk.samples) for chunk in chunks])
    return Record(drive, task, rows, cups, beads)


def of_participant(db: Session, participant_id: str) -> list[DriveRow]:
    """Somebody's drives, in the order in which they began."""
    return drives.of_participant(db, participant_id)


def split_props(props: np.ndarray, what: Props) -> tuple[np.ndarray, np.ndarray]:
    """The cup's pose ``(n, 7)`` and the beads' positions ``(n, beads, 3)`` in rows of props."""
    cup = _CUP if what.cup is not None and props.shape[1] else 0
    beads: Any = props[:, cup:].reshape(len(props), -1, 3)
    return props[:, :cup].astype(float), beads.astype(float)
