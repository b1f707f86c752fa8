"""What a protocol can be made of, and the protocol that a new study begins with."""

from app import texts
from app.schemas.choices import ChoiceOut, ChoicesOut, StrategyChoiceOut, TaskChoiceOut
from app.schemas.protocol import LEARNABLE, NO_ALIGN, TaskProtocol
from app.services import protocols, questionnaires
from models.tasks import TASKS

# The paper's user study.
TEMPLATE = protocols.parse(
    {
        "title": "Which way of steering do people prefer?",
        "tasks": [
            {"task": "avoid", "labels": 7, "time_limit_s": 120},
            {"task": "pour-cup", "labels": 10, "time_limit_s": 180},
            {"task": "fetch-and-pour", "labels": 30, "unlabelled": 2000, "time_limit_s": 180},
        ],
        "strategies": ["no-align", "no-priors", "all-priors"],
        "order": "williams",
        "participants": 12,
        "questionnaires": {
            "after_each_strategy": ["steering"],
            "after_each_task": ["preference"],
            "at_the_end": [],
        },
    }
)


def choices() -> ChoicesOut:
    """Everything there is to choose from, in the order in which it is offered."""
    return ChoicesOut(
        tasks=[_task(name) for name in TASKS],
        strategies=[
            StrategyChoiceOut(name=name, title=texts.STRATEGIES[name], is_learned=name != NO_ALIGN)
            for name in (NO_ALIGN, *LEARNABLE)
        ],
        orders=[ChoiceOut(name=name, title=title) for name, title in texts.ORDERS.items()],
        questionnaires=[
            ChoiceOut(name=each.name, title=each.title) for each in questionnaires.LIBRARY.values()
        ],
        template=TEMPLATE,
    )


def _task(name: str) -> TaskChoiceOut:
    asked = TaskProtocol(task=name)
    return TaskChoiceOut(
        name=name,
        title=texts.title_of(name),
        has_goal=TASKS[name].has_goal,
        labels=asked.labels,
        unlabelled=asked.unlabelled,
    )
