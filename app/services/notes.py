"""What experimenters note of participants."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.errors import IdReused
from app.services import audit
from app.storage.tables import NoteRow, ParticipantRow


def add(
    db: Session, experimenter_id: str, participant: ParticipantRow, note_id: str, text: str
) -> None:
    """Keep a note, without its words in the audit; the same twice is one.

    Raises:
        IdReused: If the id was used for something else.
    """
    before = db.get(NoteRow, note_id)
    if before is not None:
        if (before.participant_id, before.text) != (participant.id, text):
            raise IdReused
        return
    db.add(
        NoteRow(
            id=note_id,
            participant_id=participant.id,
            experimenter_id=experimenter_id,
            text=text,
            written_at=datetime.now(UTC),
        )
    )
    audit.note(db, experimenter_id, "participant.note", participant.id)
    db.flush()
