"""What an experimenter sees of participants: a page of lines, and one of them whole."""

import json
from collections import defaultdict
from datetime import datetime

import numpy as np
from sqlalchemy.orm import Session

from app.schemas.experimenter import (
    AnswerOut,
    ConsistencyOut,
    EventOut,
    NoteOut,
    ParticipantLineOut,
    ParticipantOut,
    ParticipantsOut,
    ResponseOut,
    TrainingLineOut,
)
from app.services import flow
from app.services.enrolment import label_of
from app.services.studies import step_out
from app.storage import drives, jobs, participants
from app.storage.tables import AnswerRow, ParticipantRow, QueryRow


def page(
    db: Session,
    study_id: str,
    *,
    state: str | None,
    search: str | None,
    after: int,
    limit: int,
    connected: set[str],
    ticks_per_s: float,
) -> ParticipantsOut:
    """Some of a study's participants, in order of their numbers, by a fixed number of statements.

    Args:
        db: The transaction.
        study_id: Whose.
        state: Only those in this state.
        search: Only those whose number or external id holds this.
        after: Only those with a higher number.
        limit: At most so many.
        connected: The ids of those who have a page open.
        ticks_per_s: Of the control loop.
    """
    rows, total = participants.page(db, study_id, state, search, after, limit + 1)
    shown = rows[:limit]
    lines = _lines(db, shown, connected, ticks_per_s)
    more = shown[-1].number if len(rows) > limit else None
    return ParticipantsOut(participants=lines, total=total, next=more)


def _lines(
    db: Session, rows: list[ParticipantRow], connected: set[str], ticks_per_s: float
) -> list[ParticipantLineOut]:
    ids = [row.id for row in rows]
    driven, answered = drives.counts(db, ids), participants.answer_counts(db, ids)
    trained = jobs.latest_states(db, ids)
    lines = []
    for row in rows:
        at = flow.here(db, row)
        count, ticks = driven.get(row.id, (0, 0))
        lines.append(
            ParticipantLineOut(
                id=row.id,
                label=label_of(row),
                study_id=row.study_id,
                version=at.version,
                external_id=row.external_id,
                created_at=_iso(row.created_at),
                seen_at=None if row.seen_at is None else _iso(row.seen_at),
                state=row.state,  # type: ignore[arg-type]
                excluded=row.excluded,
                step=step_out(at.step),
                place=at.place,
                of=len(at.steps) - 1,
                is_opened=row.opened_at is not None,
                is_connected=row.id in connected,
                answers=answered.get(row.id, 0),
                training=trained.get(row.id),  # type: ignore[arg-type]
                drives=count,
                driven_s=round(ticks / ticks_per_s, 1),
            )
        )
    return lines


def whole(
    db: Session, row: ParticipantRow, connected: set[str], ticks_per_s: float
) -> ParticipantOut:
    """Everything of a participant but the drives."""
    (line,) = _lines(db, [row], connected, ticks_per_s)
    queries = participants.all_queries_of(db, row.id)
    latest = participants.latest_answers(db, row.id)
    return ParticipantOut(
        **line.model_dump(),
        order=list(flow.here(db, row).order),
        answers_given=[_answer(queries[answer.query_id], answer) for answer in latest.values()],
        consistency=_consistency(list(queries.values()), latest),
        trainings=[
            TrainingLineOut(
                id=job.id,
                task=job.task,
                state=job.state,
                fraction=job.fraction,
                queued_at=_iso(job.queued_at),
                training_s=job.training_s,
                error=job.error,
                strategies=job.report,
            )
            for job in jobs.all_of(db, row.id)
        ],
        responses=[
            ResponseOut(
                step=response.step,
                questionnaire=response.questionnaire,
                item=response.item,
                value=None if response.value is None else json.loads(response.value),
                answered_at=_iso(response.answered_at),
            )
            for response in participants.responses_of(db, row.id)
        ],
        notes=[
            NoteOut(id=note.id, author=author, text=note.text, written_at=_iso(note.written_at))
            for note, author in participants.notes_of(db, row.id)
        ],
        events=[
            EventOut(kind=event.kind, at=_iso(event.at))
            for event in participants.events_of(db, row.id)
        ],
    )


def _answer(query: QueryRow, answer: AnswerRow) -> AnswerOut:
    h = None if answer.h_x is None or answer.h_y is None else (answer.h_x, answer.h_y)
    return AnswerOut(
        query_id=query.id,
        task=query.task,
        position=query.position,
        repeats=query.repeats,
        h=h,
        thinking_time_s=answer.thinking_time_s,
        answered_at=_iso(answer.answered_at),
        hand_path=query.hand_path,
    )


def _consistency(
    queries: list[QueryRow], answers: dict[str, AnswerRow]
) -> dict[str, ConsistencyOut]:
    """For each task, how far apart the two answers to a move are that was shown twice."""
    pairs: dict[str, list[tuple[complex, complex]]] = defaultdict(list)
    for query in queries:
        both = answers.get(query.repeats or ""), answers.get(query.id)
        h = [
            complex(answer.h_x, answer.h_y)
            for answer in both
            if answer is not None and answer.h_x is not None and answer.h_y is not None
        ]
        if len(h) == len(both):
            pairs[query.task].append((h[0], h[1]))
    found = {}
    for task, given in pairs.items():
        # A stick at rest points nowhere.
        turns = [abs(np.degrees(np.angle(one / two))) for one, two in given if one and two]
        found[task] = ConsistencyOut(
            pairs=len(given),
            mean_angle_deg=round(float(np.mean(turns)), 1) if turns else None,
            mean_length_difference=round(
                float(np.mean([abs(abs(one) - abs(two)) for one, two in given])), 3
            ),
        )
    return found


def _iso(moment: datetime) -> str:
    return moment.isoformat(timespec="seconds")
