"""A study's protocol as data: what its participants do, in which order, and what they are told.

The same content is a form in the dashboard, a YAML file, and JSON in the database. All of it is
checked here; an error says where it is and what would be right.
"""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from models.strategies import STRATEGIES
from models.tasks import TASKS

NO_ALIGN = "no-align"
# What a person's answers can be learned with; others know the right answers beforehand.
LEARNABLE = tuple(
    name
    for name, strategy in STRATEGIES.items()
    if strategy.method.is_learned and not strategy.needs_everything
)

Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]{0,39}$")]
Line = Annotated[str, Field(min_length=1, max_length=300)]
Text = Annotated[str, Field(min_length=1, max_length=20_000)]
Seconds = Annotated[FiniteFloat, Field(gt=0.0, le=3600.0)]

DEFAULT_CONSENT = """\
You will see a robot arm make a few short moves. For each one you show which stick input you would \
give to make the arm move like that. There are no right or wrong answers: it is your idea of \
steering that counts.

From your answers the robot learns your way of steering, and then you drive it. You can use a \
mouse, a finger, the keyboard or a gamepad.

We keep your answers, how you set your stick, what you say in questionnaires, and how the arm \
moved while you drove, with the time of each. We do not ask for your name and keep nothing else \
about you. You may stop at any time by closing this page, and your link brings you back to where \
you were; or you withdraw, and what you gave is left out or erased, as you wish.
"""


class _Part(BaseModel):
    # Strict: a number in quotes is text, and true is no number, at every door.
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, strict=True)


class Item(_Part):
    """One question of a questionnaire.

    ``scale`` is answered with a whole number from ``low`` to ``high``, ``choice`` with one of
    ``choices``, ``text`` with words, ``strategy`` with one of the ways of steering just tried.
    """

    key: Key
    kind: Literal["scale", "choice", "text", "strategy"]
    text: Line
    low: int = Field(default=1, ge=-100, le=100)
    high: int = Field(default=7, ge=-100, le=100)
    step: int = Field(default=1, ge=1, le=100)
    low_label: str = Field(default="", max_length=80)
    high_label: str = Field(default="", max_length=80)
    choices: tuple[Line, ...] = Field(default=(), max_length=40)

    @model_validator(mode="after")
    def _is_answerable(self) -> Self:
        if self.kind == "scale" and (self.high - self.low) // self.step < 1:
            raise ValueError(f"the scale of '{self.key}' needs a high end above its low end")
        if self.kind == "choice" and len(self.choices) < 2:
            raise ValueError(f"'{self.key}' needs at least two choices")
        return self


class Questionnaire(_Part):
    """Questions on one page."""

    name: Key
    title: Line
    intro: str = Field(default="", max_length=2000)
    items: tuple[Item, ...] = Field(min_length=1, max_length=60)

    @model_validator(mode="after")
    def _has_no_twins(self) -> Self:
        _refuse_twins([item.key for item in self.items], f"questionnaire '{self.name}'")
        return self


class TaskProtocol(_Part):
    """What is done with one task."""

    task: str
    labels: int = Field(default=7, ge=5, le=100)
    questions: Literal["random", "designed"] = "random"
    repeats: int = Field(
        default=0, ge=0, le=20
    )  # so many questions are asked once more, unannounced
    enough_error: float = Field(default=0.1, gt=0.0, le=10.0)
    unlabelled: int = Field(default=1000, ge=100, le=10_000)
    time_limit_s: Seconds | None = None
    auto_grasp: bool = False

    @model_validator(mode="after")
    def _exists(self) -> Self:
        if self.task not in TASKS:
            raise ValueError(f"there is no task '{self.task}'; choose one of {', '.join(TASKS)}")
        if self.repeats > self.labels:
            raise ValueError("no more questions can be repeated than are asked")
        if self.repeats and self.questions == "designed":
            raise ValueError("only random questions can be repeated: designed ones end early")
        return self


class Asked(_Part):
    """When which questionnaires are asked, by name."""

    after_each_strategy: tuple[Key, ...] = ()
    after_each_task: tuple[Key, ...] = ()
    at_the_end: tuple[Key, ...] = ()


class Completion(_Part):
    """What people get at the end, for a recruiting service."""

    message: str = Field(default="Thank you! You have done everything.", max_length=1000)
    code: str | None = Field(default=None, max_length=80)
    url: str | None = Field(default=None, max_length=500, pattern=r"^https://")


class Protocol(_Part):
    """Everything that a study decides."""

    title: Line
    tasks: tuple[TaskProtocol, ...] = Field(min_length=1, max_length=10)
    strategies: tuple[str, ...] = Field(default=(NO_ALIGN, "no-priors", "all-priors"), min_length=1)
    order: Literal["williams", "random", "fixed"] = "williams"
    drives: int = Field(default=1, ge=1, le=20)  # attempts under each strategy
    practice_s: FiniteFloat = Field(default=60.0, ge=0.0, le=3600.0)  # 0: no practice
    arrows: Literal["off", "on", "switch"] = "off"
    consent: Text = DEFAULT_CONSENT  # Markdown
    questionnaires: Asked = Asked()
    own_questionnaires: tuple[Questionnaire, ...] = Field(default=(), max_length=20)
    completion: Completion = Completion()
    # Whether the shared link takes people in by what a recruiting service calls them.
    external_ids: Literal["required", "optional", "none"] = "optional"
    participants: int | None = Field(default=None, ge=1, le=100_000)  # enrol no more than these
    # An attempt that a lost connection cut off: may be made again, or counts as it is.
    lost_drive: Literal["again", "counts"] = "again"
    drive_waits_s: Seconds = 5.0  # before a connection counts as lost
    abandoned_after_h: float = Field(
        default=168.0, gt=0.0, le=10_000.0
    )  # of silence: frees the place
    # Driving under whatever strategy, by name, without an end: to try Joymap out.
    is_free: bool = False

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        _refuse_twins([task.task for task in self.tasks], "tasks")
        _refuse_twins(list(self.strategies), "strategies")
        for name in self.strategies:
            if name not in (NO_ALIGN, *LEARNABLE):
                known = ", ".join((NO_ALIGN, *LEARNABLE))
                raise ValueError(f"there is no strategy '{name}'; choose from {known}")
        if self.is_free and len(self.tasks) > 1:
            raise ValueError("driving freely is for one task only")
        if not self.is_free:
            for task in self.tasks:
                if not TASKS[task.task].has_goal:
                    raise ValueError(f"'{task.task}' has no goal, so nobody can finish it")
        _refuse_twins([own.name for own in self.own_questionnaires], "own_questionnaires")
        return self


def _refuse_twins(names: list[str], where: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"'{name}' is there twice in {where}")
