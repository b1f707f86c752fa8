"""The pages themselves. What they show comes later, over the API."""

import html
from functools import cache

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from app.doors import refusal_headers
from app.errors import JoymapError, NotAllowed
from app.routers.dependencies import (
    CurrentParticipant,
    Here,
    Viewer,
    address_of,
    login_cookie,
    same_origin,
)
from app.schemas.accounts import CredentialsIn
from app.services import accounts, studies
from app.settings import STATIC_DIR

router = APIRouter()


@cache
def page(name: str) -> str:
    """The text of a page in the folder of pages."""
    return (STATIC_DIR / name).read_text(encoding="utf-8")


def message_page(title: str, sentence: str, status_code: int) -> HTMLResponse:
    """A page that says one thing."""
    text = (
        page("message.html")
        .replace("{{title}}", html.escape(title))
        .replace("{{sentence}}", html.escape(sentence))
    )
    return HTMLResponse(text, status_code=status_code)


@router.get("/")
def read_root() -> HTMLResponse:
    """Someone without a link."""
    return message_page(
        "Joymap",
        "To take part, open the link you were given. "
        "To run a study, open the experimenter link that the server printed when it started.",
        200,
    )


@router.get("/health")
def read_health(here: Here) -> dict[str, str]:
    """For whoever watches the server: it answers and its database can be read."""
    here.database.ping()
    return {"status": "ok"}


@router.get("/p/{token}")
def read_participant_page(participant: CurrentParticipant) -> HTMLResponse:
    """A participant's page; the steps are chosen by the server, over the API."""
    del participant  # asking for it is the check
    return HTMLResponse(page("participant.html"))


@router.get("/setup/{token}")
def read_setup_page(token: str, here: Here) -> HTMLResponse:
    """The link that makes an account: looking at it uses nothing up."""
    with here.database.read() as db:
        accounts.check_setup_link(db, token)
    return HTMLResponse(page("setup.html"))


@router.post("/setup/{token}", dependencies=[Depends(same_origin)], status_code=204)
def use_setup_link(token: str, who: CredentialsIn, here: Here, request: Request) -> Response:
    """The form on it makes the account and logs this browser in, once."""
    here.doorkeeper.admit(f"enters {address_of(request)}")
    name = accounts.clean_name(who.name)
    with here.database.read() as db:
        accounts.check_setup_link(db, token)
    hashed = accounts.hashed(who.password)
    with here.database.write() as db:
        login = accounts.sign_up(db, token, name, hashed)
    response = Response(status_code=204)
    login_cookie(request, response, login)
    return response


@router.get("/login")
def read_login_page() -> HTMLResponse:
    """Where experimenters come in."""
    return HTMLResponse(page("login.html"))


@router.get("/dashboard")
def read_dashboard(me: Viewer) -> HTMLResponse:
    """The page of all studies."""
    del me  # asking for it is the check
    return HTMLResponse(page("dashboard.html"))


@router.get("/studies/{study_id}")
def read_study_page(study_id: str, me: Viewer, here: Here) -> HTMLResponse:
    """The page of a study."""
    del me
    with here.database.read() as db:
        studies.find(db, study_id)
    return HTMLResponse(page("study.html"))


@router.get("/account")
def read_account_page(me: Viewer) -> HTMLResponse:
    """The page of one's account; owners see everyone's."""
    del me
    return HTMLResponse(page("account.html"))


def refusal_page(request: Request, error: JoymapError) -> Response | None:
    """A page for a refused page; None where a program asked."""
    if "text/html" not in request.headers.get("accept", ""):
        return None
    if isinstance(error, NotAllowed) and request.method == "GET":
        return RedirectResponse("/login", status_code=303)
    refused = message_page("Sorry", error.sentence, error.status_code)
    refused.headers.update(refusal_headers(error))
    return refused
