"""What a protocol asks of a person, step after step; nothing here knows a database.

A protocol and a cell (the order of the strategies) make a list of steps::

    consent → practice → for each task: queries → training → for each strategy: drive → questions
            → questions on the task → questions at the end → end
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from app.schemas.protocol import Protocol
from app.services import counterbalancing

Kind = Literal["consent", "practice", "queries", "training", "driving", "block", "questions", "end"]


@dataclass(frozen=True)
class Step:
    """One thing to do.

    Attributes:
        key: Names it in records: ``"queries/avoid"``, ``"block/avoid/2"``, ``"questions/end/sus"``.
        kind: What the page has to show.
        task: The robot task it is about, if any.
        strategies: What is driven under, for the server alone; a block's is one.
        position: Which of the task's blocks it is or follows, from 1.
        questionnaire: The name of the questionnaire asked.
    """

    key: str
    kind: Kind
    task: str | None = None
    strategies: tuple[str, ...] = ()
    position: int | None = None
    questionnaire: str | None = None


LAST = Step("end", "end")


@lru_cache(maxsize=256)
def steps_of(protocol: Protocol, cell: int) -> tuple[Step, ...]:
    """All steps of a protocol, in order, for people of this cell."""
    order = order_of(protocol, cell)
    asked = protocol.questionnaires
    steps = [Step("consent", "consent")]
    if protocol.practice_s > 0.0:
        steps.append(Step("practice", "practice"))
    for task in (each.task for each in protocol.tasks):
        steps += [
            Step(f"queries/{task}", "queries", task),
            Step(f"training/{task}", "training", task),
        ]
        if protocol.is_free:
            return (*steps, Step("driving", "driving", task, order))
        for position, strategy in enumerate(order, start=1):
            steps.append(Step(f"block/{task}/{position}", "block", task, (strategy,), position))
            steps += _questions(f"{task}/{position}", asked.after_each_strategy, task, position)
        steps += _questions(f"{task}/after", asked.after_each_task, task)
    steps += _questions("end", asked.at_the_end)
    return (*steps, LAST)


def _questions(
    when: str, names: tuple[str, ...], task: str | None = None, position: int | None = None
) -> list[Step]:
    """A step for each questionnaire; in protocols kept long ago one may be there several times."""
    steps = []
    for index, name in enumerate(names):
        before = names[:index].count(name)
        key = f"questions/{when}/{name}" + (f"/{before + 1}" if before else "")
        steps.append(Step(key, "questions", task, (), position, name))
    return steps


def order_of(protocol: Protocol, cell: int) -> tuple[str, ...]:
    """The order of the strategies in this cell."""
    every = counterbalancing.orders(protocol.order, protocol.strategies)
    return every[cell % len(every)]
