"""The dashboard's API: who takes part, and links for more."""

from fastapi import APIRouter, Depends

from app.routers.dependencies import ExperimenterOnly, Here, same_origin
from app.schemas.experimenter import NewParticipantIn, NewParticipantOut, ParticipantsOut
from app.services import accounts, overview

router = APIRouter(prefix="/api", dependencies=[ExperimenterOnly, Depends(same_origin)])


@router.get("/participants")
def read_participants(here: Here) -> ParticipantsOut:
    """Everyone, in order of their numbers."""
    with here.database.read() as db:
        lines = overview.everyone(db, here.settings.teleop_rate_hz)
    return ParticipantsOut(participants=lines)


@router.post("/participants", status_code=201)
def add_participant(new: NewParticipantIn, here: Here) -> NewParticipantOut:
    """A link for one more participant, shown this once."""
    token = accounts.new_token()
    with here.database.write() as db:
        label = accounts.add_participant(
            db, str(new.id), accounts.EXPERIMENTER, here.settings.task, token
        )
    return NewParticipantOut(
        id=str(new.id), label=label, link=f"{here.settings.base_url}/p/{token}"
    )
