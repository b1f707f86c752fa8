"""What programs get for a refusal."""

from pydantic import BaseModel, ConfigDict


class SaidOut(BaseModel):
    """A kind for programs, and one sentence for people."""

    kind: str
    sentence: str


class RefusalOut(BaseModel):
    """What was asked for was not done."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"error": {"kind": "no-such-study", "sentence": "There is no such study."}}
            ]
        }
    )

    error: SaidOut
