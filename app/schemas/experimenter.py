"""What experimenters send and get: studies, their participants, and what these gave."""

from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.schemas.examples import AT, ID, JOB, LINE, LIVE, PROTOCOL, STEP, STUDY, WHOLE, YAML
from app.schemas.messages import ProgressOut
from app.schemas.participants import In
from app.schemas.protocol import Protocol

State = Literal["active", "completed", "abandoned", "withdrawn"]
JobState = Literal["queued", "running", "succeeded", "failed"]
LARGEST = 2**63 - 1  # that the database can hold, or compare a number with
ExternalId = Annotated[str, Field(min_length=1, max_length=200)]
Words = Annotated[str, Field(min_length=1, max_length=2000)]


def _example(fields: dict[str, Any]) -> ConfigDict:
    return ConfigDict(json_schema_extra={"examples": [fields]})


class ProtocolIn(In):
    """A protocol, as YAML or as data."""

    model_config = _example({"yaml": YAML})

    yaml: Annotated[str, Field(max_length=200_000)] | None = None
    protocol: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _is_one(self) -> "ProtocolIn":
        if (self.yaml is None) == (self.protocol is None):
            raise ValueError("send either yaml or protocol")
        return self


class NewStudyIn(ProtocolIn):
    """A study is wanted."""

    model_config = _example({"id": ID, "yaml": YAML})

    id: UUID


class StepOut(BaseModel):
    """A step, in words."""

    key: str
    kind: str
    title: str


class CheckedOut(BaseModel):
    """A protocol both ways, and what participants would do."""

    model_config = _example({"protocol": PROTOCOL, "yaml": YAML, "steps": [STEP], "minutes": 14})

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

    model_config = _example({"studies": [STUDY]})

    studies: list[StudyLineOut]


class StudyOut(StudyLineOut):
    """A study with its protocol."""

    model_config = _example(
        STUDY
        | {
            "protocol": PROTOCOL,
            "yaml": YAML,
            "is_frozen": True,
            "versions": [{"version": 1, "created_at": AT, "frozen_at": AT, "participants": 12}],
            "has_link": True,
        }
    )

    protocol: Protocol
    yaml: str
    is_frozen: bool
    versions: list[VersionOut]
    has_link: bool


class StudyStateIn(In):
    """Let people in, or nobody any more."""

    model_config = _example({"state": "closed"})

    state: Literal["open", "closed"]


class LinkOut(BaseModel):
    """A link, shown this once."""

    model_config = _example({"link": "http://127.0.0.1:8000/join/kT3…"})

    link: str


class NewParticipantsIn(In):
    """Links for more participants are wanted."""

    model_config = _example({"id": ID, "count": 5})

    id: UUID
    count: Annotated[int, Field(ge=1, le=200)] = 1
    external_id: ExternalId | None = None

    @model_validator(mode="after")
    def _names_one(self) -> "NewParticipantsIn":
        if self.external_id is not None and self.count > 1:
            raise ValueError("an external id is one participant's")
        return self


class NewParticipantOut(BaseModel):
    """A participant's link, shown this once."""

    id: str
    label: str
    link: str


class NewParticipantsOut(BaseModel):
    """Links, shown this once."""

    model_config = _example(
        {"participants": [{"id": ID, "label": "P-7", "link": "http://127.0.0.1:8000/p/x8Q…"}]}
    )

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
    training: JobState | None
    drives: int
    driven_s: float


class ParticipantsOut(BaseModel):
    """A page of participants, and where the next one begins."""

    model_config = _example({"participants": [LINE], "total": 12, "next": 57})

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
    """How alike answers to the same move are.

    Over the moves with two labels: the angle between the two in [deg] (null if a stick was at
    rest in all of them), and the difference of their lengths, which are from 0 to 1.
    """

    pairs: int
    mean_angle_deg: float | None
    mean_length_difference: float


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

    model_config = _example(WHOLE)

    order: list[str]
    answers_given: list[AnswerOut]
    consistency: dict[str, ConsistencyOut]
    trainings: list[TrainingLineOut]
    responses: list[ResponseOut]
    notes: list[NoteOut]
    events: list[EventOut]


class ReasonIn(In):
    """Why somebody's data are left out."""

    model_config = _example({"reason": "Pressed at random."})

    reason: Words


class NoteIn(In):
    """A note."""

    model_config = _example({"id": ID, "text": "Was late."})

    id: UUID
    text: Words


class RetrainIn(In):
    """A training for a task is wanted once more."""

    model_config = _example({"task": "avoid"})

    task: Annotated[str, Field(max_length=40)]


class LiveOut(BaseModel):
    """An arm that somebody has in front of them."""

    participant_id: str
    label: str
    study_id: str
    step: StepOut
    mode: Literal["idle", "showing", "driving"]
    is_connected: bool
    drive_id: str | None
    progress: ProgressOut | None


class LivesOut(BaseModel):
    """All arms that are live."""

    model_config = _example({"sessions": [LIVE]})

    sessions: list[LiveOut]


class JobOut(BaseModel):
    """A training of anybody's."""

    id: str
    participant_id: str
    label: str
    study_id: str
    task: str
    state: JobState
    fraction: float
    attempt: int
    error: str | None
    queued_at: str
    ended_at: str | None
    training_s: float | None


class JobsOut(BaseModel):
    """A page of trainings, newest first, and where the next one begins."""

    model_config = _example({"jobs": [JOB], "next": None})

    jobs: list[JobOut]
    next: str | None
