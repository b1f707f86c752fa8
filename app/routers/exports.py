"""A study's data, as a download that is sent while it is made."""

import asyncio
from collections.abc import AsyncGenerator
from typing import Literal

from fastapi import APIRouter, Depends
from fastapi.responses import StreamingResponse

from app.jobs import commands
from app.routers.dependencies import Assistant, Here, same_origin
from app.routers.descriptions import MISSING, REFUSED, name_of
from app.services import audit, studies
from app.settings import Settings

router = APIRouter(
    prefix="/api/v1",
    dependencies=[Depends(same_origin)],
    tags=["export"],
    generate_unique_id_function=name_of,
    responses=REFUSED | MISSING,
)

_BYTES = {"type": "string", "format": "binary"}
_BLOCK = 1 << 16
_PATIENCE_S = 60.0  # with a browser that takes nothing: the export holds the data as they are


@router.get(
    "/studies/{study_id}/export",
    response_class=StreamingResponse,
    responses={200: {"content": {"application/zip": {"schema": _BYTES}}}},
)
def export(
    study_id: str,
    me: Assistant,
    here: Here,
    format: Literal["zip"] = "zip",
    with_excluded: bool = True,
    with_lerobot: bool = True,
) -> StreamingResponse:
    """Everything a study gave, as a zip; see docs/export.md."""
    with here.database.write() as db:
        study = studies.find(db, study_id)
        audit.note(db, me.id, "study.export", study.id, with_excluded=with_excluded)
    options = ["--out", "-", "--format", format]
    options += [] if with_excluded else ["--without-excluded"]
    options += [] if with_lerobot else ["--no-lerobot"]
    command = ["export", *options, "--", study_id]
    name = f"joymap-{study_id.split('-', maxsplit=1)[0]}.zip"
    return StreamingResponse(
        _output(command, here.settings),
        media_type="application/zip",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


async def _output(command: list[str], settings: Settings) -> AsyncGenerator[bytes]:
    """What a command writes; it ends with whoever takes it."""
    process = await commands.start(command, settings, stdout=asyncio.subprocess.PIPE, limit=_BLOCK)
    assert process.stdout is not None
    try:
        while block := await process.stdout.read(_BLOCK):
            patience = asyncio.get_running_loop().call_later(_PATIENCE_S, process.kill)
            try:
                yield block
            finally:
                patience.cancel()
        if await process.wait() != 0:
            # What was sent is not whole; breaking off lets the browser know.
            raise RuntimeError(f"The export ended with {process.returncode}.")
    finally:
        await commands.end(process)
