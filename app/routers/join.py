"""The shared link of a study: whoever opens it can take part, and gets a link of their own."""

from datetime import timedelta
from urllib.parse import urlsplit

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import HTMLResponse

from app.routers.dependencies import Here, Service, same_origin
from app.routers.pages import page
from app.schemas.participants import JoinIn, JoinOut, JoinPageOut
from app.services import enrolment

router = APIRouter(prefix="/join/{token}")

BROWSER_COOKIE = "joymap_browser"
_COOKIE_LASTS = timedelta(days=180)


@router.get("")
def read_join_page(token: str, here: Here, request: Request) -> HTMLResponse:
    """The page with the button; looking at it enrols nobody."""
    with here.database.read() as db:
        enrolment.study_of(db, token)
    shown = HTMLResponse(page("join.html"))
    # Before anybody joins: if the answer to that is lost, they are known when they press again.
    _remember(here, token, _browser(request), request, shown)
    return shown


@router.get("/study")
def read_study(token: str, here: Here) -> JoinPageOut:
    """What the page says of the study."""
    with here.database.read() as db:
        study = enrolment.study_of(db, token)
        return JoinPageOut(title=study.title, is_open=enrolment.takes_in(db, study))


@router.post("", dependencies=[Depends(same_origin)], status_code=201)
def join(token: str, who: JoinIn, here: Here, request: Request, response: Response) -> JoinOut:
    """Take part; who comes back with a recruiting service's id, in the same browser, goes on."""
    own, browser = enrolment.new_token(), _browser(request)
    with here.database.write() as db:
        press = None if who.id is None else str(who.id)
        enrolment.join(db, token, own, who.external_id, browser, press)
    _remember(here, token, browser, request, response)
    return JoinOut(link=f"{here.settings.base_url}/p/{own}")


def _browser(request: Request) -> str:
    """What this browser is known by in this study."""
    return request.cookies.get(BROWSER_COOKIE) or enrolment.new_token()


def _remember(
    here: Service, token: str, browser: str, request: Request, response: Response
) -> None:
    """Let this browser be known for another while by the link of a study that there is."""
    response.set_cookie(
        BROWSER_COOKIE,
        browser,
        max_age=int(_COOKIE_LASTS.total_seconds()),
        path=f"{urlsplit(here.settings.base_url).path}/join/{token}",
        httponly=True,
        samesite="lax",
        secure=request.url.scheme == "https",
    )
