"""From answers to alignments: when a training is wanted, what goes in, what comes out.

A job is queued in the transaction that keeps the last answer. What its worker needs is read once,
as a frozen order; what the worker made counts only when it is registered here, in one transaction,
and only if that attempt is still the one that runs.
"""

import hashlib
import uuid
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from app.errors import WrongStep
from app.schemas.participants import TrainingOut
from app.schemas.protocol import TaskProtocol
from app.services import flow, protocols, queries
from app.services.queries import Question
from app.settings import Settings
from app.storage import jobs
from app.storage.tables import AlignmentRow, JobRow, ParticipantRow
from models.fitting import Labels
from models.strategies import get_strategy

ATTEMPTS = 3
FAILED = "The training did not finish. Your answers are safe; please try again."


@dataclass(frozen=True)
class TrainingOrder:
    """Everything a worker needs, and nothing it has to ask for."""

    job_id: str
    attempt: int
    task: str
    strategies: tuple[str, ...]
    pack_dir: Path
    folder: Path  # where finished alignments go
    pool_seed: int
    unlabelled: int
    steps: int | None  # of the optimiser; None: the learning core's own
    seed: int
    data_hash: str
    labels: Labels

    @property
    def name(self) -> str:
        """What files of this attempt begin with."""
        return f"{self.job_id}-{self.attempt}"


@dataclass(frozen=True)
class TrainedAlignment:
    """A finished file of weights, as its worker describes it."""

    strategy: str
    file: str
    weights_sha256: str
    controller_hash: str
    settings: dict[str, Any]
    code_version: str


@dataclass(frozen=True)
class TrainingOutcome:
    """What a worker hands back."""

    alignments: tuple[TrainedAlignment, ...]
    report: dict[str, Any]
    training_s: float


def enqueue(
    db: Session, participant: ParticipantRow, task: TaskProtocol, questions: list[Question]
) -> JobRow:
    """Queue the training for a task on the answers as they are now."""
    job = JobRow(
        id=str(uuid.uuid4()),
        participant_id=participant.id,
        task=task.task,
        state="queued",
        attempt=0,
        data_hash=data_hash(participant, questions),
        seed=participant.seed,
        report={},
        fraction=0.0,
        error=None,
        training_s=None,
        queued_at=datetime.now(UTC),
        ended_at=None,
    )
    db.add(job)
    return job


def data_hash(participant: ParticipantRow, questions: list[Question]) -> str:
    """SHA-256 of all that a training learns from: the moves, the answers, the seed."""
    digest = hashlib.sha256(str(participant.seed).encode())
    for query, answer in queries.labels_of(questions):
        digest.update(f"{query.controller_hash}|{query.s}|{query.next_s}|".encode())
        digest.update(f"{answer.h_x!r},{answer.h_y!r};".encode())
    return digest.hexdigest()


def claim(db: Session, settings: Settings, folder: Path) -> TrainingOrder | None:
    """Take the oldest queued job and read what its worker needs; it writes to ``folder``."""
    job = jobs.claim(db)
    if job is None:
        return None
    participant = db.get_one(ParticipantRow, job.participant_id)
    protocol, _ = protocols.of_participant(db, participant)
    task = next(each for each in protocol.tasks if each.task == job.task)
    given = queries.labels_of(queries.asked(db, participant, task))
    return TrainingOrder(
        job_id=job.id,
        attempt=job.attempt,
        task=task.task,
        strategies=tuple(
            name for name in protocol.strategies if get_strategy(name).method.is_learned
        ),
        pack_dir=settings.pack_dir,
        folder=folder,
        pool_seed=participant.seed,
        unlabelled=task.unlabelled,
        steps=settings.training_steps,
        seed=job.seed,
        data_hash=job.data_hash,
        labels=queries.as_labels(given),
    )


def note_progress(
    db: Session, job_id: str, attempt: int, fraction: float, report: dict[str, Any]
) -> None:
    """Keep how far an attempt has come, if it still counts."""
    job = jobs.running(db, job_id, attempt)
    if job is not None:
        job.fraction = fraction
        job.report = report


def finish(db: Session, job_id: str, attempt: int, outcome: TrainingOutcome) -> bool:
    """Register what an attempt made; False if that attempt no longer counts."""
    job = jobs.running(db, job_id, attempt)
    if job is None:
        return False
    now = datetime.now(UTC)
    for trained in outcome.alignments:
        db.add(
            AlignmentRow(
                id=str(uuid.uuid4()),
                participant_id=job.participant_id,
                job_id=job.id,
                task=job.task,
                strategy=trained.strategy,
                file=trained.file,
                weights_sha256=trained.weights_sha256,
                data_hash=job.data_hash,
                controller_hash=trained.controller_hash,
                seed=job.seed,
                settings=trained.settings,
                code_version=trained.code_version,
                trained_at=now,
            )
        )
    job.state, job.fraction, job.ended_at = "succeeded", 1.0, now
    job.report, job.training_s, job.error = outcome.report, outcome.training_s, None
    return True


def give_up_attempt(db: Session, job_id: str, attempt: int) -> None:
    """An attempt came to nothing: queue the job again, or end it after ``ATTEMPTS`` of them."""
    job = jobs.running(db, job_id, attempt)
    if job is None:
        return
    if job.attempt < ATTEMPTS:
        job.state = "queued"
    else:
        job.state, job.error, job.ended_at = "failed", FAILED, datetime.now(UTC)


def recover(db: Session) -> None:
    """After a start of the server: whatever ran then runs no more, so queue it again."""
    for job in jobs.all_running(db):
        give_up_attempt(db, job.id, job.attempt)


def retry(db: Session, participant: ParticipantRow, task: str) -> None:
    """Queue a failed training again; one that has not failed is left as it is."""
    job = jobs.of_task(db, participant.id, task)
    if job is None:
        raise WrongStep("There is nothing to learn from yet: first answer the questions.")
    if job.state == "failed":
        job.state, job.attempt, job.error, job.ended_at = "queued", 0, None, None


def retrain(db: Session, participant: ParticipantRow, task: str) -> None:
    """Train on the answers as they are: a training that failed or is of other answers.

    Raises:
        WrongStep: If there is nothing to learn from, or what there is was learned already.
    """
    protocol, _ = protocols.of_participant(db, participant)
    asked = next((each for each in protocol.tasks if each.task == task), None)
    job = jobs.of_task(db, participant.id, task)
    if asked is None or job is None:
        raise WrongStep("There is nothing to learn from yet at this task.")
    if job.state == "failed":
        retry(db, participant, task)
        return
    if job.state in ("queued", "running"):
        raise WrongStep("A training for this task is going on already.")
    questions = queries.asked(db, participant, asked)
    if job.data_hash == data_hash(participant, questions):
        raise WrongStep("These answers were learned already; a training would give the same.")
    enqueue(db, participant, asked, questions)


def is_ready(db: Session, participant: ParticipantRow, task: str) -> bool:
    """Whether the participant's alignments for a task can drive."""
    job = jobs.of_task(db, participant.id, task)
    return job is not None and job.state == "succeeded"


def status(db: Session, participant: ParticipantRow, at: flow.Here) -> TrainingOut:
    """How far the participant's training is; what it learns is told to who drives freely only.

    Raises:
        WrongStep: If none was ever wanted.
    """
    task = at.step.task or at.task.task
    job = jobs.of_task(db, participant.id, task)
    if job is None:
        raise WrongStep("There is nothing to learn from yet: first answer the questions.")
    return TrainingOut(
        state=job.state,  # type: ignore[arg-type]
        error=job.error,
        fraction=job.fraction,
        attempt=job.attempt,
        training_s=job.training_s,
        strategies=job.report if at.protocol.is_free else {},
    )
