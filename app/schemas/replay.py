"""What the page of a replay says and hears, and what there is to know of a drive."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field, TypeAdapter

from app.schemas.participants import In


class PlayIn(In):
    """Go on."""

    type: Literal["play"]


class PauseIn(In):
    """Stand still."""

    type: Literal["pause"]


class SeekIn(In):
    """Show a tick."""

    type: Literal["seek"]
    tick: int = Field(ge=0, le=10**9)


class SpeedIn(In):
    """How much faster than it was."""

    type: Literal["speed"]
    speed: float = Field(ge=0.25, le=4.0)


ReplayMessage = PlayIn | PauseIn | SeekIn | SpeedIn
REPLAY_MESSAGE: TypeAdapter[ReplayMessage] = TypeAdapter(
    Annotated[ReplayMessage, Field(discriminator="type")]
)


class ReplayStatusOut(BaseModel):
    """The tick that is shown."""

    type: Literal["status"] = "status"
    tick: int
    ticks: int
    time_s: float
    duration_s: float
    is_playing: bool
    speed: float
    stick: tuple[float, float]
    hand: tuple[float, float, float]
    hold: str | None
    is_touching: bool


class MeasuresOut(BaseModel):
    """See :class:`app.analysis.measures.Measures`."""

    completion_time_s: float
    path_length_m: float
    undo_share: float
    idle_time_s: float
    evenness: float
    touches: int | None
    spills: int | None
    counts: dict[str, int]
    is_success: bool | None


class DriveOut(BaseModel):
    """A drive in a list; without ticks there are no measures."""

    id: str
    task: str
    strategy: str
    strategy_title: str
    started_at: str
    end: str | None
    ticks: int
    measures: MeasuresOut | None


class DrivesOut(BaseModel):
    """A participant's drives."""

    label: str
    drives: list[DriveOut]


class DriveDetailOut(DriveOut):
    """A drive with what is drawn of it."""

    participant_id: str
    label: str
    path: list[list[float]]
    stick_map: list[list[float]]


class MoveOut(BaseModel):
    """The move of a question; ``h`` is null where they could not say, or did not answer yet."""

    id: str
    participant_id: str
    label: str
    task: str
    position: int
    h: tuple[float, float] | None
    is_answered: bool
    path: list[list[float]]
