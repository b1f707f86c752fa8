"""What a participant's page says and hears over the live websocket."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field, FiniteFloat, TypeAdapter

from app.schemas.participants import Axis, In


class StickIn(In):
    """Where the stick is now; said 30 times a second while steering.

    ``age_ms`` is for how long the page has not found there what pushes the stick: the gamepad among
    those connected, the key or the pointer down. A push that is held still is found anew each time.
    """

    type: Literal["stick"]
    seq: int = Field(ge=0)
    x: Axis
    y: Axis
    sent_ms: FiniteFloat = 0.0
    device: Literal["mouse", "finger", "pen", "keys", "gamepad"] | None = None
    device_id: str = Field(default="", max_length=200)
    age_ms: Annotated[FiniteFloat, Field(ge=0.0)] = 0.0


class ShowIn(In):
    """Play the move of a question."""

    type: Literal["show"]
    query_id: str = Field(max_length=64)


class TakeIn(In):
    """This tab wants the stick."""

    type: Literal["take"]


class HoldIn(In):
    """Stop now: the page is hidden."""

    type: Literal["hold"]


class HomeIn(In):
    """Bring the arm back to where driving begins."""

    type: Literal["home"]


class PressIn(In):
    """The button: grasp, where the task has something to grasp."""

    type: Literal["press"]


class ArrowsIn(In):
    """Show or hide where each stick direction would lead."""

    type: Literal["arrows"]
    shown: bool


class GiveUpIn(In):
    """End the attempt as it is."""

    type: Literal["give-up"]


PageMessage = StickIn | ShowIn | TakeIn | HoldIn | HomeIn | PressIn | GiveUpIn | ArrowsIn
PAGE_MESSAGE: TypeAdapter[PageMessage] = TypeAdapter(
    Annotated[PageMessage, Field(discriminator="type")]
)


class PlaybackOut(BaseModel):
    """Which move is being shown, how far it has come, and how long the arm moves in all."""

    query_id: str
    fraction: float
    duration_s: float


class ProgressOut(BaseModel):
    """How far an attempt is, and how long it has lasted.

    ``phase`` is for programs and ``says`` the same for people: what to do now, or how it ended.
    """

    title: str
    phase: str
    fraction: float
    says: str
    counts: dict[str, int]
    elapsed_s: float
    limit_s: float | None
    can_grasp: bool
    end: Literal["done", "given up", "time limit"] | None
    is_success: bool


class StatusOut(BaseModel):
    """What the arm is doing, for the words on the page."""

    type: Literal["status"] = "status"
    mode: Literal["idle", "showing", "driving"]
    has_stick: bool
    strategy: str | None
    drive_id: str | None
    hold: Literal["released", "silent", "edge", "moving-home", "by-itself", "over"] | None
    progress: ProgressOut | None
    stick: tuple[float, float]
    hand: tuple[float, float, float]
    hand_wxyz: tuple[float, float, float, float]
    playback: PlaybackOut | None
    arrows: bool


class SentenceOut(BaseModel):
    """A message that could not be followed, and why."""

    type: Literal["error"] = "error"
    sentence: str
