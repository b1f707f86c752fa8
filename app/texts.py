"""What people read of tasks, strategies and orders: titles, what to do now, and refusals.

The learning core has names and phases, and no words for people; a task's words are here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from models import strategies
from models.tasks import get_task
from models.tasks.attempt import NoGrasp, Phase
from models.tasks.avoid import AvoidPhase
from models.tasks.fetch_and_pour import FetchPhase
from models.tasks.pour_cup import PourCupPhase

_SPILT = "Over: too much went astray."


@dataclass(frozen=True)
class TaskTexts:
    """The words for one task.

    Attributes:
        title: Its title.
        phases: For each of its phases what to do, or how it ended; none for a task without a goal.
        learned_field: What the picture of a learned field shows.
    """

    title: str
    phases: Mapping[Phase, str] = field(default_factory=dict)
    learned_field: str = (
        "From above, with the robot standing at the bottom: where the hand goes from each place "
        "when you push"
    )


TASKS: Mapping[str, TaskTexts] = MappingProxyType(
    {
        "plane": TaskTexts("Move in a plane"),
        "pour": TaskTexts("Pour"),
        "reach-and-pour": TaskTexts("Reach and pour"),
        "avoid": TaskTexts(
            "Go round",
            {
                AvoidPhase.CLOCKWISE: "Go once round the post, clockwise.",
                AvoidPhase.COUNTER_CLOCKWISE: "Now once round counter-clockwise.",
                AvoidPhase.DONE: "Done: once round, and back.",
            },
        ),
        "pour-cup": TaskTexts(
            "Pour a cup",
            {
                PourCupPhase.POUR_FAR: "Pour the cup into the far bowl.",
                PourCupPhase.REFILL: (
                    "Bring the cup back between the bowls, upright: there it is filled again."
                ),
                PourCupPhase.POUR_NEAR: "Pour the cup into the near bowl.",
                PourCupPhase.DONE: "Done: both bowls are served.",
                PourCupPhase.SPILT: _SPILT,
            },
            learned_field=(
                "Up on the picture the hand reaches farther, to the left it tilts the cup "
                "farther: what it does from each place when you push"
            ),
        ),
        "fetch-and-pour": TaskTexts(
            "Fetch and pour",
            {
                FetchPhase.REACH: "Bring the hand to the cup, then grasp it.",
                FetchPhase.LOWER: "The hand takes the cup.",
                FetchPhase.LIFT: "The hand takes the cup.",
                FetchPhase.POUR: "Pour the cup into the bowl.",
                FetchPhase.DONE: "Done: the bowl is served.",
                FetchPhase.SPILT: _SPILT,
            },
        ),
    }
)

_STRATEGY_TITLES = MappingProxyType(
    {
        "no-align": "No alignment",
        "manual-align": "Best affine map",
        "no-priors": "Answers only",
        "proportionality": "Answers and proportionality",
        "reversibility": "Answers and reversibility",
        "consistency": "Answers and consistency",
        "all-priors": "Answers and priors",
        "ideal-align": "Every answer",
        "task-space": "Preference and known arm",
    }
)
# As experimenters know them, in figures and tables; participants may be told other names. One that
# another package brings goes by its name.
STRATEGIES: Mapping[str, str] = MappingProxyType(
    {name: _STRATEGY_TITLES.get(name, name) for name in strategies.STRATEGIES}
)

ORDERS: Mapping[str, str] = MappingProxyType(
    {
        "williams": "Williams design (balanced)",
        "random": "Every order",
        "fixed": "Always the same",
    }
)

NO_GRASP: Mapping[NoGrasp, str] = MappingProxyType(
    {
        NoGrasp.NOTHING_TO_GRASP: "There is nothing to grasp in this task.",
        NoGrasp.OUT_OF_REACH: "There is nothing to grasp here: bring the hand to the cup.",
        NoGrasp.ALREADY_HELD: "The cup is in the hand already.",
    }
)


def of_task(name: str) -> TaskTexts:
    """The words for a task.

    Raises:
        UnknownTaskError: If there is no such task.
    """
    return TASKS[get_task(name).name]


def title_of(task: str) -> str:
    """A task's title.

    Raises:
        UnknownTaskError: If there is no such task.
    """
    return of_task(task).title
