"""What experimenters send and get: studies, their participants, and what these gave."""

from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, Field, model_validator

from app.schemas.participants import In
from app.schemas.protocol import Protocol

State = Literal["active", "completed", "abandoned", "withdrawn"]
Words = Annotated[str, Field(min_length=1, max_length=2000)]


class ProtocolIn(In):
    """A protocol, as YAML or as data."""

    yaml: Annotated[str, Field(max_length=200_000)] | None = None
    protocol: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _is_one(self) -> "ProtocolIn":
        if (self.yaml is None) == (self.protocol is None):
            raise ValueError("send either yaml or protocol")
        return self


class NewStudyIn(ProtocolIn):
    """A study is wanted."""

    id: UUID


class StepOut(BaseModel):
    """A step, in words."""

    key: str
    kind: str
    title: str


class CheckedOut(BaseModel):
    """A protocol both ways, and what participants would do."""

    protocol: Protocol
    yaml: str
    steps: list[StepOut]
    minutes: int


class VersionOut(BaseModel):
    """A version of a protocol."""

    version: int
    created_at: str
    frozen_at: str | None
    participants: int


class StudyLineOut(BaseModel):
    """A study in the list."""

    id: str
    title: str
    state: Literal["open", "closed"]
    created_at: str
    version: int
    participants: dict[str, int]
    wanted: int | None


class StudiesOut(BaseModel):
    """All studies."""

    studies: list[StudyLineOut]


class StudyOut(StudyLineOut):
    """A study with its protocol."""

    protocol: Protocol
    yaml: str
    is_frozen: bool
    versions: list[VersionOut]
    has_link: bool


class StudyStateIn(In):
    """Let people in, or nobody any more."""

    state: Literal["open", "closed"]


class LinkOut(BaseModel):
    """A link, shown this once."""

    link: str


class NewParticipantsIn(In):
    """Links for more participants are wanted."""

    id: UUID
    count: Annotated[int, Field(ge=1, le=200)] = 1


class NewParticipantOut(BaseModel):
    """A participant's link, shown this once."""

    id: str
    label: str
    link: str


class NewParticipantsOut(BaseModel):
    """Links, shown this once."""

    participants: list[NewParticipantOut]


class ParticipantLineOut(BaseModel):
    """A participant in a list."""

    id: str
    label: str
    study_id: str
    version: int
    external_id: str | None
    created_at: str
    seen_at: str | None
    state: State
    excluded: str | None
    step: StepOut
    place: int
    of: int
    is_opened: bool
    is_connected: bool
    answers: int
    training: Literal["queued", "running", "succeeded", "failed"] | None
    drives: int
    driven_s: float


class ParticipantsOut(BaseModel):
    """A page of participants, and where the next one begins."""

    participants: list[ParticipantLineOut]
    total: int
    next: int | None


class AnswerOut(BaseModel):
    """An answer, with the move it is to."""

    query_id: str
    task: str
    position: int
    repeats: str | None
    h: tuple[float, float] | None
    thinking_time_s: float
    answered_at: str
    hand_path: list[list[float]]


class ConsistencyOut(BaseModel):
    """How alike answers to the same move are."""

    pairs: int
    mean_angle_deg: float | None


class TrainingLineOut(BaseModel):
    """A training, with curves and learned fields as the page of a free drive has them."""

    id: str
    task: str
    state: str
    fraction: float
    queued_at: str
    training_s: float | None
    error: str | None
    strategies: dict[str, Any]


class ResponseOut(BaseModel):
    """A response to an item; null: declined."""

    step: str
    questionnaire: str
    item: str
    value: int | str | None
    answered_at: str


class NoteOut(BaseModel):
    """A note of an experimenter."""

    id: str
    author: str
    text: str
    written_at: str


class EventOut(BaseModel):
    """A step taken."""

    kind: str
    at: str


class ParticipantOut(ParticipantLineOut):
    """Everything of a participant but the drives."""

    order: list[str]
    answers_given: list[AnswerOut]
    consistency: dict[str, ConsistencyOut]
    trainings: list[TrainingLineOut]
    responses: list[ResponseOut]
    notes: list[NoteOut]
    events: list[EventOut]


class ReasonIn(In):
    """Why somebody's data are left out."""

    reason: Words


class NoteIn(In):
    """A note."""

    id: UUID
    text: Words


class RetrainIn(In):
    """A training for a task is wanted once more."""

    task: Annotated[str, Field(max_length=40)]


class LiveOut(BaseModel):
    """An arm that somebody has in front of them."""

    participant_id: str
    label: str
    study_id: str
    step: StepOut
    is_connected: bool
    is_driven: bool
    drive_id: str | None


class LivesOut(BaseModel):
    """All arms that are live."""

    sessions: list[LiveOut]
