"""Which step is this person on? The server owns the place; the page only shows it.

A protocol and a cell (the order of the strategies) make a list of steps::

    consent → practice → for each task: queries → training → for each strategy: drive → questions
            → questions on the task → questions at the end → end

A participant's place is an index into it. Nobody goes back: what was given counts.
"""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, Literal

from sqlalchemy.orm import Session

from app.errors import IdReused, WrongStep
from app.schemas.protocol import Protocol, TaskProtocol
from app.services import counterbalancing, protocols
from app.storage import participants
from app.storage.tables import EventRow, ParticipantRow

Kind = Literal["consent", "practice", "queries", "training", "driving", "block", "questions", "end"]

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
class Step:
    """One thing to do.

    Attributes:
        key: Names it in records: ``"queries/avoid"``, ``"block/avoid/2"``, ``"questions/end/sus"``.
        kind: What the page has to show.
        task: The robot task it is about, if any.
        strategies: What is driven under, for the server alone; a block's is one.
        position: Which of the task's blocks it is or follows, from 1.
        questionnaire: The name of the questionnaire asked.
    """

    key: str
    kind: Kind
    task: str | None = None
    strategies: tuple[str, ...] = ()
    position: int | None = None
    questionnaire: str | None = None


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


@lru_cache(maxsize=256)
def steps_of(protocol: Protocol, cell: int) -> tuple[Step, ...]:
    """All steps of a protocol, in order, for people of this cell."""
    order = order_of(protocol, cell)
    asked = protocol.questionnaires
    steps = [Step("consent", "consent")]
    if protocol.practice_s > 0.0:
        steps.append(Step("practice", "practice"))
    for task in (each.task for each in protocol.tasks):
        steps += [
            Step(f"queries/{task}", "queries", task),
            Step(f"training/{task}", "training", task),
        ]
        if protocol.is_free:
            return (*steps, Step("driving", "driving", task, order))
        for position, strategy in enumerate(order, start=1):
            steps.append(Step(f"block/{task}/{position}", "block", task, (strategy,), position))
            steps += _questions(f"{task}/{position}", asked.after_each_strategy, task, position)
        steps += _questions(f"{task}/after", asked.after_each_task, task)
    steps += _questions("end", asked.at_the_end)
    return (*steps, Step("end", "end"))


def _questions(
    when: str, names: tuple[str, ...], task: str | None = None, position: int | None = None
) -> list[Step]:
    """A step for each questionnaire; in protocols kept long ago one may be there several times."""
    steps = []
    for index, name in enumerate(names):
        before = names[:index].count(name)
        key = f"questions/{when}/{name}" + (f"/{before + 1}" if before else "")
        steps.append(Step(key, "questions", task, (), position, name))
    return steps


def order_of(protocol: Protocol, cell: int) -> tuple[str, ...]:
    """The order of the strategies in this cell."""
    every = counterbalancing.orders(protocol.order, protocol.strategies)
    return every[cell % len(every)]


def here(db: Session, participant: ParticipantRow) -> Here:
    """Where the participant is."""
    protocol, version = protocols.of_participant(db, participant)
    steps = steps_of(protocol, participant.cell)
    order = order_of(protocol, participant.cell)
    has_left = participant.state == "withdrawn"
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
