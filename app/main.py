"""Builds the app: what lives as long as the server, the doors, and what every answer carries."""

import asyncio
import contextlib
import gc
import logging
import time
import uuid
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from functools import cache
from typing import Any, cast

import torch
from fastapi import FastAPI, Request, Response, WebSocket
from fastapi.exceptions import RequestValidationError
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from app.doors import BodyLimit, Busy, Heads, SecurityHeaders, refusal
from app.errors import JoymapError
from app.jobs.figures import FigureDesk
from app.jobs.supervisor import Supervisor
from app.routers import ROUTERS, pages
from app.routers.dependencies import Service
from app.services import drives, enrolment, protocols, queries
from app.services.doorkeeping import Doorkeeper
from app.services.steps import Steps
from app.settings import STATIC_DIR, Settings
from app.storage.database import Database, DatabaseTrouble
from app.teleop.live_sessions import LiveSessions
from app.teleop.replay import Replays
from models.checkpoints import load_controller
from models.controller import LatentController
from models.kinematics import Kinematics
from models.panda_pack import open_pack
from models.task_space import Survey
from models.tasks import TASKS

_LOG = logging.getLogger(__name__)
_FREE_EVERY_S = 600.0


def create_app(settings: Settings) -> FastAPI:
    """The service on an already migrated database."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        torch.set_num_threads(1)  # the control loop needs the other core
        database = Database(settings.database_path)
        pack = open_pack(settings.pack_dir)
        kinematics = Kinematics.from_urdf(pack.urdf)
        controllers: dict[str, LatentController] = {name: load_controller(name) for name in TASKS}

        @cache
        def survey(task: str) -> Survey:
            return queries.survey_task(task, controllers[task], kinematics)

        supervisor = Supervisor(database, settings)
        service = Service(
            settings=settings,
            database=database,
            live=LiveSessions(settings, database, pack, controllers, kinematics),
            replays=Replays(database, pack),
            supervisor=supervisor,
            figures=FigureDesk(settings),
            doorkeeper=Doorkeeper(time.monotonic),
            steps=Steps(database, controllers, kinematics, survey),
            boot=str(uuid.uuid4()),
        )
        app.state.service = service
        supervisor.recover()
        with database.write() as db:
            drives.end_all(db, "server stopped")
            protocols.demo(db, settings)
        running = [
            asyncio.create_task(service.live.run(), name="live sessions"),
            asyncio.create_task(supervisor.run(), name="training"),
            asyncio.create_task(_free_places(database), name="freeing places"),
        ]
        for task in running:
            task.add_done_callback(_report)
        # What is there now stays: the collector need not go through it while arms move.
        gc.collect()
        gc.freeze()
        yield
        await service.figures.close()
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)
        database.close()

    # Its description is for those who are let in: app.routers.accounts.
    app = FastAPI(
        title="Joymap", lifespan=lifespan, openapi_url=None, docs_url=None, redoc_url=None
    )
    for router in ROUTERS:
        app.include_router(router)
    app.mount("/static", StaticFiles(directory=STATIC_DIR))
    app.add_middleware(BodyLimit, limit_bytes=settings.max_body_bytes)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Heads)
    # One handler serves requests and websockets, which the type of this method does not foresee.
    app.add_exception_handler(JoymapError, cast(Any, _refused))
    app.add_exception_handler(RequestValidationError, _not_understood)
    app.add_exception_handler(DatabaseTrouble, cast(Any, _busy))
    app.add_exception_handler(HTTPException, cast(Any, _http_error))
    return app


async def _free_places(database: Database) -> None:
    """Give the places of those who are gone for good to others."""

    def free() -> None:
        with database.write() as db:
            enrolment.free_abandoned(db, datetime.now(UTC))

    while True:
        await asyncio.to_thread(free)
        await asyncio.sleep(_FREE_EVERY_S)


def _report(task: asyncio.Task[None]) -> None:
    with contextlib.suppress(asyncio.CancelledError):
        error = task.exception()
        if error is not None:
            _LOG.critical("%s stopped; restart the server", task.get_name(), exc_info=error)


async def _refused(connection: Any, error: Exception) -> Response | None:
    assert isinstance(error, JoymapError)
    if isinstance(connection, WebSocket):
        await connection.send_denial_response(refusal(error))
        return None
    return pages.refusal_page(connection, error) or refusal(error)


async def _busy(connection: Any, error: Exception) -> Response | None:
    said = str(getattr(error, "orig", error))
    if "locked" not in said and "full" not in said:
        raise error
    _LOG.warning("the database could not be written to: %s", said)
    return await _refused(connection, Busy(is_full="full" in said))


def _not_understood(_request: Request, error: Exception) -> Response:
    """One sentence on what was wrong with the request; what was sent is not repeated."""
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    place = [str(part) for part in first["loc"] if part != "body"]
    if "h" in place:
        sentence = "The stick must be two numbers between -1 and 1."
    elif first["type"] == "json_invalid":
        sentence = "The request is not valid JSON."
    else:
        sentence = f"{'.'.join(place) or 'The request'}: {first['msg']}."
    problem = JoymapError(sentence)
    problem.status_code, problem.kind = 422, "not-understood"
    return refusal(problem)


async def _http_error(connection: Any, error: Exception) -> Response | None:
    assert isinstance(error, HTTPException)
    is_missing = error.status_code == 404
    problem = JoymapError("There is nothing at this address." if is_missing else f"{error.detail}.")
    problem.status_code, problem.kind = error.status_code, "http"
    return await _refused(connection, problem)
