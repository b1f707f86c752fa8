"""What an export says of each person under each strategy: the numbers that are compared."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import fmean
from typing import Any

import numpy as np

from app.analysis.comparisons import Values
from app.analysis.study_export import StudyExport
from models.strategies import STRATEGIES
from models.tasks import TASKS

MADE = ("done", "given up", "time limit")  # ends of tries that a person made to an end
Rows = list[dict[str, Any]]
# Of every task, strategy and participant: a value for each try.
Tries = dict[str, dict[str, dict[str, list[float]]]]


@dataclass(frozen=True)
class Measure:
    """A number that is less for a better strategy.

    Attributes:
        name: As in the table of drives.
        title: For people, with the unit.
        word: In a sentence.
        scale: What the number is multiplied by for people.
    """

    name: str
    title: str
    word: str
    scale: float = 1.0


OBJECTIVE = (
    Measure("completion_time_s", "time [s]", "time"),
    Measure("path_length_m", "path length [m]", "path length"),
    Measure("undo_share", "undo [% of the time]", "undo share", 100.0),
)


def tries(export: StudyExport) -> Rows:
    """The drives that were made to an end; what a lost line cut off is none."""
    return [row for row in export.tables["drives"] if row["end"] in MADE and row["ticks"]]


def tasks_of(rows: Rows) -> list[str]:
    """The tasks that occur, in the order in which Joymap has them."""
    found = {row["task"] for row in rows}
    return [name for name in TASKS if name in found]


def strategies_of(rows: Rows) -> list[str]:
    """The strategies that occur, in the order in which Joymap has them."""
    found = {row["strategy"] for row in rows}
    return [name for name in STRATEGIES if name in found]


def each_try(export: StudyExport, measure: Measure) -> Tries:
    """A measure by task, strategy and participant: of each of their tries, in their order.

    A try that came to nothing counts with the time that there was, or whoever gives up at once
    would be the fastest: the protocol's limit, or as long as the longest try at that task.
    """
    rows = tries(export)
    limits = _limits(export, rows)
    found: Tries = {
        task: {strategy: {} for strategy in strategies_of(rows)} for task in tasks_of(rows)
    }
    for row in rows:
        value = row[measure.name]
        if measure.name == "completion_time_s" and not row["is_success"]:
            value = max(value, limits[row["participant"], row["task"]])
        per_person = found[row["task"]][row["strategy"]]
        per_person.setdefault(row["participant"], []).append(measure.scale * value)
    return found


def objective(export: StudyExport, measure: Measure) -> dict[str, Values]:
    """A measure by task, strategy and participant: the mean over their tries."""
    return {
        task: {
            strategy: {who: fmean(made) for who, made in people.items()}
            for strategy, people in strategies.items()
        }
        for task, strategies in each_try(export, measure).items()
    }


def successes(export: StudyExport) -> dict[str, dict[str, tuple[int, int]]]:
    """By task and strategy: in how many tries the task was achieved, of how many."""
    rows = tries(export)
    found = {}
    for task in tasks_of(rows):
        here = [row for row in rows if row["task"] == task]
        found[task] = {
            strategy: (
                sum(bool(row["is_success"]) for row in here if row["strategy"] == strategy),
                sum(row["strategy"] == strategy for row in here),
            )
            for strategy in strategies_of(rows)
        }
    return found


@dataclass(frozen=True)
class ScaleItem:
    """An item on a scale that was answered for each strategy.

    Attributes:
        questionnaire: Its name.
        key: The item's key.
        values: What each person said of each strategy, as a mean over the tasks.
    """

    questionnaire: str
    key: str
    values: Values


def scale_items(export: StudyExport) -> list[ScaleItem]:
    """Every item on a scale that was asked after each strategy."""
    rows = [
        row
        for row in export.tables["responses"]
        if row["strategy"] is not None and row["number"] is not None
    ]
    strategies = strategies_of(rows)
    found: dict[tuple[str, str], dict[str, dict[str, list[float]]]] = {}
    for row in rows:
        values = found.setdefault(
            (row["questionnaire"], row["item"]), {strategy: {} for strategy in strategies}
        )
        values[row["strategy"]].setdefault(row["participant"], []).append(float(row["number"]))
    return [
        ScaleItem(
            questionnaire,
            item,
            {
                strategy: {who: fmean(said) for who, said in people.items()}
                for strategy, people in values.items()
            },
        )
        for (questionnaire, item), values in found.items()
    ]


def chosen(export: StudyExport) -> dict[str, int]:
    """How often each strategy was chosen where one was to be chosen."""
    rows = [row for row in export.tables["responses"] if row["chosen"] is not None]
    offered = strategies_of(tries(export))
    return {name: sum(row["chosen"] == name for row in rows) for name in offered}


@dataclass(frozen=True)
class Repeat:
    """A question that was asked twice.

    Attributes:
        participant: Who.
        task: Where.
        angle_deg: Between the two answers, in [0°, 180°].
        length: The second answer's length less the first one's.
    """

    participant: str
    task: str
    angle_deg: float
    length: float


def repeats(export: StudyExport) -> list[Repeat]:
    """Every question that was answered twice, with a direction both times."""
    given = {
        row["query"]: np.array([row["h_x"], row["h_y"]])
        for row in export.tables["answers"]
        if row["counts"] and row["h_x"] is not None
    }
    found = []
    for row in export.tables["queries"]:
        first, second = given.get(row["repeats"]), given.get(row["query"])
        if first is None or second is None or not (first.any() and second.any()):
            continue
        turn = complex(*second) / complex(*first)
        found.append(
            Repeat(
                row["participant"],
                row["task"],
                float(abs(np.angle(turn, deg=True))),
                float(np.linalg.norm(second) - np.linalg.norm(first)),
            )
        )
    return found


def mean_of(people: Mapping[str, float]) -> tuple[float, float]:
    """Mean and standard deviation over people; NaN where there are too few."""
    values = np.array(list(people.values()))
    mean = float(values.mean()) if len(values) else float("nan")
    return mean, float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def _limits(export: StudyExport, rows: Rows) -> dict[tuple[str, str], float]:
    longest = {task: _longest(rows, task) for task in tasks_of(rows)}
    limits = {}
    for person in export.tables["participants"]:
        protocol = export.protocols[person["protocol_version"]]
        for task in protocol["tasks"]:
            name = task["task"]
            limit = task.get("time_limit_s") or longest.get(name, 0.0)
            limits[person["participant"], name] = limit
    return limits


def _longest(rows: Iterable[Mapping[str, Any]], task: str) -> float:
    return max(float(row["completion_time_s"]) for row in rows if row["task"] == task)
