"""The tasks by name."""

from ..errors import UnknownTaskError
from .avoid import AVOID
from .base import Task as Task
from .fetch_and_pour import FETCH_AND_POUR
from .plane import PLANE
from .pour import POUR
from .pour_cup import POUR_CUP
from .reach_and_pour import REACH_AND_POUR

TASKS: dict[str, Task] = {
    task.name: task for task in (PLANE, POUR, REACH_AND_POUR, AVOID, POUR_CUP, FETCH_AND_POUR)
}


def get_task(name: str) -> Task:
    """The task of that name.

    Raises:
        UnknownTaskError: If there is none.
    """
    if name not in TASKS:
        raise UnknownTaskError(f"There is no task '{name}'; choose one of: {', '.join(TASKS)}.")
    return TASKS[name]
