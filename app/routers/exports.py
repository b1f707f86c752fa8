"""A study's data, as a download."""

import tempfile
from pathlib import Path

from fastapi import APIRouter, Depends
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from app.routers.dependencies import Assistant, Here, same_origin
from app.services import exports

router = APIRouter(prefix="/api/v1", dependencies=[Depends(same_origin)], tags=["export"])


@router.get("/studies/{study_id}/export", response_class=FileResponse)
def export(study_id: str, me: Assistant, here: Here, with_excluded: bool = True) -> FileResponse:
    """Everything a study gave, as a zip; see docs/export.md."""
    del me
    folder = tempfile.TemporaryDirectory(prefix="joymap-export-")
    file = Path(folder.name) / "export.zip"
    try:
        with here.database.read() as db:
            exports.write(db, study_id, file, with_excluded=with_excluded)
    except BaseException:
        folder.cleanup()
        raise
    return FileResponse(
        file,
        media_type="application/zip",
        filename=f"joymap-{study_id.split('-', maxsplit=1)[0]}.zip",
        background=BackgroundTask(folder.cleanup),
    )
