"""Watching a study: whose arms are live, a look at one of them, and what is being learned."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response, WebSocket
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import HTMLResponse

from app.errors import JoymapError
from app.routers.dependencies import Here, Service, ViewerOnly, same_origin
from app.routers.descriptions import MISSING, REFUSED, name_of
from app.routers.etags import unless_known
from app.scene.page import CONTENT_SECURITY_POLICY, scene_page
from app.scene.server import SUBPROTOCOL
from app.schemas.experimenter import JobsOut, JobState, LivesOut
from app.services import watching
from app.services.watching import Live
from app.teleop.live_session import LiveSession

router = APIRouter(
    dependencies=[ViewerOnly, Depends(same_origin)],
    tags=["watching"],
    generate_unique_id_function=name_of,
    responses=REFUSED,
)

_LOOK_EVERY_S = 1.0


class NobodyIsThere(JoymapError):
    """A look at the arm of somebody who has no page open."""

    status_code = 409
    kind = "nobody-is-there"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("This participant has no arm in front of them now.")


@router.get("/api/v1/live")
async def read_live(here: Here) -> LivesOut:
    """Every arm that somebody has in front of them now, with their step and what the arm does."""
    now_s = here.live.now_s()
    seen = [
        Live(session.participant_id, session.pages > 0, session.status(None, now_s))
        for session in here.live.all()
    ]
    return await run_in_threadpool(_lives, here, seen)


@router.get("/api/v1/jobs", response_model=JobsOut, responses=MISSING)
def read_jobs(
    here: Here,
    request: Request,
    state: JobState | None = None,
    after: Annotated[str | None, Query(max_length=64)] = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> Response:
    """Everybody's trainings, newest first; a page goes on after the last one of the page before."""
    with here.database.read() as db:
        found = watching.trainings(db, state=state, after=after, limit=limit)
    return unless_known(request, found)


@router.get("/participants/{participant_id}/live/scene/", include_in_schema=False)
def read_live_picture_page(participant_id: str) -> HTMLResponse:
    """The page of the picture, for the iframe."""
    del participant_id
    return HTMLResponse(
        scene_page(),
        headers={
            "Content-Security-Policy": CONTENT_SECURITY_POLICY,
            "X-Frame-Options": "SAMEORIGIN",
        },
    )


@router.websocket("/participants/{participant_id}/live/scene")
async def look(socket: WebSocket, participant_id: str, here: Here) -> None:
    """A look at somebody's arm while they have it in front of them; nothing can be done to it."""
    if SUBPROTOCOL not in socket.scope["subprotocols"]:
        await socket.close(1002, "This page is of another version; please reload it.")
        return
    session = here.live.existing(participant_id)
    if session is None or not session.pages:
        raise NobodyIsThere
    await socket.accept(SUBPROTOCOL)
    # Who only watches must not keep an arm alive that its participant has left.
    shown = asyncio.create_task(session.scene.serve(socket))
    left = asyncio.create_task(_until_left(session))
    try:
        await asyncio.wait((shown, left), return_when=asyncio.FIRST_COMPLETED)
        has_left = not shown.done()
    finally:
        for task in (shown, left):
            task.cancel()
        await asyncio.gather(shown, left, return_exceptions=True)
    if has_left:
        await socket.close(1000, "The participant has left.")


async def _until_left(session: LiveSession) -> None:
    while session.pages and not session.is_closed:
        await asyncio.sleep(_LOOK_EVERY_S)


def _lives(here: Service, seen: list[Live]) -> LivesOut:
    with here.database.read() as db:
        return watching.lives(db, seen)
