"""Drives as they were recorded, and moves as they were asked about: facts, and their replay."""

import asyncio
import json
import time
from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse
from pydantic import ValidationError

from app import texts
from app.analysis.measures import Measures
from app.routers.dependencies import Here, Service, ViewerOnly, same_origin
from app.routers.descriptions import KEPT, MISSING, REFUSED, example, name_of
from app.routers.etags import unless_known
from app.routers.pages import page
from app.scene.page import CONTENT_SECURITY_POLICY, scene_page
from app.scene.server import SUBPROTOCOL
from app.schemas.messages import SentenceOut
from app.schemas.replay import (
    REPLAY_MESSAGE,
    DriveDetailOut,
    DriveOut,
    DrivesOut,
    MeasuresOut,
    MoveOut,
    PauseIn,
    PlayIn,
    SeekIn,
    SpeedIn,
)
from app.services import drives, enrolment, measured, records
from app.storage.tables import DriveRow, ParticipantRow
from app.teleop.replay import Kind, Replay

router = APIRouter(
    dependencies=[ViewerOnly, Depends(same_origin)],
    tags=["drives"],
    generate_unique_id_function=name_of,
    responses=REFUSED | MISSING,
)

_EVERY_S = 1.0 / 30.0
View = Annotated[str, Path(min_length=1, max_length=64)]
_DRIVE = {
    "id": "0c1f5b0e-7f0c-4a43-8d5e-6a0c5a0b3f21",
    "task": "Go round",
    "strategy": "all-priors",
    "strategy_title": "Your mapping",
    "started_at": "2026-11-24T10:02:31+00:00",
    "end": "done",
    "ticks": 1204,
    "measures": {
        "completion_time_s": 20.1,
        "path_length_m": 0.84,
        "undo_share": 0.06,
        "idle_time_s": 1.9,
        "evenness": 0.71,
        "touches": 0,
        "spills": None,
        "counts": {"rounds": 1},
        "is_success": True,
    },
}

_MOVE = {
    "id": "3d2f5b0e-7f0c-4a43-8d5e-6a0c5a0b3f27",
    "participant_id": "6f1c6f9e-2f0e-4a51-9f3c-0a6f6f0f7d11",
    "label": "P-7",
    "task": "Go round",
    "position": 3,
    "h": [0.1, -0.9],
    "is_answered": True,
    "path": [[0.55, 0.0, 0.3], [0.55, 0.04, 0.3]],
}


@router.get(
    "/api/v1/participants/{participant_id}/drives",
    response_model=DrivesOut,
    responses=example({"label": "P-7", "drives": [_DRIVE]}),
)
def read_drives(participant_id: str, here: Here, request: Request) -> Response:
    """A participant's drives, each with its measures (docs/measures.md)."""
    with here.database.read() as db:
        participant = enrolment.by_id(db, participant_id)
        found = measured.of_participant(db, participant_id)
        lines = [DriveOut(**_facts(each.drive, each.ticks, each.measures)) for each in found]
        whole = DrivesOut(label=enrolment.label_of(participant), drives=lines)
    return unless_known(request, whole)


@router.get(
    "/api/v1/drives/{drive_id}",
    responses=KEPT
    | example(
        _DRIVE
        | {
            "participant_id": "6f1c6f9e-2f0e-4a51-9f3c-0a6f6f0f7d11",
            "label": "P-7",
            "path": [[0.55, 0.0, 0.3], [0.551, 0.002, 0.3]],
            "stick_map": [[0.0, 0.25], [0.75, 0.0]],
        }
    ),
)
def read_drive(drive_id: str, here: Here) -> DriveDetailOut:
    """A drive's measures, and what is drawn of it."""
    with here.database.read() as db:
        record = records.read(db, drive_id)
        participant = db.get_one(ParticipantRow, record.drive.participant_id)
        return DriveDetailOut(
            **_facts(record.drive, len(record.rows), record.measures()),
            participant_id=participant.id,
            label=enrolment.label_of(participant),
            path=record.path(),
            stick_map=record.stick_map(),
        )


@router.get("/api/v1/moves/{query_id}", responses=example(_MOVE))
def read_move(query_id: str, here: Here) -> MoveOut:
    """The move of a question, what was answered to it, and what is drawn of it."""
    with here.database.read() as db:
        move = records.read_move(db, query_id)
        participant = db.get_one(ParticipantRow, move.query.participant_id)
        return MoveOut(
            id=query_id,
            participant_id=participant.id,
            label=enrolment.label_of(participant),
            task=texts.title_of(move.task.name),
            position=move.query.position,
            h=move.h,
            is_answered=move.answer is not None,
            path=move.query.hand_path,
        )


@router.get("/participants/{participant_id}")
def read_drives_page(participant_id: str, here: Here) -> HTMLResponse:
    """The page of a participant."""
    with here.database.read() as db:
        enrolment.by_id(db, participant_id)
    return HTMLResponse(page("person.html"))


@router.get("/drives/{drive_id}")
def read_replay_page(drive_id: str, here: Here) -> HTMLResponse:
    """The page of a replay."""
    with here.database.read() as db:
        records.read(db, drive_id)
    return HTMLResponse(page("replay.html"))


@router.get("/moves/{query_id}")
def read_move_page(query_id: str, here: Here) -> HTMLResponse:
    """The page of a move's replay."""
    with here.database.read() as db:
        records.read_move(db, query_id)
    return HTMLResponse(page("replay.html"))


@router.get("/drives/{motion_id}/{view}/scene/")
@router.get("/moves/{motion_id}/{view}/scene/", name="read_move_picture_page")
def read_picture_page(motion_id: str, view: View) -> HTMLResponse:
    """The page of the picture, for the iframe."""
    del motion_id, view
    return HTMLResponse(
        scene_page(),
        headers={
            "Content-Security-Policy": CONTENT_SECURITY_POLICY,
            "X-Frame-Options": "SAMEORIGIN",
        },
    )


@router.websocket("/drives/{drive_id}/{view}/scene")
async def look_at_drive(socket: WebSocket, drive_id: str, view: View, here: Here) -> None:
    """The picture's own connection."""
    await _look(socket, "drives", drive_id, view, here)


@router.websocket("/moves/{query_id}/{view}/scene")
async def look_at_move(socket: WebSocket, query_id: str, view: View, here: Here) -> None:
    """The picture's own connection."""
    await _look(socket, "moves", query_id, view, here)


@router.websocket("/drives/{drive_id}/{view}/control")
async def control_drive(socket: WebSocket, drive_id: str, view: View, here: Here) -> None:
    """Play, pause, seek, and hear which tick is shown."""
    await _control(socket, "drives", drive_id, view, here)


@router.websocket("/moves/{query_id}/{view}/control")
async def control_move(socket: WebSocket, query_id: str, view: View, here: Here) -> None:
    """Play, pause, seek, and hear which tick is shown."""
    await _control(socket, "moves", query_id, view, here)


async def _look(socket: WebSocket, kind: Kind, motion_id: str, view: str, here: Service) -> None:
    if SUBPROTOCOL not in socket.scope["subprotocols"]:
        await socket.close(1002, "This page is of another version; please reload it.")
        return
    async with here.replays.view(kind, motion_id, view) as replay:
        await socket.accept(SUBPROTOCOL)
        await replay.scene.serve(socket)


async def _control(socket: WebSocket, kind: Kind, motion_id: str, view: str, here: Service) -> None:
    async with here.replays.view(kind, motion_id, view) as replay:
        await socket.accept()
        playing = asyncio.create_task(_play(socket, replay))
        try:
            while True:
                message = await socket.receive()
                if message["type"] == "websocket.disconnect":
                    break
                sentence = _follow(message.get("text") or "", replay)
                if sentence is not None:
                    await socket.send_text(SentenceOut(sentence=sentence).model_dump_json())
                # However many have come at once: everyone else's turn is between any two of them.
                await asyncio.sleep(0)
        except WebSocketDisconnect:  # while answering
            pass
        finally:
            playing.cancel()


def _follow(text: str, replay: Replay) -> str | None:
    """Do what the page says; a sentence if that makes no sense."""
    try:
        match REPLAY_MESSAGE.validate_python(json.loads(text)):
            case PlayIn():
                replay.play(time.monotonic())
            case PauseIn():
                replay.pause()
            case SeekIn(tick=tick):
                replay.seek(tick)
            case SpeedIn(speed=speed):
                replay.speed = speed
    except (ValidationError, ValueError, RecursionError):
        return "This message was not understood."
    return None


async def _play(socket: WebSocket, replay: Replay) -> None:
    """Show one tick after the other, and say which, at least once a second."""
    told, told_s = "", 0.0
    while True:
        now_s = time.monotonic()
        replay.advance(now_s)
        status = replay.status().model_dump_json()
        if status != told or now_s - told_s > 1.0:
            await socket.send_text(status)
            told, told_s = status, now_s
        await asyncio.sleep(_EVERY_S)


def _facts(drive: DriveRow, ticks: int, measures: Measures | None) -> dict[str, Any]:
    return {
        "id": drive.id,
        "task": texts.title_of(drive.task),
        "strategy": drive.strategy,
        "strategy_title": drives.title_of(drive.strategy),
        "started_at": drive.started_at.isoformat(timespec="seconds"),
        "end": drive.end,
        "ticks": ticks,
        "measures": None if measures is None else MeasuresOut(**asdict(measures)),
    }
