"""The measures of drives, worked out once: a drive that has ended stays as it was."""

import threading
from collections import OrderedDict
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.analysis.measures import Measures
from app.services import records
from app.storage import drives
from app.storage.tables import DriveRow

_KEPT = 2000  # drives; a few numbers each
_KNOWN: "OrderedDict[str, tuple[object, Measures]]" = OrderedDict()
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Measured:
    """A drive and how it went; without ticks there are no measures."""

    drive: DriveRow
    ticks: int
    measures: Measures | None


def of_participant(db: Session, participant_id: str) -> list[Measured]:
    """A participant's drives, in the order in which they began.

    Only records that are not known yet, or have grown since, are read.
    """
    kept = drives.ticks_of(db, participant_id)
    found = []
    for drive in drives.of_participant(db, participant_id):
        ticks = kept.get(drive.id, 0)
        found.append(Measured(drive, ticks, _measures(db, drive, ticks) if ticks else None))
    return found


def forget() -> None:
    """Keep nothing of any drive any more: somebody's were erased."""
    with _LOCK:
        _KNOWN.clear()


def _measures(db: Session, drive: DriveRow, ticks: int) -> Measures:
    # All that the measures are made of: who ended the drive may say last how it went.
    state = (ticks, drive.task, repr(drive.outcome))
    with _LOCK:
        known = _KNOWN.get(drive.id)
        if known is not None and known[0] == state:
            _KNOWN.move_to_end(drive.id)
            return known[1]
    measures = records.read(db, drive.id).measures()
    with _LOCK:
        _KNOWN[drive.id] = state, measures
        while len(_KNOWN) > _KEPT:
            _KNOWN.popitem(last=False)
    return measures
