"""One participant over the API, and who is live: everything an experimenter sees and does."""

from fastapi import APIRouter, Depends
from fastapi.concurrency import run_in_threadpool
from sqlalchemy.orm import Session

from app.routers.dependencies import Assistant, Here, Owner, Service, Viewer, same_origin
from app.schemas.experimenter import (
    LinkOut,
    LiveOut,
    LivesOut,
    NoteIn,
    ParticipantOut,
    ReasonIn,
    RetrainIn,
)
from app.schemas.participants import WithdrawIn
from app.services import audit, enrolment, flow, notes, overview, training, withdrawal
from app.services.accounts import Experimenter
from app.services.studies import step_out
from app.storage.tables import ParticipantRow

router = APIRouter(prefix="/api/v1", dependencies=[Depends(same_origin)], tags=["participants"])


@router.get("/live")
def read_live(me: Viewer, here: Here) -> LivesOut:
    """Every arm that somebody has in front of them now."""
    del me
    sessions = []
    with here.database.read() as db:
        for session in here.live.all():
            row = enrolment.by_id(db, session.participant_id)
            sessions.append(
                LiveOut(
                    participant_id=row.id,
                    label=enrolment.label_of(row),
                    study_id=row.study_id,
                    step=step_out(flow.here(db, row).step),
                    is_connected=session.pages > 0,
                    is_driven=session.is_driven,
                    drive_id=session.drive_id,
                )
            )
    return LivesOut(sessions=sessions)


@router.get("/participants/{participant_id}")
def read_participant(participant_id: str, me: Viewer, here: Here) -> ParticipantOut:
    """Everything of a participant but the drives."""
    del me
    with here.database.read() as db:
        row = enrolment.by_id(db, participant_id)
        return _whole(here, db, row)


@router.post("/participants/{participant_id}/exclude")
def exclude(participant_id: str, why: ReasonIn, me: Assistant, here: Here) -> ParticipantOut:
    """Leave somebody's data out of analyses, for a reason."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        enrolment.exclude(row, why.reason)
        audit.note(db, me.id, "participant.exclude", row.id)
        return _whole(here, db, row)


@router.post("/participants/{participant_id}/include")
def include(participant_id: str, me: Assistant, here: Here) -> ParticipantOut:
    """Take somebody's data in again."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        enrolment.exclude(row, None)
        audit.note(db, me.id, "participant.include", row.id)
        return _whole(here, db, row)


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
        enrolment.revoke(row)
        audit.note(db, me.id, "participant.revoke", row.id)
        return _whole(here, db, row)


@router.post("/participants/{participant_id}/notes", status_code=201)
def add_note(participant_id: str, note: NoteIn, me: Assistant, here: Here) -> ParticipantOut:
    """Note something of a participant; the same twice is one."""
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        notes.add(db, me.id, row, str(note.id), note.text)
        return _whole(here, db, row)


@router.post("/participants/{participant_id}/retrain")
async def retrain(
    participant_id: str, wanted: RetrainIn, me: Assistant, here: Here
) -> ParticipantOut:
    """Train on the answers to a task as they are; a training that failed is tried again."""
    found = await run_in_threadpool(_retrain, here, participant_id, wanted.task, me)
    here.supervisor.wake()
    return found


@router.post("/participants/{participant_id}/withdraw")
async def withdraw(
    participant_id: str, wanted: WithdrawIn, me: Owner, here: Here
) -> ParticipantOut:
    """Let somebody go who asked for it, and erase what they gave if they want that."""
    await run_in_threadpool(_withdraw, here, participant_id, str(wanted.id), me, wanted.erase)
    await here.live.follow_step(participant_id)
    if wanted.erase:
        await here.live.recorder.write_waiting()
        data_dir = here.settings.data_dir
        await run_in_threadpool(withdrawal.erase, here.database, data_dir, participant_id)
    return await run_in_threadpool(read_participant, participant_id, me, here)


def _whole(here: Service, db: Session, row: ParticipantRow) -> ParticipantOut:
    return overview.whole(db, row, here.live.connected(), here.settings.teleop_rate_hz)


def _retrain(here: Service, participant_id: str, task: str, me: Experimenter) -> ParticipantOut:
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        training.retrain(db, row, task)
        audit.note(db, me.id, "participant.retrain", row.id, task=task)
        return _whole(here, db, row)


def _withdraw(
    here: Service, participant_id: str, event_id: str, me: Experimenter, erase: bool
) -> None:
    with here.database.write() as db:
        row = enrolment.by_id(db, participant_id)
        withdrawal.withdraw(db, row, event_id)
        audit.note(db, me.id, "participant.withdraw", row.id, erase=erase)
