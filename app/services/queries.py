"""The questions of a participant: drawing them, and keeping what was answered.

All moves a person may be asked about are drawn when the questions begin (the paper's Steps 1-5),
more than are wanted: each "I can't say" brings one more of them to the screen.
"""

import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from sqlalchemy.orm import Session

from app.errors import IdReused, UnknownQuery, WrongStep
from app.schemas.participants import AnswerIn
from app.schemas.protocol import TaskProtocol
from app.services import flow
from app.storage import participants
from app.storage.tables import AnswerRow, ParticipantRow, QueryRow
from models.controller import LatentController
from models.designed_queries import design_queries, designable
from models.fitting import Labels
from models.kinematics import Kinematics
from models.queries import (
    SHOWN_STEPS,
    QueryPool,
    choose_queries,
    make_query,
    sample_pool,
    showable,
)
from models.task_space import Survey, survey, understand_labels
from models.tasks import get_task

# At most this many questions for each label wanted.
SPARE_FACTOR = 2
# With fewer labels than this a mirrored idea of the stick may be taken for a turned one.
LABELS_NEEDED = 5
# The smallest change of the hand in one step that is asked about, in [m]: moves long enough for
# people to tell the direction of, and for those who always push the stick to its end.
SMALLEST_MOVE_M = 0.012
# Streams of a participant's randomness: the same seed, never the same numbers.
_POOL, _CHOICE = 1, 2
_SURVEY_SEED, _SURVEYED = 0, 1000


@dataclass(frozen=True)
class Question:
    """A move put to the person, and the answer that counts so far."""

    query: QueryRow
    answer: AnswerRow | None


def asked(db: Session, participant: ParticipantRow, task: TaskProtocol) -> list[Question]:
    """The questions on the person's screen, read anew."""
    drawn = participants.queries_of(db, participant.id, task.task)
    return on_screen(drawn, participants.latest_answers(db, participant.id), task)


def shown(db: Session, participant: ParticipantRow, at: flow.Here) -> list[Question]:
    """The questions that the page of a step shows: none on most."""
    is_shown = at.step.kind in ("queries", "training", "driving")
    return asked(db, participant, at.task) if is_shown else []


def on_screen(
    drawn: list[QueryRow], answers: Mapping[str, AnswerRow], task: TaskProtocol
) -> list[Question]:
    """The questions on the person's screen: as many as leave ``task.labels`` they can answer.

    One answered with the stick stays, whatever is changed before it. Those asked once more come
    when all others are answered.

    Args:
        drawn: All moves that may be asked about, in order.
        answers: The answers that count, by their queries' ids.
        task: What is done with the task.
    """
    questions: list[Question] = []
    cannot_say = 0
    for query in (query for query in drawn if query.repeats is None):
        answer = answers.get(query.id)
        is_label = answer is not None and answer.h_x is not None
        if len(questions) - cannot_say >= task.labels and not is_label:
            continue
        questions.append(Question(query, answer))
        cannot_say += answer is not None and not is_label
    if is_complete(questions):
        labelled = {query.id for query, _ in labels_of(questions)}
        again = [query for query in drawn if query.repeats in labelled]
        questions += [Question(query, answers.get(query.id)) for query in again]
    return questions


def labels_of(questions: list[Question]) -> list[tuple[QueryRow, AnswerRow]]:
    """The questions that got a stick input; what was asked once more only tells how sure it is."""
    return [
        (question.query, question.answer)
        for question in questions
        if question.query.repeats is None
        and question.answer is not None
        and question.answer.h_x is not None
    ]


def is_complete(questions: list[Question]) -> bool:
    """Whether nothing is left to ask and there is enough to learn from."""
    return (
        all(question.answer is not None for question in questions)
        and len(labels_of(questions)) >= LABELS_NEEDED
    )


def is_enough(task: TaskProtocol, labels: Labels, kinematics: Kinematics, seen: Survey) -> bool:
    """Whether the labels so far say so much that no more need to be asked for."""
    _, error = understand_labels(get_task(task.task), kinematics, labels, seen)
    return error <= task.enough_error


def notice(questions: list[Question]) -> str | None:
    """A sentence for someone who answered everything, but too little of it with the stick."""
    answered = all(question.answer is not None for question in questions)
    if not questions or not answered or is_complete(questions):
        return None
    return (
        f"The robot needs the stick input for at least {LABELS_NEEDED} moves to learn from; "
        "please go back to some of them and show what you would try."
    )


def draw(
    participant_id: str,
    seed: int,
    wanted: TaskProtocol,
    controller: LatentController,
    kinematics: Kinematics,
) -> list[QueryRow]:
    """Draw the moves of a task a participant may be asked about, in order (the paper's Steps 1-5).

    The same participant always gets the same moves: all chance comes from their seed.
    """
    task = get_task(wanted.task)
    pool = draw_pool(wanted.task, seed, controller, kinematics, wanted.unlabelled)
    allowed = showable(pool, SMALLEST_MOVE_M)
    count = SPARE_FACTOR * wanted.labels  # fewer spare ones where the pool has no more
    rng = np.random.default_rng([seed, _CHOICE])
    if wanted.questions == "designed":
        count = min(count, len(designable(task, kinematics, pool, allowed)))
        chosen = design_queries(task, kinematics, pool, count, rng, allowed)
    else:
        chosen = choose_queries(pool, min(count, len(allowed)), rng, SMALLEST_MOVE_M)
    rows = []
    for position, index in enumerate(chosen, start=1):
        move = make_query(controller, pool.states[index], pool.latents[index], SHOWN_STEPS)
        rows.append(
            QueryRow(
                id=str(uuid.uuid4()),
                participant_id=participant_id,
                task=wanted.task,
                repeats=None,
                position=position,
                pool_index=int(index),
                controller_hash=controller.content_hash,
                s=move.s.tolist(),
                z=move.z.tolist(),
                next_s=move.next_s.tolist(),
                path=move.path.tolist(),
                hand_path=kinematics.hand_pose(move.path).position.tolist(),
            )
        )
    again = rng.permutation(wanted.labels)[: wanted.repeats]
    return rows + [_once_more(rows[index], len(rows) + 1 + k) for k, index in enumerate(again)]


def _once_more(query: QueryRow, position: int) -> QueryRow:
    same = ("participant_id", "task", "pool_index", "controller_hash", "s", "z", "next_s")
    return QueryRow(
        id=str(uuid.uuid4()),
        repeats=query.id,
        position=position,
        path=query.path,
        hand_path=query.hand_path,
        **{name: getattr(query, name) for name in same},
    )


def draw_pool(
    task: str,
    seed: int,
    controller: LatentController,
    kinematics: Kinematics,
    unlabelled: int,
) -> QueryPool:
    """A participant's unlabelled samples (Steps 1-4): what the priors are enforced on."""
    return sample_pool(
        get_task(task), controller, kinematics, unlabelled, np.random.default_rng([seed, _POOL])
    )


def survey_task(task: str, controller: LatentController, kinematics: Kinematics) -> Survey:
    """How far and where a task's arm moves, for everybody alike."""
    pool = draw_pool(task, _SURVEY_SEED, controller, kinematics, _SURVEYED)
    return survey(get_task(task), kinematics, pool)


def as_labels(given: list[tuple[QueryRow, AnswerRow]]) -> Labels:
    """Answers as the learning core takes them."""
    return Labels(
        np.array([query.s for query, _ in given], dtype=float),
        np.array([[answer.h_x, answer.h_y] for _, answer in given], dtype=float),
        np.array([query.next_s for query, _ in given], dtype=float),
    )


def find(db: Session, participant_id: str, query_id: str) -> QueryRow:
    """A participant's own query.

    Raises:
        UnknownQuery: If it is not theirs.
    """
    query = db.get(QueryRow, query_id)
    if query is None or query.participant_id != participant_id:
        raise UnknownQuery
    return query


def record(
    db: Session, participant: ParticipantRow, at: flow.Here, answer: AnswerIn
) -> list[Question] | None:
    """Keep an answer; sending it again changes nothing.

    Returns:
        The questions on the person's screen now; None if the answer was kept before.

    Raises:
        IdReused: If the id was used for another answer.
        UnknownQuery: If the query is not one that this participant was asked.
        WrongStep: If the questions have not begun, or the training has.
    """
    h_x, h_y = answer.h if answer.h is not None else (None, None)
    before = participants.answer_by_id(db, str(answer.id))
    if before is not None:
        same = (before.participant_id, before.query_id, before.h_x, before.h_y) == (
            participant.id,
            str(answer.query_id),
            h_x,
            h_y,
        )
        if not same:
            raise IdReused
        return None
    query = find(db, participant.id, str(answer.query_id))
    if at.step.key != f"queries/{query.task}":
        raise WrongStep("The robot has learned from your answers already; they stay as they are.")
    drawn = participants.queries_of(db, participant.id, query.task)
    answers = participants.latest_answers(db, participant.id)
    if query.id not in {q.query.id for q in on_screen(drawn, answers, at.task)}:
        raise UnknownQuery
    kept = AnswerRow(
        id=str(answer.id),
        participant_id=participant.id,
        query_id=query.id,
        h_x=h_x,
        h_y=h_y,
        thinking_time_s=answer.thinking_time_s,
        answered_at=datetime.now(UTC),
    )
    db.add(kept)
    db.flush()
    return on_screen(drawn, answers | {query.id: kept}, at.task)


def as_path(query: QueryRow) -> np.ndarray:
    """The move as shown: joint positions ``(m, 7)`` in [rad]."""
    return np.asarray(query.path, dtype=float)
