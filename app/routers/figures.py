"""A study's figures as they fill: ordered, looked after, and looked at."""

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool

from app.errors import JoymapError
from app.jobs.figures import Drawn
from app.routers.dependencies import Here, Service, Viewer, same_origin
from app.routers.descriptions import MISSING, REFUSED, name_of
from app.routers.etags import unless_known
from app.schemas.figures import FigureOut, FiguresOut
from app.services import studies
from app.services.figures import Version, version_of

router = APIRouter(
    prefix="/api/v1",
    dependencies=[Depends(same_origin)],
    tags=["figures"],
    generate_unique_id_function=name_of,
    responses=REFUSED | MISSING,
)


class NoSuchFigure(JoymapError):
    """A figure that has not been drawn."""

    status_code = 404
    kind = "no-such-figure"

    def __init__(self) -> None:
        """Say what to do."""
        super().__init__("There is no such figure now; have the study's figures drawn first.")


@router.get("/studies/{study_id}/figures", response_model=FiguresOut)
async def read_figures(study_id: str, me: Viewer, here: Here, request: Request) -> Response:
    """The figures that were drawn last, what they show, and whether newer ones are being drawn."""
    del me
    version = await run_in_threadpool(_version, here, study_id)
    return unless_known(request, _figures(here, study_id, version))


@router.post("/studies/{study_id}/figures", status_code=202)
async def draw_figures(study_id: str, me: Viewer, here: Here) -> FiguresOut:
    """Have the figures drawn, if there is anything new; ask for them again until they are."""
    del me
    version = await run_in_threadpool(_version, here, study_id)
    here.figures.order(study_id, version)
    return _figures(here, study_id, version)


@router.get(
    "/studies/{study_id}/figures/{name}",
    response_class=Response,
    responses={200: {"content": {"image/svg+xml": {}}}},
)
async def read_figure(study_id: str, name: str, me: Viewer, here: Here) -> Response:
    """One of the figures that were drawn last, as SVG."""
    del me
    drawn = here.figures.drawn(study_id, await run_in_threadpool(_version, here, study_id))
    if drawn is None or name not in drawn.images:
        raise NoSuchFigure
    return Response(drawn.images[name], media_type="image/svg+xml")


def _version(here: Service, study_id: str) -> Version:
    with here.database.read() as db:
        return version_of(db, studies.find(db, study_id).id)


def _figures(here: Service, study_id: str, version: Version) -> FiguresOut:
    drawn: Drawn | None = here.figures.drawn(study_id, version)
    state = {
        "is_drawing": here.figures.is_drawing(study_id),
        "has_failed": here.figures.has_failed(study_id),
        "is_current": drawn is not None and drawn.version == version,
    }
    if drawn is None:
        return FiguresOut(drawn_at=None, pictures=[], findings=[], test="", drives=0, **state)
    return FiguresOut(
        drawn_at=drawn.drawn_at,
        pictures=[FigureOut.model_validate(each) for each in drawn.index["pictures"]],
        findings=drawn.index["findings"],
        test=drawn.index["test"],
        drives=drawn.index["drives"],
        **state,
    )
