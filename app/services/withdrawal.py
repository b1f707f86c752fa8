"""Somebody stops taking part: what they gave is left out of the study, or erased, as they wish.

Of who is erased one row stays, with their number and that they withdrew: nothing they gave.
"""

from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy.orm import Session

from app.errors import IdReused
from app.services import enrolment
from app.storage import erasure, participants
from app.storage.database import Database
from app.storage.tables import EventRow, ParticipantRow

_KIND = "withdraw"


def withdraw(db: Session, participant: ParticipantRow, event_id: str) -> None:
    """Let somebody go; doing it again changes nothing.

    Raises:
        IdReused: If the id was used for something else.
    """
    before = participants.event(db, event_id)
    if before is not None and (before.participant_id, before.kind) != (participant.id, _KIND):
        raise IdReused
    if participant.state == "withdrawn":
        return
    now = datetime.now(UTC)
    db.add(EventRow(id=event_id, participant_id=participant.id, kind=_KIND, detail={}, at=now))
    enrolment.leave(db, participant, "withdrawn")


def erase(database: Database, data_dir: Path, participant_id: str) -> bool:
    """Erase what somebody gave who withdrew, from the tables, the files and the log.

    Returns:
        Whether the log could be emptied now; it is at the latest when the server stops.
    """
    with database.write() as db:
        participant = db.get_one(ParticipantRow, participant_id)
        files = erasure.erase(db, participant_id)
        participant.external_id, participant.stick, participant.seed = None, None, 0
        participant.excluded, participant.browser_hash = None, None
        participant.erased_at = participant.erased_at or datetime.now(UTC)
    for name in files:
        for path in (data_dir / "alignments").glob(f"{name}.*"):
            path.unlink(missing_ok=True)
    return database.forget_erased()
