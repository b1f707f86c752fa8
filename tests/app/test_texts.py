"""Words for people: every task, phase, strategy and refusal has its own, and nothing else has."""

from typing import get_args

import pytest

from app import texts
from app.schemas.protocol import Protocol
from models.strategies import OURS, PAPER
from models.tasks import TASKS
from models.tasks.attempt import NoGrasp


def test_every_task_has_texts() -> None:
    missing = [name for name in TASKS if name not in texts.TASKS]
    assert not missing, f"Without texts: {missing}. Add each to TASKS in app/texts.py."
    assert set(texts.TASKS) == set(TASKS)
    assert len({each.title for each in texts.TASKS.values()}) == len(TASKS)


@pytest.mark.parametrize("task", [task for task in TASKS.values() if task.has_goal])
def test_every_phase_has_a_text(task) -> None:
    phases = texts.TASKS[task.name].phases
    missing = [phase.value for phase in task.phases if not phases.get(phase)]
    assert not missing, f"Phases of '{task.name}' without a text in app/texts.py: {missing}."
    assert set(phases) == set(task.phases)


def test_every_strategy_refusal_and_order_has_a_text() -> None:
    untitled = [each.name for each in (*PAPER, *OURS) if texts.STRATEGIES[each.name] == each.name]
    assert not untitled, f"Without a title in app/texts.py: {untitled}."
    assert set(texts.NO_GRASP) == set(NoGrasp)
    assert set(texts.ORDERS) == set(get_args(Protocol.model_fields["order"].annotation))
