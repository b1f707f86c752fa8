"""The live side of a participant's page: the 3-D scene, and the websocket of the stick."""

import asyncio
import json
from typing import Annotated, NoReturn

from fastapi import APIRouter, Depends, Query, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse
from pydantic import ValidationError

from app.errors import JoymapError
from app.routers.dependencies import CurrentParticipant, Here, Service, same_origin
from app.scene.page import CONTENT_SECURITY_POLICY, scene_page
from app.scene.server import SUBPROTOCOL
from app.schemas.messages import (
    PAGE_MESSAGE,
    ArrowsIn,
    PressIn,
    SentenceOut,
    ShowIn,
    StickIn,
)
from app.teleop.live_session import LiveSession
from app.teleop.stick_lease import Connection

router = APIRouter(prefix="/p/{token}", dependencies=[Depends(same_origin)])

_STATUS_S = 1.0 / 15.0
_STATUS_AT_LEAST_S = 1.0

_COMMANDS = {
    "take": LiveSession.take_stick,
    "hold": LiveSession.release,
    "home": LiveSession.go_home,
    "give-up": LiveSession.give_up,
}


@router.get("/scene/")
def read_scene_page(participant: CurrentParticipant) -> HTMLResponse:
    """The page of the picture, for the iframe."""
    del participant  # asking for it is the check
    return HTMLResponse(
        scene_page(),
        headers={
            "Content-Security-Policy": CONTENT_SECURITY_POLICY,
            "X-Frame-Options": "SAMEORIGIN",
        },
    )


@router.websocket("/scene")
async def look(socket: WebSocket, participant: CurrentParticipant, here: Here) -> None:
    """The picture's own connection."""
    if SUBPROTOCOL not in socket.scope["subprotocols"]:
        await socket.close(1002, "This page is of another version; please reload it.")
        return
    session = await here.live.session(participant)
    await socket.accept(SUBPROTOCOL)
    await session.scene.serve(socket)


@router.websocket("/live")
async def steer(
    socket: WebSocket,
    participant: CurrentParticipant,
    here: Here,
    tab: Annotated[str, Query(min_length=1, max_length=64)],
    generation: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
) -> None:
    """The stick's connection; the newest page holds the stick, also when its line was lost."""
    session = await here.live.session(participant)
    await socket.accept()
    page = Connection(tab, generation)
    session.connect(page)
    telling = asyncio.create_task(_tell(socket, session, page, here))
    try:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                break
            sentence = await _follow(message.get("text") or "", here, session, page)
            if sentence is not None:
                await socket.send_text(SentenceOut(sentence=sentence).model_dump_json())
            # However many have come at once: everyone else's turn is between any two of them.
            await asyncio.sleep(0)
    except WebSocketDisconnect:  # while answering
        pass
    finally:
        session.leave(page)
        telling.cancel()


async def _follow(text: str, here: Service, session: LiveSession, page: Connection) -> str | None:
    """Do what a page says; a sentence if that cannot be done."""
    try:
        message = PAGE_MESSAGE.validate_python(json.loads(text, parse_constant=_refuse))
        match message:
            case StickIn() if not session.is_driven:
                return "The arm is not being driven: that comes after the training."
            case StickIn():
                age_s = here.settings.speed * message.age_ms / 1000.0
                found_s = here.live.now_s() - age_s
                session.move_stick(page, message.x, message.y, found_s)
            case ShowIn():
                await here.live.show(session, message.query_id)
            case ArrowsIn():
                session.show_arrows(page, message.shown)
            case PressIn():
                return session.press(page)
            case _:
                _COMMANDS[message.type](session, page)
    except (ValueError, RecursionError) as error:  # not JSON, or nested beyond all sense
        return _misunderstood(error)
    except JoymapError as error:
        return error.sentence
    return None


def _misunderstood(error: Exception) -> str:
    if isinstance(error, ValidationError):
        places = [item["loc"] for item in error.errors(include_url=False)]
        if any("stick" in place for place in places):
            return "The stick must be two numbers between -1 and 1."
    return "This message was not understood."


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number a stick can give")


async def _tell(socket: WebSocket, session: LiveSession, page: Connection, here: Service) -> None:
    """Tell a page what the arm is doing, when that changes and at least once a second."""
    told, told_s = "", 0.0
    while not session.is_closed:
        now = here.live.now_s()
        status = session.status(page, now).model_dump_json()
        if status != told or now - told_s > _STATUS_AT_LEAST_S:
            await socket.send_text(status)
            told, told_s = status, now
        await asyncio.sleep(_STATUS_S / here.settings.speed)
    # The person has gone on to another task: whoever comes back gets the arm of that one.
    await socket.close(1012)
