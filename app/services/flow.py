"""Which step is this person on? The server owns the place; the page only shows it.

A participant's place is an index into the plan of their protocol. Nobody goes back: what was given
counts.
"""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.errors import IdReused, WrongStep
from app.schemas.protocol import Protocol, TaskProtocol
from app.services import protocols
from app.services.plan import LAST, Kind, Step, order_of, steps_of
from app.storage import participants
from app.storage.tables import EventRow, ParticipantRow

_WHAT_TO_DO: dict[str, str] = {
    "consent": "agree to take part",
    "practice": "practise with the stick",
    "queries": "answer the questions",
    "training": "let the robot learn",
    "driving": "drive the arm",
    "block": "drive the arm",
    "questions": "answer the questionnaire",
    "end": "read the last page",
}


@dataclass(frozen=True)
class Here:
    """Where a participant is, and what their protocol says."""

    protocol: Protocol
    version: int
    order: tuple[str, ...]
    steps: tuple[Step, ...]
    place: int
    has_left: bool = False  # withdrew: nothing more is asked of them

    @property
    def step(self) -> Step:
        """The step they are on."""
        return self.steps[self.place]

    @property
    def task(self) -> TaskProtocol:
        """What the protocol says of the task they are at, or of the one that comes next."""
        names = [step.task for step in self.steps[self.place :] if step.task is not None]
        name = names[0] if names else self.protocol.tasks[-1].task
        return next(task for task in self.protocol.tasks if task.task == name)

    def block(self, key: str) -> Step | None:
        """The step of that key."""
        return next((step for step in self.steps if step.key == key), None)


def here(db: Session, participant: ParticipantRow) -> Here:
    """Where the participant is."""
    protocol, version = protocols.of_participant(db, participant)
    steps = steps_of(protocol, participant.cell)
    order = order_of(protocol, participant.cell)
    has_left = participant.state == "withdrawn"
    if has_left and steps[-1] != LAST:  # driving freely has no end of its own
        steps = (*steps, LAST)
    place = len(steps) - 1 if has_left else participant.place
    return Here(protocol, version, order, steps, place, has_left)


def require(here: Here, kind: Kind) -> Step:
    """The step the participant is on, if it is of this kind.

    Raises:
        WrongStep: If not, saying what comes first or that it is over.
    """
    if here.has_left:
        raise WrongStep("You have stopped taking part; nothing more was kept.")
    if here.step.kind == kind:
        return here.step
    doing = _WHAT_TO_DO[here.step.kind]
    if any(step.kind == kind for step in here.steps[here.place :]):
        raise WrongStep(f"It is too early for that: first {doing}.")
    raise WrongStep(f"That is over: now {doing}.")


def advance(
    db: Session,
    participant: ParticipantRow,
    at: Here,
    event_id: str,
    kind: Kind,
    key: str | None = None,
    detail: dict[str, Any] | None = None,
) -> Here | None:
    """Take the step out of one of this kind; doing it again with the same id changes nothing.

    Args:
        db: The transaction.
        participant: Whose step it is.
        at: Where they are.
        event_id: The client's id of going on.
        kind: What the page believes to be leaving.
        key: Which of that kind, where there can be several.
        detail: What to keep with it.

    Returns:
        Where they are now; None if the step was taken before.

    Raises:
        IdReused: If the id was used for another step or by someone else.
        WrongStep: If the participant is not on that step.
    """
    before = participants.event(db, event_id)
    if before is not None:
        left = before.kind if key is not None else before.kind.split("/")[0]
        if before.participant_id != participant.id or left != (key or kind):
            raise IdReused
        return None
    step = require(at, kind)
    if step == at.steps[-1]:
        raise WrongStep("There is nothing after this.")
    if key is not None and step.key != key:
        raise WrongStep(f"That is over: now {_WHAT_TO_DO[step.kind]}.")
    now = datetime.now(UTC)
    db.add(
        EventRow(
            id=event_id,
            participant_id=participant.id,
            kind=step.key,
            detail=detail or {},
            at=now,
        )
    )
    return go_on(participant, at)


def go_on(participant: ParticipantRow, at: Here) -> Here:
    """Put the participant on the next step; the last one completes the study."""
    now, after = datetime.now(UTC), replace(at, place=at.place + 1)
    participant.place, participant.seen_at = after.place, now
    if after.step.kind == "end":
        participant.state, participant.ended_at = "completed", now
    return after
