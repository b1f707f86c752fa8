"""What can be shown again tick by tick: a drive as it was recorded, or the move of a question."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.analysis.measures import Measures, heat_map, measure, trajectory
from app.errors import JoymapError
from app.services import queries
from app.storage import drives, participants
from app.storage.tables import AnswerRow, DriveRow, QueryRow
from app.storage.ticks import COLUMNS, unpack, unpack_props
from models.beads import BeadCounts, count_beads_by_tick
from models.demonstrations import DT_S
from models.props import Props
from models.tasks import Task, get_task

_POINTS = 600  # at most, of what is drawn
_MOVE_HZ = 60.0
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


class NoSuchMove(JoymapError):
    """The move of a question that nobody was asked."""

    status_code = 404
    kind = "no-such-move"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such move.")


@dataclass(frozen=True)
class Motion:
    """What the arm did, tick by tick.

    Attributes:
        task: Which task it was.
        rows: The ticks, ``(n, columns)``.
        cups: The cup's position and orientation at each tick, ``(n, 7)``, or ``(n, 0)``.
        beads: The beads' positions at each tick, ``(n, beads, 3)`` in [m].
    """

    task: Task
    rows: np.ndarray
    cups: np.ndarray
    beads: np.ndarray


@dataclass(frozen=True)
class Move(Motion):
    """The move of a question, with the stick that was answered last all the way.

    Attributes:
        query: The question's row.
        answer: The answer's row; None if there is none yet.
    """

    query: QueryRow
    answer: AnswerRow | None

    @property
    def h(self) -> tuple[float, float] | None:
        """The stick that was answered; None if there is no answer, or they could not say."""
        answer = self.answer
        if answer is None or answer.h_x is None or answer.h_y is None:
            return None
        return answer.h_x, answer.h_y

    @property
    def end(self) -> np.ndarray:
        """Where it ends: joint positions ``(7,)`` in [rad]."""
        end: np.ndarray = queries.as_path(self.query)[-1]
        return end


@dataclass(frozen=True)
class Record(Motion):
    """A drive, tick by tick.

    Attributes:
        drive: The drive's row.
    """

    drive: DriveRow

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
    return Record(task, rows, cups, beads, drive)


def read_move(db: Session, query_id: str) -> Move:
    """The move of a question, at the speed at which it was shown.

    Raises:
        NoSuchMove: If there is no such question.
    """
    query = db.get(QueryRow, query_id)
    if query is None:
        raise NoSuchMove
    answer = participants.latest_answers(db, query.participant_id).get(query_id)
    db.expunge_all()
    path, hands = queries.as_path(query), np.asarray(query.hand_path, dtype=float)
    steps_s = DT_S * np.arange(len(path))
    rows = np.zeros((round(steps_s[-1] * _MOVE_HZ) + 1, len(COLUMNS)))
    rows[:, 0] = np.arange(len(rows)) / _MOVE_HZ
    _fill(rows, ("q_1", "q_7"), steps_s, path)
    _fill(rows, ("hand_x", "hand_z"), steps_s, hands)
    cups, beads = np.zeros((len(rows), 0)), np.zeros((len(rows), 0, 3))
    move = Move(get_task(query.task), rows, cups, beads, query, answer)
    if move.h is not None:
        rows[:, [COLUMNS.index("raw_x"), COLUMNS.index("raw_y")]] = move.h
    return move


def _fill(
    rows: np.ndarray, names: tuple[str, str], steps_s: np.ndarray, values: np.ndarray
) -> None:
    first = COLUMNS.index(names[0])
    for column, line in enumerate(values.T):
        rows[:, first + column] = np.interp(rows[:, 0], steps_s, line)


def of_participant(db: Session, participant_id: str) -> list[DriveRow]:
    """Somebody's drives, in the order in which they began."""
    return drives.of_participant(db, participant_id)


def split_props(props: np.ndarray, what: Props) -> tuple[np.ndarray, np.ndarray]:
    """The cup's pose ``(n, 7)`` and the beads' positions ``(n, beads, 3)`` in rows of props."""
    cup = _CUP if what.cup is not None and props.shape[1] else 0
    beads: Any = props[:, cup:].reshape(len(props), -1, 3)
    return props[:, :cup].astype(float), beads.astype(float)
