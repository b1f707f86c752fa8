"""One participant over the API: everything an experimenter sees and does."""

from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool

from app.routers.dependencies import Assistant, Here, Owner, Service, Viewer, same_origin
from app.routers.descriptions import KEPT, MISSING, REFUSED, name_of
from app.routers.etags import unless_known
from app.schemas.examples import ID
from app.schemas.experimenter import (
    LinkOut,
    NoteIn,
    ParticipantOut,
    ReasonIn,
    RetrainIn,
)
from app.schemas.participants import WithdrawIn
from app.services import audit, enrolment, measured, notes, overview, training, withdrawal
from app.services.accounts import Experimenter

router = APIRouter(
    prefix="/api/v1",
    dependencies=[Depends(same_origin)],
    tags=["participants"],
    generate_unique_id_function=name_of,
    responses=REFUSED | MISSING,
)


@router.get("/participants/{participant_id}", response_model=ParticipantOut)
def read_participant(participant_id: str, me: Viewer, here: Here, request: Request) -> Response:
    """Everything of a participant but the drives; unchanged, it is not sent again."""
    del me
    return unless_known(request, _read(here, participant_id))


@router.post("/participants/{participant_id}/exclude")
def exclude(participant_id: str, why: ReasonIn, me: Assistant, here: Here) -> ParticipantOut:
    """Leave somebody's data out of analyses, for a reason."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        if row.excluded != why.reason:
            enrolment.exclude(row, why.reason)
            audit.note(db, me.id, "participant.exclude", row.id)
    return _read(here, participant_id)


@router.post("/participants/{participant_id}/include")
def include(participant_id: str, me: Assistant, here: Here) -> ParticipantOut:
    """Take somebody's data in again."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        if row.excluded is not None:
            enrolment.exclude(row, None)
            audit.note(db, me.id, "participant.include", row.id)
    return _read(here, participant_id)


@router.post("/participants/{participant_id}/link", status_code=201)
def renew_link(participant_id: str, me: Assistant, here: Here) -> LinkOut:
    """A new link for somebody who lost theirs; the former ends."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        token = enrolment.new_link(row)
        audit.note(db, me.id, "participant.link", row.id)
    return LinkOut(link=f"{here.settings.base_url}/p/{token}")


@router.post("/participants/{participant_id}/revoke")
def revoke(participant_id: str, me: Assistant, here: Here) -> ParticipantOut:
    """End somebody's link."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        if row.token_hash is not None:
            enrolment.revoke(row)
            audit.note(db, me.id, "participant.revoke", row.id)
    return _read(here, participant_id)


@router.post("/participants/{participant_id}/notes", status_code=201, responses=KEPT)
def add_note(participant_id: str, note: NoteIn, me: Assistant, here: Here) -> ParticipantOut:
    """Note something of a participant; the same twice is one."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        notes.add(db, me.id, row, str(note.id), note.text)
    return _read(here, participant_id)


@router.post("/participants/{participant_id}/retrain", responses=KEPT)
async def retrain(
    participant_id: str, wanted: RetrainIn, me: Assistant, here: Here
) -> ParticipantOut:
    """Train on the answers to a task as they are; a training that failed is tried again.

    What was learned already is not learned again: the same answers would give the same.
    """
    found = await run_in_threadpool(_retrain, here, participant_id, wanted.task, me)
    here.supervisor.wake()
    return found


@router.post("/participants/{participant_id}/withdraw", responses=KEPT)
async def withdraw(
    participant_id: str,
    wanted: Annotated[WithdrawIn, Body(examples=[{"id": ID, "erase": True}])],
    me: Owner,
    here: Here,
) -> ParticipantOut:
    """Let somebody go who asked for it, and erase what they gave if they want that."""
    await run_in_threadpool(_withdraw, here, participant_id, str(wanted.id), me, wanted.erase)
    await here.live.follow_step(participant_id)
    if wanted.erase:
        await here.live.recorder.write_waiting()
        data_dir = here.settings.data_dir
        await run_in_threadpool(withdrawal.erase, here.database, data_dir, participant_id)
        measured.forget()
    return await run_in_threadpool(_read, here, participant_id)


def _read(here: Service, participant_id: str) -> ParticipantOut:
    with here.database.read() as db:
        row = enrolment.by_id(db, participant_id)
        return overview.whole(db, row, here.live.connected(), here.settings.teleop_rate_hz)


def _retrain(here: Service, participant_id: str, task: str, me: Experimenter) -> ParticipantOut:
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        training.retrain(db, row, task)
        audit.note(db, me.id, "participant.retrain", row.id, task=task)
    return _read(here, participant_id)


def _withdraw(
    here: Service, participant_id: str, event_id: str, me: Experimenter, erase: bool
) -> None:
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        was_gone = row.state == "withdrawn"
        withdrawal.withdraw(db, row, event_id)
        if erase or not was_gone:
            audit.note(db, me.id, "participant.withdraw", row.id, erase=erase)
