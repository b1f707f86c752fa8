"""The shared link of a study: whoever opens it can take part, and gets a link of their own."""

from fastapi import APIRouter, Depends
from fastapi.responses import HTMLResponse

from app.routers.dependencies import Here, same_origin
from app.routers.pages import page
from app.schemas.participants import JoinIn, JoinOut, JoinPageOut
from app.services import enrolment

router = APIRouter(prefix="/join/{token}")


@router.get("")
def read_join_page(token: str, here: Here) -> HTMLResponse:
    """The page with the button; looking at it enrols nobody."""
    with here.database.read() as db:
        enrolment.study_of(db, token)
    return HTMLResponse(page("join.html"))


@router.get("/study")
def read_study(token: str, here: Here) -> JoinPageOut:
    """What the page says of the study."""
    with here.database.read() as db:
        study = enrolment.study_of(db, token)
        return JoinPageOut(title=study.title, is_open=study.state == "open")


@router.post("", dependencies=[Depends(same_origin)], status_code=201)
def join(token: str, who: JoinIn, here: Here) -> JoinOut:
    """Take part; the same person of a recruiting service gets the same place again."""
    own = enrolment.new_token()
    with here.database.write() as db:
        enrolment.join(db, token, own, who.external_id)
    return JoinOut(link=f"{here.settings.base_url}/p/{own}")
