"""What participants do at their steps: each is one transaction, and holds the lock but briefly.

Drawing moves and judging answers take tenths of a second, in which nobody else could write. So a
transaction that wants one of them is left, with nothing kept; it is worked out, and the
transaction begins anew. What was worked out is known by all that it was made of: if that has
changed meanwhile, it is not used.
"""

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from app.errors import WrongStep
from app.schemas.participants import AnswerIn, ConsentIn, QuestionnaireIn, SessionOut
from app.schemas.protocol import TaskProtocol
from app.services import consent, drives, flow, plan, queries, responses, training, visit
from app.services.queries import Question
from app.storage.database import Database
from app.storage.tables import ParticipantRow
from models.controller import LatentController
from models.fitting import Labels
from models.kinematics import Kinematics
from models.task_space import Survey

T = TypeVar("T")


class _Wanted(Exception):
    """Something that takes long, wanted in a transaction, which is left for it."""

    def __init__(self, made_of: Hashable, work_out: Callable[[], Any]) -> None:
        super().__init__()
        self.made_of, self.work_out = made_of, work_out


class _WorkedOut:
    """What was worked out before the transaction, by all that it was made of."""

    def __init__(self) -> None:
        self._found: dict[Hashable, Any] = {}

    def get(self, made_of: Hashable, work_out: Callable[[], T]) -> T:
        """What there is; the transaction is left if there is nothing yet."""
        if made_of not in self._found:
            raise _Wanted(made_of, work_out)
        found: T = self._found[made_of]
        return found

    def add(self, wanted: _Wanted) -> None:
        """Work something out."""
        self._found[wanted.made_of] = wanted.work_out()


@dataclass(frozen=True)
class Steps:
    """The steps of this server's participants.

    Attributes:
        database: Where what they give is kept.
        controllers: The learned controller of each task, by its name.
        kinematics: The arm's.
        survey: Of a task, made when it is first asked for.
    """

    database: Database
    controllers: dict[str, LatentController]
    kinematics: Kinematics
    survey: Callable[[str], Survey]
    _working: threading.Lock = field(default_factory=threading.Lock)

    def session(self, participant_id: str) -> SessionOut:
        """Where the person is."""
        with self.database.read() as db:
            row = db.get_one(ParticipantRow, participant_id)
            at = flow.here(db, row)
            return visit.session_of(visit.snapshot(db, row, at, queries.shown(db, row, at)))

    def agree(self, participant_id: str, given: ConsentIn) -> SessionOut:
        """The person agrees to take part; the same id twice counts once.

        Raises:
            WrongStep: If they agree to another text than there is, or are past it.
            IdReused: If the id was used for something else.
        """

        def leave(db: Session, row: ParticipantRow, at: flow.Here) -> flow.Here | None:
            if given.version != consent.version_of(at.protocol):
                raise WrongStep("The text has changed meanwhile; please reload the page.")
            detail = {"version": given.version, "protocol": at.version}
            return flow.advance(db, row, at, str(given.id), "consent", detail=detail)

        return self._take(participant_id, leave)

    def go_on(
        self, participant_id: str, event_id: str, kind: plan.Kind, key: str | None = None
    ) -> SessionOut:
        """The person is done with a step of this kind; the same id twice counts once.

        Raises:
            WrongStep: If they are not on that step, or it is too early to leave it.
            IdReused: If the id was used for something else.
        """

        def leave(db: Session, row: ParticipantRow, at: flow.Here) -> flow.Here | None:
            if at.step.kind == kind == "training" and not training.is_ready(db, row, at.task.task):
                raise WrongStep("It is too early for that: the robot is still learning.")
            if at.step.kind == kind == "block" and key == at.step.key:
                if not drives.is_over(db, row, at):
                    raise WrongStep("It is too early for that: first drive the arm.")
                drives.end_open(db, row)
            return flow.advance(db, row, at, event_id, kind, key)

        return self._take(participant_id, leave)

    def fill_in(self, participant_id: str, given: QuestionnaireIn) -> SessionOut:
        """The person has filled in a questionnaire; the same id twice is kept once.

        Raises:
            WrongStep: If they are not at this questionnaire.
            BadResponse: If it is not filled in as it asks.
            IdReused: If the id was used for something else.
        """

        def leave(db: Session, row: ParticipantRow, at: flow.Here) -> flow.Here | None:
            return responses.record(db, row, at, given)

        return self._take(participant_id, leave)

    def answer(self, participant_id: str, given: AnswerIn) -> tuple[SessionOut, bool]:
        """The person answers a question; the last one they need to queues the training.

        Returns:
            Where they are then, and whether the answer is kept now (not before).

        Raises:
            WrongStep: If the questions have not begun, or the training has.
            UnknownQuery: If the question is not on their screen.
            IdReused: If the id was used for another answer.
        """

        def act(
            db: Session, row: ParticipantRow, at: flow.Here, worked_out: _WorkedOut
        ) -> tuple[visit.Snapshot, bool]:
            row.seen_at = datetime.now(UTC)
            questions = queries.record(db, row, at, given)
            if questions is None:
                return visit.snapshot(db, row, at, queries.shown(db, row, at)), False
            if self._is_enough(at.task, questions, worked_out):
                training.enqueue(db, row, at.task, questions)
                at = flow.go_on(row, at)
            return visit.snapshot(db, row, at, questions), True

        seen, is_new = self._transact(participant_id, act)
        return visit.session_of(seen), is_new

    def _take(
        self,
        participant_id: str,
        leave: Callable[[Session, ParticipantRow, flow.Here], flow.Here | None],
    ) -> SessionOut:
        """Leave a step; the questions of the one after it are there from then on."""

        def act(
            db: Session, row: ParticipantRow, at: flow.Here, worked_out: _WorkedOut
        ) -> visit.Snapshot:
            at = leave(db, row, at) or at
            questions = queries.shown(db, row, at)
            if at.step.kind == "queries" and not questions:
                questions = self._draw(db, row, at.task, worked_out)
            return visit.snapshot(db, row, at, questions)

        return visit.session_of(self._transact(participant_id, act))

    def _transact(
        self,
        participant_id: str,
        act: Callable[[Session, ParticipantRow, flow.Here, _WorkedOut], T],
    ) -> T:
        """Act in one transaction, with all that it wants worked out before it."""
        worked_out = _WorkedOut()
        while True:
            try:
                with self.database.write() as db:
                    row = db.get_one(ParticipantRow, participant_id)
                    return act(db, row, flow.here(db, row), worked_out)
            except _Wanted as wanted:
                # One at a time: moving arms and whoever holds the lock need the interpreter, too.
                with self._working:
                    worked_out.add(wanted)

    def _draw(
        self, db: Session, row: ParticipantRow, task: TaskProtocol, worked_out: _WorkedOut
    ) -> list[Question]:
        draw = partial(
            queries.draw, row.id, row.seed, task, self.controllers[task.task], self.kinematics
        )
        drawn = worked_out.get((row.id, row.seed, task), draw)
        db.add_all(drawn)
        db.flush()
        return queries.on_screen(drawn, {}, task)

    def _is_enough(
        self, task: TaskProtocol, questions: list[Question], worked_out: _WorkedOut
    ) -> bool:
        given = queries.labels_of(questions)
        is_complete = queries.is_complete(questions)
        if is_complete or task.questions == "random" or len(given) < queries.LABELS_NEEDED:
            return is_complete
        judge = partial(self._judge, task, queries.as_labels(given))
        answers = tuple((query.id, answer.h_x, answer.h_y) for query, answer in given)
        return worked_out.get((task, answers), judge)

    def _judge(self, task: TaskProtocol, labels: Labels) -> bool:
        return queries.is_enough(task, labels, self.kinematics, self.survey(task.task))
