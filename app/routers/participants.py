"""A participant's steps over HTTP. Each request is one transaction, answered after its commit."""

import time
from dataclasses import asdict

from fastapi import APIRouter, Depends, Response
from fastapi.concurrency import run_in_threadpool

from app.errors import WrongStep
from app.routers.dependencies import CurrentParticipant, Here, Service, same_origin
from app.schemas.participants import (
    AnswerIn,
    ConsentIn,
    ConsentOut,
    DriveIn,
    DriveOut,
    GivenOut,
    QueryOut,
    SessionOut,
    StepDoneIn,
    StickSettingsIn,
    StickSettingsOut,
    StrategyOut,
    TrainingOut,
)
from app.services import accounts, flow, queries, training
from app.services import drives as drive_service
from app.services import stick as stick_service
from app.storage.tables import ParticipantRow
from models.tasks import get_task

router = APIRouter(prefix="/p/{token}/api", dependencies=[Depends(same_origin)])


@router.get("/session")
def read_session(participant: CurrentParticipant, here: Here) -> SessionOut:
    """Where the person is."""
    if participant.opened_at is None:
        with here.database.write() as db:
            accounts.note_opened(db.get_one(ParticipantRow, participant.id))
    return _session(here, participant.id)


@router.post("/consent")
def give_consent(consent: ConsentIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person agrees to take part."""
    if consent.version != flow.CONSENT.version:
        raise WrongStep("The text has changed meanwhile; please reload the page.")
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant.id)
        flow.advance(db, row, str(consent.id), "consent", {"version": consent.version})
    return _session(here, participant.id)


@router.post("/practice")
def finish_practice(done: StepDoneIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person has practised; their questions are drawn."""
    drawn = []
    if participant.step == "practice":
        drawn = queries.draw(
            participant,
            here.controllers[participant.task],
            here.kinematics,
            here.settings.unlabelled_states,
            here.settings.labels_wanted,
            here.settings.queries == "designed",
        )
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant.id)
        if flow.advance(db, row, str(done.id), "practice"):
            db.add_all(drawn)
    return _session(here, participant.id)


@router.post("/answers")
async def give_answer(
    answer: AnswerIn, participant: CurrentParticipant, here: Here, response: Response
) -> SessionOut:
    """The person shows the stick input they would give for a move; the last one starts training."""
    is_new = await run_in_threadpool(_record, here, participant.id, answer)
    response.status_code = 201 if is_new else 200
    here.supervisor.wake()
    return await run_in_threadpool(_session, here, participant.id)


@router.put("/stick")
async def set_stick(
    wanted: StickSettingsIn, participant: CurrentParticipant, here: Here
) -> SessionOut:
    """The person sets their stick; an arm that is live follows it from now on."""
    await run_in_threadpool(_set_stick, here, participant.id, wanted)
    await here.live.follow_settings(participant.id)
    return await run_in_threadpool(_session, here, participant.id)


@router.get("/training")
def read_training(participant: CurrentParticipant, here: Here) -> TrainingOut:
    """How far the training is."""
    with here.database.read() as db:
        return training.status(db, participant)


@router.post("/training/retry")
async def retry_training(participant: CurrentParticipant, here: Here) -> TrainingOut:
    """The person wants a failed training tried again."""
    await run_in_threadpool(_retry, here, participant.id)
    here.supervisor.wake()
    return await run_in_threadpool(read_training, participant, here)


@router.post("/driving")
def begin_driving(done: StepDoneIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person has seen what was learned and goes on to drive."""
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant.id)
        if row.step == "training" and not training.is_ready(db, row):
            raise WrongStep("It is too early for that: the robot is still learning.")
        flow.advance(db, row, str(done.id), "training")
    return _session(here, participant.id)


@router.post("/drives", status_code=201)
async def open_drive(drive: DriveIn, participant: CurrentParticipant, here: Here) -> DriveOut:
    """The person drives under a strategy from now on."""
    opened = await run_in_threadpool(_open_drive, here, participant.id, drive)
    await here.live.start_drive(participant, opened)
    return DriveOut(id=opened.id, strategy=opened.strategy)


def _record(here: Service, participant_id: str, answer: AnswerIn) -> bool:
    wanted = here.settings.labels_wanted
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant_id)
        is_new = queries.record(db, row, answer, wanted)
        if is_new and _has_said_enough(here, row, queries.asked(db, row, wanted)):
            training.enqueue(db, row, wanted)
            row.step = "training"
    return is_new


def _has_said_enough(
    here: Service, participant: ParticipantRow, questions: list[queries.Question]
) -> bool:
    if queries.is_complete(questions) or here.settings.queries == "random":
        return queries.is_complete(questions)
    return queries.is_enough(
        participant.task,
        questions,
        here.kinematics,
        here.surveys[participant.task],
        here.settings.enough_error,
    )


def _set_stick(here: Service, participant_id: str, wanted: StickSettingsIn) -> None:
    with here.database.write() as db:
        stick_service.change(db, db.get_one(ParticipantRow, participant_id), wanted)


def _retry(here: Service, participant_id: str) -> None:
    with here.database.write() as db:
        training.retry(db, db.get_one(ParticipantRow, participant_id))


def _open_drive(here: Service, participant_id: str, drive: DriveIn) -> drive_service.OpenedDrive:
    with here.database.write() as db:
        return drive_service.open_drive(
            db,
            db.get_one(ParticipantRow, participant_id),
            str(drive.id),
            drive.strategy,
            boot=here.boot,
            now_s=time.monotonic(),
        )


def _session(here: Service, participant_id: str) -> SessionOut:
    with here.database.read() as db:
        participant = db.get_one(ParticipantRow, participant_id)
        questions = queries.asked(db, participant, here.settings.labels_wanted)
        return SessionOut(
            step=participant.step,  # type: ignore[arg-type]
            consent=ConsentOut(
                version=flow.CONSENT.version,
                title=flow.CONSENT.title,
                paragraphs=list(flow.CONSENT.paragraphs),
            ),
            practice_s=here.settings.practice_s,
            queries=[_query_out(question) for question in questions],
            labels_wanted=here.settings.labels_wanted,
            may_end_early=here.settings.queries == "designed",
            field_says=get_task(participant.task).field_says,
            strategies=[
                StrategyOut(name=choice.name, title=choice.title, note=choice.note)
                for choice in drive_service.STRATEGIES
            ],
            may_switch_arrows=here.settings.arrows == "switch",
            notice=queries.notice(questions) if participant.step == "queries" else None,
            stick=StickSettingsOut(**asdict(stick_service.settings_of(participant))),
        )


def _query_out(question: queries.Question) -> QueryOut:
    answer = question.answer
    given = None
    if answer is not None:
        h = None if answer.h_x is None or answer.h_y is None else (answer.h_x, answer.h_y)
        given = GivenOut(id=answer.id, h=h)
    return QueryOut(id=question.query.id, position=question.query.position, answer=given)
