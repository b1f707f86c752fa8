"""What a participant's page sends and gets over HTTP."""

from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, StrictBool

Axis = Annotated[FiniteFloat, Field(ge=-1.0, le=1.0)]
Stick = tuple[Axis, Axis]
Gain = Annotated[FiniteFloat, Field(ge=1.0, le=4.0, strict=True)]
StepName = Literal["consent", "practice", "queries", "training", "driving"]


class In(BaseModel):
    """Base of what comes in: nothing unknown, no NaN, no infinity."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class ConsentIn(In):
    """The person agrees to a version of the consent text."""

    id: UUID
    version: str = Field(max_length=40)


class StepDoneIn(In):
    """The person goes on to the next step."""

    id: UUID


class AnswerIn(In):
    """The stick input a person would give for a move; ``h`` null: they can't say."""

    id: UUID
    query_id: UUID
    h: Stick | None
    thinking_time_s: Annotated[FiniteFloat, Field(ge=0.0, le=86_400.0)]


class DriveIn(In):
    """The person wants to drive under a strategy."""

    id: UUID
    strategy: str = Field(max_length=40)


class StickSettingsIn(In):
    """How the person wants their stick set, all of it."""

    id: UUID
    invert_x: StrictBool
    invert_y: StrictBool
    gain: Gain
    one_axis: StrictBool
    steady: StrictBool


class ConsentOut(BaseModel):
    """The text to agree to."""

    version: str
    title: str
    paragraphs: list[str]


class GivenOut(BaseModel):
    """The answer that counts for a question."""

    id: str
    h: tuple[float, float] | None


class QueryOut(BaseModel):
    """A question asked, and its answer so far."""

    id: str
    position: int
    answer: GivenOut | None


class StrategyOut(BaseModel):
    """A way of driving to choose from."""

    name: str
    title: str
    note: str


class StickSettingsOut(BaseModel):
    """How the person's stick is set."""

    invert_x: bool
    invert_y: bool
    gain: float
    one_axis: bool
    steady: bool


class SessionOut(BaseModel):
    """Where the person is, and what their page needs for that step."""

    step: StepName
    consent: ConsentOut
    practice_s: float
    queries: list[QueryOut]
    labels_wanted: int
    may_end_early: bool
    field_says: str
    strategies: list[StrategyOut]
    may_switch_arrows: bool
    notice: str | None
    stick: StickSettingsOut


class TrainingOut(BaseModel):
    """How far the training is, with curves and learned fields as they come."""

    state: Literal["queued", "running", "succeeded", "failed"]
    error: str | None
    fraction: float
    attempt: int
    training_s: float | None
    strategies: dict[str, Any]


class DriveOut(BaseModel):
    """A drive that was opened."""

    id: str
    strategy: str
