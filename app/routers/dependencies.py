"""What routers are given: access is visible in their signatures."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request, Response
from fastapi.requests import HTTPConnection

from app.errors import ForeignOrigin, UnknownLink
from app.jobs.figures import FigureDesk
from app.jobs.supervisor import Supervisor
from app.services import accounts, enrolment
from app.services.accounts import Experimenter, NotByKey, NotYours
from app.services.doorkeeping import REQUESTS, WRONG_LINKS, Doorkeeper
from app.services.steps import Steps
from app.settings import Settings
from app.storage.database import Database
from app.storage.tables import ParticipantRow
from app.teleop.live_sessions import LiveSessions
from app.teleop.replay import Replays

LOGIN_COOKIE = "joymap_login"
_SAFE = ("GET", "HEAD", "OPTIONS")
_OWN_SITE = ("same-origin", "none")


@dataclass(frozen=True)
class Service:
    """What lives as long as the server does."""

    settings: Settings
    database: Database
    live: LiveSessions
    replays: Replays
    supervisor: Supervisor
    figures: FigureDesk
    doorkeeper: Doorkeeper
    steps: Steps
    boot: str  # names this start of the server; its monotonic times belong together


def _service(connection: HTTPConnection) -> Service:
    service: Service = connection.app.state.service
    return service


Here = Annotated[Service, Depends(_service)]


def address_of(connection: HTTPConnection) -> str:
    """Where a request comes from."""
    return connection.client.host if connection.client is not None else "unknown"


def _participant(token: str, connection: HTTPConnection, here: Here) -> ParticipantRow:
    with here.database.read() as db:
        try:
            participant = enrolment.participant_of(db, token)
        except UnknownLink:  # a good link is never counted
            here.doorkeeper.admit(f"link {address_of(connection)}", WRONG_LINKS)
            raise
        db.expunge(participant)
        return participant


CurrentParticipant = Annotated[ParticipantRow, Depends(_participant)]


def _experimenter(connection: HTTPConnection, here: Here) -> Experimenter:
    kind, _, key = connection.headers.get("authorization", "").partition(" ")
    bearer = key.strip() if kind.lower() == "bearer" else None
    with here.database.read() as db:
        me = accounts.experimenter_of(db, connection.cookies.get(LOGIN_COOKIE), bearer)
    here.doorkeeper.admit(f"asks {me.asked_by}", REQUESTS)
    if me.key_id is not None:
        with here.database.write() as db:
            accounts.note_use(db, me.key_id)
    return me


def _at_least(role: accounts.Role) -> Callable[[Experimenter], Experimenter]:
    def check(me: Annotated[Experimenter, Depends(_experimenter)]) -> Experimenter:
        if not me.may(role):
            raise NotYours(role)
        return me

    return check


ViewerOnly = Depends(_at_least("viewer"))
Viewer = Annotated[Experimenter, Depends(_at_least("viewer"))]
Assistant = Annotated[Experimenter, Depends(_at_least("assistant"))]
Owner = Annotated[Experimenter, Depends(_at_least("owner"))]


def in_person(me: Viewer) -> None:
    """Refuse programs' keys: what makes or ends access is done by whoever knows the password.

    Raises:
        NotByKey: If a program asks.
    """
    if me.by_key:
        raise NotByKey


InPerson = Depends(in_person)


def login_cookie(request: Request, response: Response, token: str) -> None:
    """Let this browser be known by a login."""
    response.set_cookie(
        LOGIN_COOKIE,
        token,
        max_age=int(accounts.LOGIN_LASTS.total_seconds()),
        httponly=True,
        samesite="lax",
        secure=request.url.scheme == "https",
    )


def same_origin(connection: HTTPConnection) -> None:
    """Refuse what another site's page sends; programs send no origin and hold the token.

    Raises:
        ForeignOrigin: If the browser says that the request comes from elsewhere.
    """
    origin = connection.headers.get("origin")
    if origin is None:
        is_safe = connection.scope.get("method", "GET") in _SAFE
        if is_safe or connection.headers.get("sec-fetch-site", "none") in _OWN_SITE:
            return
        raise ForeignOrigin
    settings: Settings = connection.app.state.service.settings
    allowed = {connection.headers.get("host", "")}
    if settings.public_url is not None:
        allowed.add(settings.public_url.split("://", 1)[-1].rstrip("/"))
    if origin.split("://", 1)[-1] not in allowed:
        raise ForeignOrigin
