"""How a person's stick is set: the same on whatever device they come back with.

The page applies all of it where it reads the stick, except ``steady``, which needs even ticks
and is applied by the live session.
"""

from dataclasses import asdict, dataclass
from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.errors import IdReused
from app.schemas.participants import StickSettingsIn
from app.services import flow
from app.storage import participants
from app.storage.tables import EventRow, ParticipantRow

_KIND = "stick"


@dataclass(frozen=True)
class StickSettings:
    """What lies between a person's hand and the stick h; by default nothing."""

    invert_x: bool = False  # left is right, with keys and gamepads
    invert_y: bool = False  # forward is back, with keys and gamepads
    gain: float = 1.0  # h is the push times this, no longer than 1
    one_axis: bool = False  # only the larger of x and y counts
    steady: bool = False  # a slower low pass, for hands that shake


def settings_of(participant: ParticipantRow) -> StickSettings:
    """The participant's settings; the defaults for who never changed them."""
    return StickSettings(**(participant.stick or {}))


def change(db: Session, participant: ParticipantRow, wanted: StickSettingsIn) -> bool:
    """Set the stick anew and keep the change with its time; the same id twice is one change.

    Returns:
        Whether it was changed now (not before).

    Raises:
        IdReused: If the id was used for something else.
        WrongStep: If the participant has not agreed to take part yet.
    """
    detail = asdict(StickSettings(**wanted.model_dump(exclude={"id"})))
    before = participants.event(db, str(wanted.id))
    if before is not None:
        if (before.participant_id, before.kind, before.detail) != (participant.id, _KIND, detail):
            raise IdReused
        return False
    at = flow.here(db, participant)
    if at.step.kind == "consent":
        flow.require(at, "practice")
    db.add(
        EventRow(
            id=str(wanted.id),
            participant_id=participant.id,
            kind=_KIND,
            detail=detail,
            at=datetime.now(UTC),
        )
    )
    participant.stick = detail
    return True
