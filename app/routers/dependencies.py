"""What routers are given: access is visible in their signatures."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Cookie, Depends
from fastapi.requests import HTTPConnection

from app.errors import ForeignOrigin
from app.jobs.supervisor import Supervisor
from app.services import accounts, enrolment
from app.settings import Settings
from app.storage.database import Database
from app.storage.tables import ParticipantRow
from app.teleop.live_sessions import LiveSessions
from app.teleop.replay import Replays
from models.controller import LatentController
from models.kinematics import Kinematics
from models.task_space import Survey

LOGIN_COOKIE = "joymap_login"


@dataclass(frozen=True)
class Service:
    """What lives as long as the server does."""

    settings: Settings
    database: Database
    live: LiveSessions
    replays: Replays
    supervisor: Supervisor
    controllers: dict[str, LatentController]
    kinematics: Kinematics
    survey: Callable[[str], Survey]  # of a task, made when it is first asked for
    boot: str  # names this start of the server; its monotonic times belong together


def _service(connection: HTTPConnection) -> Service:
    service: Service = connection.app.state.service
    return service


Here = Annotated[Service, Depends(_service)]


def _participant(token: str, here: Here) -> ParticipantRow:
    with here.database.read() as db:
        participant = enrolment.participant_of(db, token)
        db.expunge(participant)
        return participant


CurrentParticipant = Annotated[ParticipantRow, Depends(_participant)]


def _experimenter(
    here: Here, login: Annotated[str | None, Cookie(alias=LOGIN_COOKIE)] = None
) -> None:
    with here.database.read() as db:
        accounts.check_login(db, login)


ExperimenterOnly = Depends(_experimenter)


def same_origin(connection: HTTPConnection) -> None:
    """Refuse what another site's page sends; programs send no origin and hold the token.

    Raises:
        ForeignOrigin: If the browser says that the request comes from elsewhere.
    """
    origin = connection.headers.get("origin")
    if origin is None:
        return
    settings: Settings = connection.app.state.service.settings
    allowed = {connection.headers.get("host", "")}
    if settings.public_url is not None:
        allowed.add(settings.public_url.split("://", 1)[-1].rstrip("/"))
    if origin.split("://", 1)[-1] not in allowed:
        raise ForeignOrigin
