"""What a participant's page sends and gets over HTTP."""

from datetime import UTC, datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictInt,
)

from app.schemas.props import PropsOut
from app.schemas.protocol import Questionnaire

Axis = Annotated[FiniteFloat, Field(ge=-1.0, le=1.0)]
Stick = tuple[Axis, Axis]
Gain = Annotated[FiniteFloat, Field(ge=1.0, le=4.0, strict=True)]
StepName = Literal[
    "consent", "practice", "queries", "training", "driving", "block", "questions", "end"
]


class In(BaseModel):
    """Base of what comes in: nothing unknown, no NaN, no infinity."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class ConsentIn(In):
    """The person agrees to a version of the consent text."""

    id: UUID
    version: str = Field(max_length=40)


def _cut_off(seconds: float) -> float:
    return min(seconds, LONGEST_S)


def _storable(at: datetime) -> datetime:
    try:
        return max(at.astimezone(UTC), _EARLIEST)
    except OverflowError:  # the first or last day that there is, elsewhere
        return _EARLIEST if at.year < _EARLIEST.year else datetime.max.replace(tzinfo=UTC)


LONGEST_S = 86_400.0
_EARLIEST = datetime(1970, 1, 1, tzinfo=UTC)
# What a page measured is never refused: a tab stays open for days, and its clock may be wrong.
Measured = Annotated[FiniteFloat, Field(ge=0.0), AfterValidator(_cut_off)]
PageTime = Annotated[AwareDatetime, AfterValidator(_storable)]


class StepDoneIn(In):
    """The person goes on to the next step."""

    id: UUID


class AnswerIn(In):
    """The stick input a person would give for a move; ``h`` null: they can't say."""

    id: UUID
    query_id: UUID
    h: Stick | None
    thinking_time_s: Measured


class StepKeyIn(In):
    """The person goes on from a step of which there can be several."""

    id: UUID
    key: str = Field(max_length=120)


class ResponseIn(In):
    """What the person says to one item: a whole number, words, or null: they would rather not."""

    item: str = Field(max_length=40)
    value: StrictInt | Annotated[str, Field(min_length=1, max_length=5000)] | None
    answered_at: PageTime  # by the page's clock


class QuestionnaireIn(StepKeyIn):
    """A questionnaire, filled in: every item is answered or declined."""

    responses: list[ResponseIn] = Field(max_length=60)


class WithdrawIn(In):
    """The person stops taking part."""

    id: UUID
    erase: StrictBool  # also what they gave so far


class JoinIn(In):
    """Somebody comes by a study's shared link; a recruiting service may have named them."""

    # Of this press of the button: sent again, it is answered with the same place.
    id: UUID | None = None
    external_id: Annotated[str, Field(max_length=1000)] | None = None


class JoinPageOut(BaseModel):
    """A study, to those who might take part."""

    title: str
    is_open: bool


class JoinOut(BaseModel):
    """A participant's own link, shown this once."""

    link: str


class DriveIn(In):
    """The person wants to drive; freely, under a strategy of their choice."""

    id: UUID
    strategy: str | None = Field(None, max_length=40)


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
    html: str  # from the protocol's Markdown, in which HTML is not let through


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
    has_curve: bool  # of its learning


class StickSettingsOut(BaseModel):
    """How the person's stick is set."""

    invert_x: bool
    invert_y: bool
    gain: float
    one_axis: bool
    steady: bool


class WayOut(BaseModel):
    """A stage of the study, for the line at the top of the page."""

    title: str
    is_here: bool
    is_done: bool


class BlockOut(BaseModel):
    """Driving under one way of steering, which the person does not know by name."""

    position: int  # 1, 2, …: the first, second, … way of steering of this task
    of: int
    drives_wanted: int
    drives_made: int
    may_continue: bool
    open_drive: str | None  # one that goes on: whoever reloads asks for it again by this id


class QuestionsOut(BaseModel):
    """A questionnaire to fill in."""

    questionnaire: Questionnaire
    about: str | None  # "the first way of steering", or the task's title
    ways: int  # for items of kind "strategy": how many ways of steering there were to choose from


class EndOut(BaseModel):
    """The last page."""

    message: str
    code: str | None
    url: str | None
    left: Literal["kept", "erased"] | None  # what became of what they gave who stopped taking part


class SessionOut(BaseModel):
    """Where the person is, and what their page needs for that step."""

    study: str
    state: Literal["active", "completed", "withdrawn"]
    step: StepName
    key: str
    place: int
    task: str | None  # its title
    task_name: str | None
    props: PropsOut | None  # of the task
    way: list[WayOut]
    may_withdraw: bool
    block: BlockOut | None
    questions: QuestionsOut | None
    end: EndOut | None
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
    strategy: str | None  # null where the person must not hear it
