"""What the dashboard sends and gets."""

from typing import Literal
from uuid import UUID

from pydantic import BaseModel

from app.schemas.participants import In


class NewParticipantIn(In):
    """A link for one more participant is wanted."""

    id: UUID


class NewParticipantOut(BaseModel):
    """The link, shown this once."""

    id: str
    label: str
    link: str


class ParticipantOut(BaseModel):
    """A line of the dashboard."""

    id: str
    label: str
    created_at: str
    step: str
    answers: int
    training: Literal["queued", "running", "succeeded", "failed"] | None
    drives: int
    driven_s: float


class ParticipantsOut(BaseModel):
    """All lines of the dashboard."""

    participants: list[ParticipantOut]
