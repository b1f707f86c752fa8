"""Which step is this person on? The server owns the place; the page only shows it.

::

    consent ──agrees──► practice ──ready──► queries ──last answer──► training ──goes on──► driving

``queries → training`` happens by the answer that leaves nothing to ask (services.queries); the
other steps by the person pressing on. Nobody goes back: earlier answers count.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy.orm import Session

from app.errors import IdReused, WrongStep
from app.storage import participants
from app.storage.tables import EventRow, ParticipantRow

Step = Literal["consent", "practice", "queries", "training", "driving"]
STEPS: tuple[Step, ...] = ("consent", "practice", "queries", "training", "driving")

_WHAT_TO_DO: dict[str, str] = {
    "consent": "agree to take part",
    "practice": "practise with the stick",
    "queries": "answer the questions",
    "training": "let the robot learn",
    "driving": "drive the arm",
}


@dataclass(frozen=True)
class Consent:
    """The text people agree to."""

    version: str
    title: str
    paragraphs: tuple[str, ...]


CONSENT = Consent(
    version="3",
    title="Teach a robot arm how you steer",
    paragraphs=(
        "You will see a robot arm make a few short moves. For each one you show which stick "
        "input you would give to make the arm move like that. There are no right or wrong "
        "answers: it is your idea of steering that counts.",
        "From your answers the robot learns your way of steering, and then you drive it. "
        "It takes about five minutes. You can use a mouse, a finger, the keyboard or a gamepad.",
        "We keep your answers, how you set your stick, and how the arm moved while you drove, with "
        "the time of each. "
        "We do not ask for your name and keep nothing else about you. You may stop at any time "
        "by closing this page; your link brings you back to where you were.",
    ),
)


def require(participant: ParticipantRow, step: Step) -> None:
    """Make sure that the participant is on this step.

    Raises:
        WrongStep: If not, saying what comes first or that it is over.
    """
    if participant.step == step:
        return
    if STEPS.index(step) > STEPS.index(participant.step):
        raise WrongStep(f"It is too early for that: first {_WHAT_TO_DO[participant.step]}.")
    raise WrongStep(f"That is over: now {_WHAT_TO_DO[participant.step]}.")


def advance(
    db: Session,
    participant: ParticipantRow,
    event_id: str,
    leaves: Step,
    detail: dict[str, Any] | None = None,
) -> bool:
    """Take the step out of ``leaves``; doing it again with the same id changes nothing.

    Returns:
        Whether the step was taken now (not before).

    Raises:
        IdReused: If the id was used for another step or by someone else.
        WrongStep: If the participant is not on that step.
    """
    before = participants.event(db, event_id)
    if before is not None:
        if before.participant_id != participant.id or before.kind != leaves:
            raise IdReused
        return False
    require(participant, leaves)
    db.add(
        EventRow(
            id=event_id,
            participant_id=participant.id,
            kind=leaves,
            detail=detail or {},
            at=datetime.now(UTC),
        )
    )
    participant.step = STEPS[STEPS.index(leaves) + 1]
    return True
