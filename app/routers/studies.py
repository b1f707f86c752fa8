"""Studies over the API: what the dashboard does, any program can do."""

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Request, Response

from app.routers.dependencies import Assistant, Here, Service, Viewer, same_origin
from app.routers.descriptions import CHANGED, KEPT, MISSING, REFUSED, name_of
from app.routers.etags import unless_known
from app.schemas.choices import ChoicesOut
from app.schemas.experimenter import (
    LARGEST,
    CheckedOut,
    LinkOut,
    NewParticipantOut,
    NewParticipantsIn,
    NewParticipantsOut,
    NewStudyIn,
    ParticipantsOut,
    ProtocolIn,
    State,
    StudiesOut,
    StudyOut,
    StudyStateIn,
)
from app.services import choices, enrolment, overview, studies

router = APIRouter(
    prefix="/api/v1",
    dependencies=[Depends(same_origin)],
    tags=["studies"],
    generate_unique_id_function=name_of,
    responses=REFUSED,
)


@router.get("/studies", response_model=StudiesOut)
def read_studies(me: Viewer, here: Here, request: Request) -> Response:
    """All studies; the first is the one for trying Joymap out."""
    del me
    with here.database.read() as db:
        return unless_known(request, StudiesOut(studies=studies.lines(db)))


@router.get("/choices", response_model=ChoicesOut)
def read_choices(me: Viewer, request: Request) -> Response:
    """What a protocol can be made of, and one to begin with; unchanged, it is not sent again."""
    del me
    return unless_known(request, choices.choices())


@router.post("/protocols/check")
def check_protocol(content: ProtocolIn, me: Viewer) -> CheckedOut:
    """Whether a protocol can be run, how it reads as YAML, and its steps; nothing is kept."""
    del me
    return studies.check(content)


@router.post("/studies", status_code=201, responses=KEPT)
def make_study(new: NewStudyIn, me: Assistant, here: Here) -> StudyOut:
    """Make a study from YAML or data; the same twice is one."""
    protocol = studies.read(new)
    with here.database.write() as db:
        studies.create(db, me, str(new.id), protocol)
    return _whole(here, str(new.id))


@router.get("/studies/{study_id}", responses=MISSING)
def read_study(study_id: str, me: Viewer, here: Here, response: Response) -> StudyOut:
    """A study; its ETag is for changing the protocol that was seen, and no other."""
    del me
    with here.database.read() as db:
        study = studies.find(db, study_id)
        response.headers["ETag"] = f'"{studies.tag_of(db, study)}"'
        return studies.whole(db, study)


@router.put("/studies/{study_id}/protocol", responses=MISSING | KEPT | CHANGED)
def change_protocol(
    study_id: str,
    content: ProtocolIn,
    me: Assistant,
    here: Here,
    response: Response,
    if_match: Annotated[str | None, Header(max_length=100)] = None,
) -> StudyOut:
    """Another protocol: a new version, if somebody has enrolled under this one."""
    protocol = studies.read(content)
    with here.database.write() as db:
        studies.change(db, me, study_id, protocol, if_match)
    return read_study(study_id, me, here, response)


@router.post("/studies/{study_id}/state", responses=MISSING)
def change_state(study_id: str, wanted: StudyStateIn, me: Assistant, here: Here) -> StudyOut:
    """Let people in, or nobody any more; who is in goes on."""
    with here.database.write() as db:
        studies.set_state(db, me, study_id, wanted.state)
    return _whole(here, study_id)


@router.post("/studies/{study_id}/link", status_code=201, responses=MISSING)
def make_link(study_id: str, me: Assistant, here: Here) -> LinkOut:
    """A new shared link; the former ends."""
    with here.database.write() as db:
        token = studies.new_link(db, me, study_id)
    return LinkOut(link=f"{here.settings.base_url}/join/{token}")


@router.delete("/studies/{study_id}/link", status_code=204, responses=MISSING)
def end_link(study_id: str, me: Assistant, here: Here) -> None:
    """End the shared link."""
    with here.database.write() as db:
        studies.end_link(db, me, study_id)


@router.get("/studies/{study_id}/participants", response_model=ParticipantsOut, responses=MISSING)
def read_participants(
    study_id: str,
    me: Viewer,
    here: Here,
    request: Request,
    state: State | None = None,
    q: Annotated[str | None, Query(max_length=80)] = None,
    after: Annotated[int, Query(ge=0, le=LARGEST)] = 0,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> Response:
    """A page of participants, in order of their numbers; unchanged, it is not sent again."""
    del me
    with here.database.read() as db:
        studies.find(db, study_id)
        found = overview.page(
            db,
            study_id,
            state=state,
            search=q,
            after=after,
            limit=limit,
            connected=here.live.connected(),
            ticks_per_s=here.settings.teleop_rate_hz,
        )
    return unless_known(request, found)


@router.post("/studies/{study_id}/participants", status_code=201, responses=MISSING | KEPT)
def add_participants(
    study_id: str, new: NewParticipantsIn, me: Assistant, here: Here
) -> NewParticipantsOut:
    """Links for more participants, shown this once."""
    ids = enrolment.ids_from(str(new.id), new.count)
    with here.database.write() as db:
        made = studies.add_participants(db, me, study_id, ids, new.external_id)
    base = here.settings.base_url
    return NewParticipantsOut(
        participants=[
            NewParticipantOut(id=row.id, label=enrolment.label_of(row), link=f"{base}/p/{token}")
            for row, token in made
        ]
    )


def _whole(here: Service, study_id: str) -> StudyOut:
    with here.database.read() as db:
        return studies.whole(db, studies.find(db, study_id))
