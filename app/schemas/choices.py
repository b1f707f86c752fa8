"""What a protocol can be made of, for forms and programs."""

from pydantic import BaseModel, ConfigDict

from app.schemas.examples import CHOICES
from app.schemas.protocol import Protocol


class ChoiceOut(BaseModel):
    """One of several: its name in a protocol, and its title."""

    name: str
    title: str


class TaskChoiceOut(ChoiceOut):
    """A task; a study is of tasks with a goal. The numbers hold where a protocol has none."""

    has_goal: bool
    labels: int
    unlabelled: int


class StrategyChoiceOut(ChoiceOut):
    """A strategy."""

    is_learned: bool  # from the participant's answers


class ChoicesOut(BaseModel):
    """All that a protocol can name, and one to begin with."""

    model_config = ConfigDict(json_schema_extra={"examples": [CHOICES]})

    tasks: list[TaskChoiceOut]
    strategies: list[StrategyChoiceOut]
    orders: list[ChoiceOut]
    questionnaires: list[ChoiceOut]
    template: Protocol
