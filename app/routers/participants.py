"""A participant's steps over HTTP. Each request is one transaction, answered after its commit."""

from datetime import UTC, datetime

from fastapi import APIRouter, Depends, Response
from fastapi.concurrency import run_in_threadpool

from app.routers.dependencies import CurrentParticipant, Here, Service, same_origin
from app.schemas.participants import (
    AnswerIn,
    ConsentIn,
    DriveIn,
    DriveOut,
    QuestionnaireIn,
    SessionOut,
    StepDoneIn,
    StepKeyIn,
    StickSettingsIn,
    TrainingOut,
    WithdrawIn,
)
from app.services import drives as drive_service
from app.services import (
    enrolment,
    flow,
    training,
    withdrawal,
)
from app.services import stick as stick_service
from app.storage.tables import ParticipantRow

router = APIRouter(prefix="/p/{token}/api", dependencies=[Depends(same_origin)])

_STALE_S = 60.0  # how exactly it is noted when somebody was last there


@router.get("/session")
def read_session(participant: CurrentParticipant, here: Here) -> SessionOut:
    """Where the person is."""
    now = datetime.now(UTC)
    is_stale = participant.seen_at is None or (now - participant.seen_at).total_seconds() > _STALE_S
    if participant.opened_at is None or is_stale or participant.state == "abandoned":
        with here.database.write() as db:
            row = db.get_one(ParticipantRow, participant.id)
            enrolment.note_seen(row, now)
            if row.state == "abandoned":
                enrolment.come_back(db, row)
    return here.steps.session(participant.id)


@router.post("/consent")
def give_consent(consent: ConsentIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person agrees to take part."""
    return here.steps.agree(participant.id, consent)


@router.post("/practice")
def finish_practice(done: StepDoneIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person has practised; their questions are drawn."""
    return here.steps.go_on(participant.id, str(done.id), "practice")


@router.post("/answers")
async def give_answer(
    answer: AnswerIn, participant: CurrentParticipant, here: Here, response: Response
) -> SessionOut:
    """The person shows the stick input they would give for a move; the last one starts training."""
    session, is_new = await run_in_threadpool(here.steps.answer, participant.id, answer)
    response.status_code = 201 if is_new else 200
    here.supervisor.wake()
    return session


@router.put("/stick")
async def set_stick(
    wanted: StickSettingsIn, participant: CurrentParticipant, here: Here
) -> SessionOut:
    """The person sets their stick; an arm that is live follows it from now on."""
    await run_in_threadpool(_set_stick, here, participant.id, wanted)
    await here.live.follow_settings(participant.id)
    return await run_in_threadpool(here.steps.session, participant.id)


@router.get("/training")
def read_training(participant: CurrentParticipant, here: Here) -> TrainingOut:
    """How far the training is."""
    with here.database.read() as db:
        row = db.get_one(ParticipantRow, participant.id)
        return training.status(db, row, flow.here(db, row))


@router.post("/training/retry")
async def retry_training(participant: CurrentParticipant, here: Here) -> TrainingOut:
    """The person wants a failed training tried again."""
    await run_in_threadpool(_retry, here, participant.id)
    here.supervisor.wake()
    return await run_in_threadpool(read_training, participant, here)


@router.post("/driving")
async def begin_driving(
    done: StepDoneIn, participant: CurrentParticipant, here: Here
) -> SessionOut:
    """The robot has learned, and the person goes on to drive."""
    return await run_in_threadpool(here.steps.go_on, participant.id, str(done.id), "training")


@router.post("/block")
async def finish_block(done: StepKeyIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person has driven under one way of steering and goes on."""
    session = await run_in_threadpool(
        here.steps.go_on, participant.id, str(done.id), "block", done.key
    )
    here.live.stop_drive(participant.id)
    await here.live.follow_step(participant.id)
    return session


@router.post("/questions")
async def answer_questions(
    given: QuestionnaireIn, participant: CurrentParticipant, here: Here
) -> SessionOut:
    """The person has filled in a questionnaire; the same one twice is kept once."""
    session = await run_in_threadpool(here.steps.fill_in, participant.id, given)
    await here.live.follow_step(participant.id)
    return session


@router.post("/withdraw")
async def withdraw(wanted: WithdrawIn, participant: CurrentParticipant, here: Here) -> SessionOut:
    """The person stops taking part, and may have what they gave erased."""
    await run_in_threadpool(_withdraw, here, participant.id, wanted)
    await here.live.follow_step(participant.id)
    if wanted.erase:
        # What the arm's last ticks left on their way to the database goes too.
        await here.live.recorder.write_waiting()
        await run_in_threadpool(
            withdrawal.erase, here.database, here.settings.data_dir, participant.id
        )
    return await run_in_threadpool(here.steps.session, participant.id)


@router.post("/drives", status_code=201)
async def open_drive(drive: DriveIn, participant: CurrentParticipant, here: Here) -> DriveOut:
    """The person drives from now on."""
    opened = await run_in_threadpool(_open_drive, here, participant.id, drive)
    await here.live.start_drive(participant, opened)
    return DriveOut(id=opened.id, strategy=None if opened.is_blinded else opened.strategy)


def _set_stick(here: Service, participant_id: str, wanted: StickSettingsIn) -> None:
    with here.database.write() as db:
        stick_service.change(db, db.get_one(ParticipantRow, participant_id), wanted)


def _retry(here: Service, participant_id: str) -> None:
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant_id)
        training.retry(db, row, flow.here(db, row).task.task)


def _withdraw(here: Service, participant_id: str, wanted: WithdrawIn) -> None:
    with here.database.write() as db:
        row = db.get_one(ParticipantRow, participant_id)
        withdrawal.withdraw(db, row, str(wanted.id))


def _open_drive(here: Service, participant_id: str, drive: DriveIn) -> drive_service.OpenedDrive:
    with here.database.write() as db:
        return drive_service.open_drive(
            db,
            db.get_one(ParticipantRow, participant_id),
            str(drive.id),
            drive.strategy,
            boot=here.boot,
            now_s=here.live.now_s(),
            same_strategy=here.settings.same_strategy,
        )
