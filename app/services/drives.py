"""Drives: opening one under a strategy, ending it, and the samples in between."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError, WrongStep
from app.services import flow, training
from app.storage import drives, jobs
from app.storage.tables import AlignmentRow, DriveRow, ParticipantRow

NO_ALIGN = "no-align"


@dataclass(frozen=True)
class StrategyChoice:
    """How a strategy is offered to the person."""

    name: str
    title: str
    note: str


STRATEGIES = (
    StrategyChoice("all-priors", "Your mapping", "learned from your answers, filled in sensibly"),
    StrategyChoice("task-space", "Your idea", "what your answers have in common"),
    StrategyChoice("no-priors", "Answers only", "learned from your answers and nothing else"),
    StrategyChoice(NO_ALIGN, "Robot's own", "the stick goes to the robot as it is"),
)


class UnknownStrategy(JoymapError):
    """A strategy nobody offers."""

    status_code = 422
    kind = "unknown-strategy"

    def __init__(self, name: str) -> None:
        """Say which there are."""
        offered = ", ".join(choice.name for choice in STRATEGIES)
        super().__init__(f"There is no strategy '{name}'. Choose one of: {offered}.")


@dataclass(frozen=True)
class OpenedDrive:
    """A drive as the control loop needs it."""

    id: str
    strategy: str
    alignment_file: str | None  # None: the stick is the latent action


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
    strategy: str,
    *,
    boot: str,
    now_s: float,
) -> OpenedDrive:
    """Open a drive and end the one before it; asking again with the same id changes nothing.

    Raises:
        UnknownStrategy: If there is no such strategy.
        WrongStep: If the participant's alignments are not ready, or the drive has ended.
        IdReused: If the id is another drive's.
    """
    if strategy not in {choice.name for choice in STRATEGIES}:
        raise UnknownStrategy(strategy)
    flow.require(participant, "driving")
    if not training.is_ready(db, participant):
        raise WrongStep("It is too early for that: the robot is still learning.")
    alignment: AlignmentRow | None = None
    if strategy != NO_ALIGN:
        alignment = jobs.alignment(db, participant.id, strategy)
        if alignment is None:
            raise WrongStep("The robot has not learned that way of steering.")
    opened = OpenedDrive(drive_id, strategy, None if alignment is None else alignment.file)
    before = drives.by_id(db, drive_id)
    if before is not None:
        if (before.participant_id, before.strategy) != (participant.id, strategy):
            raise IdReused
        if before.ended_at is not None:
            raise WrongStep("That drive has ended; please begin a new one.")
        return opened
    for earlier in drives.still_open(db, participant.id):
        _end(earlier, "switched")
    db.add(
        DriveRow(
            id=drive_id,
            participant_id=participant.id,
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
