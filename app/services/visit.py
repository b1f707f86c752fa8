"""What a participant's page is told of where they are: all it needs for that step, and no more.

In a study nothing of this names a strategy: ways of steering are counted, and the order in which
they come is the server's to know.
"""

from dataclasses import asdict, dataclass
from typing import Literal

from sqlalchemy.orm import Session

from app import texts
from app.schemas.participants import (
    BlockOut,
    ConsentOut,
    EndOut,
    GivenOut,
    QueryOut,
    QuestionsOut,
    SessionOut,
    StickSettingsOut,
    StrategyOut,
    WayOut,
)
from app.schemas.props import PropsOut
from app.services import consent, drives, flow, plan, queries, questionnaires, stick
from app.storage.tables import ParticipantRow
from models.tasks import get_task

_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
_FREE_WAY = {
    "consent": "Welcome",
    "practice": "Practise",
    "queries": "Show",
    "training": "Learn",
    "driving": "Drive",
}


@dataclass(frozen=True)
class Snapshot:
    """What a transaction saw of somebody: all that their page is made of.

    Attributes:
        participant: They.
        at: Where they are.
        questions: What their page shows of a task's questions.
        drives_made: How many attempts of a block count.
        open_drive: The drive of a block that goes on, if one does.
    """

    participant: ParticipantRow
    at: flow.Here
    questions: list[queries.Question]
    drives_made: int
    open_drive: str | None


def snapshot(
    db: Session, participant: ParticipantRow, at: flow.Here, questions: list[queries.Question]
) -> Snapshot:
    """Where a participant is, with the questions that are on their screen there."""
    if at.step.kind != "block":
        return Snapshot(participant, at, questions, 0, None)
    made, still_open = drives.made(db, participant, at), drives.still_open(db, participant)
    return Snapshot(participant, at, questions, made, still_open)


def session_of(seen: Snapshot) -> SessionOut:
    """Where the participant is, as their page is told it."""
    participant, at, questions = seen.participant, seen.at, seen.questions
    step, protocol = at.step, at.protocol
    is_asking = step.kind == "queries"
    return SessionOut(
        study=protocol.title,
        state="active" if participant.state == "abandoned" else participant.state,  # type: ignore[arg-type]
        step=step.kind,
        key=step.key,
        place=at.place,
        task=None if step.task is None else texts.title_of(step.task),
        task_name=step.task,
        props=None if step.task is None else PropsOut.model_validate(get_task(step.task).props),
        way=_way(at),
        may_withdraw=participant.state == "active" and step.kind not in ("consent", "end"),
        block=_block(seen) if step.kind == "block" else None,
        questions=_questions(at) if step.kind == "questions" else None,
        end=_end(participant, at) if step.kind == "end" else None,
        consent=ConsentOut(
            version=consent.version_of(protocol),
            title=protocol.title,
            html=consent.html_of(protocol),
        ),
        practice_s=protocol.practice_s,
        queries=[_query(question) for question in questions],
        labels_wanted=at.task.labels,
        may_end_early=at.task.questions == "designed",
        field_says=texts.of_task(at.task.task).learned_field,
        strategies=[
            StrategyOut(**asdict(choice))
            for choice in drives.STRATEGIES
            if protocol.is_free and choice.name in at.order
        ],
        may_switch_arrows=protocol.arrows == "switch",
        notice=queries.notice(questions) if is_asking else None,
        stick=StickSettingsOut(**asdict(stick.settings_of(participant))),
    )


def title_of(step: plan.Step) -> str:
    """A step in words, for experimenters."""
    words = {
        "consent": "Welcome",
        "practice": "Practise",
        "queries": "show",
        "training": "learn",
        "block": "drive",
        "driving": "drive",
        "questions": f"questionnaire {step.questionnaire}",
        "end": "Done",
    }[step.kind]
    task = "" if step.task is None else f"{texts.title_of(step.task)}: "
    way = "" if step.position is None else f", way {step.position}"
    return f"{task}{words}{way}"


def _way(at: flow.Here) -> list[WayOut]:
    """The stages at the top of the page, one for several steps that belong together."""
    stages = [_stage(at, step) for step in at.steps]
    titles = list(dict.fromkeys(stages))
    here = titles.index(stages[at.place])
    return [
        WayOut(title=title, is_here=index == here, is_done=index < here)
        for index, title in enumerate(titles)
    ]


def _stage(at: flow.Here, step: plan.Step) -> str:
    if at.protocol.is_free:
        return _FREE_WAY.get(step.kind, "Done")
    if step.task is not None:
        return texts.title_of(step.task)
    return {"consent": "Welcome", "practice": "Practise", "questions": "Questions"}.get(
        step.kind, "Done"
    )


def _query(question: queries.Question) -> QueryOut:
    answer = question.answer
    given = None
    if answer is not None:
        h = None if answer.h_x is None or answer.h_y is None else (answer.h_x, answer.h_y)
        given = GivenOut(id=answer.id, h=h)
    return QueryOut(id=question.query.id, position=question.query.position, answer=given)


def _block(seen: Snapshot) -> BlockOut:
    at, made = seen.at, seen.drives_made
    return BlockOut(
        position=at.step.position or 1,
        of=len(at.order),
        drives_wanted=at.protocol.drives,
        drives_made=min(made, at.protocol.drives),
        may_continue=made >= at.protocol.drives,
        open_drive=seen.open_drive,
    )


def _questions(at: flow.Here) -> QuestionsOut:
    step = at.step
    questionnaire = questionnaires.find(at.protocol, step.questionnaire or "")
    assert questionnaire is not None, "a protocol's questionnaires are checked when it is kept"
    about = None if step.task is None else texts.title_of(step.task)
    if step.position is not None:
        about = f"{about}: the {_ORDINALS[(step.position - 1) % len(_ORDINALS)]} way of steering"
    return QuestionsOut(questionnaire=questionnaire, about=about, ways=len(at.order))


def _end(participant: ParticipantRow, at: flow.Here) -> EndOut:
    if participant.state == "withdrawn":
        thanks = "You have stopped taking part. Thank you!"
        left: Literal["kept", "erased"] = "kept" if participant.erased_at is None else "erased"
        return EndOut(message=thanks, code=None, url=None, left=left)
    done = at.protocol.completion
    url = None if done.url is None else done.url.replace("{code}", done.code or "")
    return EndOut(message=done.message, code=done.code, url=url, left=None)
