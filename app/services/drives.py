"""Drives: opening one under a strategy, ending it, and the samples in between."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError, WrongStep
from app.schemas.protocol import NO_ALIGN
from app.services import flow, training
from app.storage import drives, jobs
from app.storage.tables import AlignmentRow, DriveRow, ParticipantRow
from models.strategies import get_strategy

# How an attempt ends that was made to its end.
MADE = ("done", "given up", "time limit")


@dataclass(frozen=True)
class StrategyChoice:
    """How a strategy is offered to the person.

    Attributes:
        name: Of the strategy.
        title: Its name on the page.
        note: What it is, in a few words.
        has_curve: Whether it is learned step by step, so that there is a curve to show.
    """

    name: str
    title: str
    note: str
    has_curve: bool = False


STRATEGIES = (
    StrategyChoice(
        "all-priors",
        "Your mapping",
        "learned from your answers, filled in sensibly",
        has_curve=True,
    ),
    StrategyChoice("task-space", "Your idea", "what your answers have in common"),
    StrategyChoice(
        "no-priors", "Answers only", "learned from your answers and nothing else", has_curve=True
    ),
    StrategyChoice(NO_ALIGN, "Robot's own", "the stick goes to the robot as it is"),
)


def title_of(strategy: str) -> str:
    """What the person knows a strategy as; its name, if it is not offered by a title."""
    titles = {choice.name: choice.title for choice in STRATEGIES}
    return titles.get(strategy, strategy)


class UnknownStrategy(JoymapError):
    """A strategy nobody offers."""

    status_code = 422
    kind = "unknown-strategy"

    def __init__(self, name: str | None) -> None:
        """Say which there are."""
        offered = ", ".join(choice.name for choice in STRATEGIES)
        super().__init__(f"There is no strategy '{name or ''}'. Choose one of: {offered}.")


@dataclass(frozen=True)
class OpenedDrive:
    """A drive as the control loop needs it.

    Attributes:
        id: The client's.
        task: What is driven.
        strategy: The name that it is kept under.
        used: The strategy that it is driven with.
        alignment_file: What that strategy learned; None if it learns nothing.
        is_blinded: Whether the person must not hear the strategy's name.
    """

    id: str
    task: str
    strategy: str
    used: str
    alignment_file: str | None
    is_blinded: bool


@dataclass(frozen=True)
class Chunk:
    """Some ticks of a drive as they are stored (see :class:`SampleChunkRow`)."""

    drive_id: str
    first_tick: int
    ticks: int
    last_monotonic_s: float
    samples: bytes
    props: bytes | None


def open_drive(
    db: Session,
    participant: ParticipantRow,
    drive_id: str,
    strategy: str | None,
    *,
    boot: str,
    now_s: float,
    same_strategy: str | None = None,
) -> OpenedDrive:
    """Open a drive and end the one before it; asking again with the same id changes nothing.

    In a block the protocol says under which strategy; who drives freely chooses. With
    ``same_strategy`` that is the name it is kept under, and what is driven with is that one.

    Raises:
        UnknownStrategy: If there is no such strategy.
        WrongStep: If there is nothing to drive now, or the drive has ended.
        IdReused: If the id is another drive's.
    """
    at = flow.here(db, participant)
    step = at.step
    if step.kind != "block":
        if at.protocol.is_free and strategy not in at.order:
            raise UnknownStrategy(strategy)
        flow.require(at, "driving")
    else:
        strategy = step.strategies[0]
    task = step.task
    assert strategy is not None
    assert task is not None
    if not training.is_ready(db, participant, task):
        raise WrongStep("It is too early for that: the robot is still learning.")
    alignment: AlignmentRow | None = None
    used = same_strategy or strategy
    if get_strategy(used).method.is_learned:
        alignment = jobs.alignment(db, participant.id, task, used)
        if alignment is None:
            raise WrongStep("The robot has not learned that way of steering.")
    opened = OpenedDrive(
        drive_id,
        task,
        strategy,
        used,
        None if alignment is None else alignment.file,
        step.kind == "block",
    )
    before = drives.by_id(db, drive_id)
    if before is not None:
        if (before.participant_id, before.step, before.strategy) != (
            participant.id,
            step.key,
            strategy,
        ):
            raise IdReused
        if before.ended_at is not None:
            raise WrongStep("That drive has ended; please begin a new one.")
        return opened
    if step.kind == "block" and is_over(db, participant, at):
        raise WrongStep("You have driven this way of steering already; please go on.")
    end_open(db, participant)
    participant.seen_at = datetime.now(UTC)
    db.add(
        DriveRow(
            id=drive_id,
            participant_id=participant.id,
            task=task,
            step=step.key,
            strategy=strategy,
            alignment_id=None if alignment is None else alignment.id,
            boot=boot,
            started_at=datetime.now(UTC),
            started_monotonic_s=now_s,
            ended_at=None,
            end=None,
            outcome=None,
        )
    )
    return opened


def made(db: Session, participant: ParticipantRow, at: flow.Here) -> int:
    """How many attempts of the block they are at count as made."""
    counts = MADE if at.protocol.lost_drive == "again" else (*MADE, "left", "server stopped")
    return sum(drive.end in counts for drive in drives.of_step(db, participant.id, at.step.key))


def is_over(db: Session, participant: ParticipantRow, at: flow.Here) -> bool:
    """Whether all attempts of the block they are at are made."""
    return made(db, participant, at) >= at.protocol.drives


def end_open(db: Session, participant: ParticipantRow) -> None:
    """End what goes on: the person goes on to something else."""
    for drive in drives.still_open(db, participant.id):
        _end(drive, "switched")


def still_open(db: Session, participant: ParticipantRow) -> str | None:
    """The id of the drive that goes on, if one does."""
    found = drives.still_open(db, participant.id)
    return found[-1].id if found else None


def end(db: Session, drive_id: str, why: str, outcome: dict[str, Any] | None = None) -> None:
    """End a drive, if it has not ended yet, and keep what its task said then.

    A drive that another one ended meanwhile still gets its outcome.
    """
    drive = drives.by_id(db, drive_id)
    if drive is None:
        return
    if drive.ended_at is None:
        _end(drive, why)
    if drive.outcome is None:
        drive.outcome = outcome


def end_all(db: Session, why: str) -> None:
    """End whatever is open: at a start of the server nothing drives."""
    for drive in drives.still_open(db):
        _end(drive, why)


def keep_samples(db: Session, chunks: list[Chunk]) -> None:
    """Keep chunks of drives' samples, and where their props were."""
    drives.add_chunks(db, [vars(chunk) for chunk in chunks])


def _end(drive: DriveRow, why: str) -> None:
    drive.ended_at = datetime.now(UTC)
    drive.end = why
