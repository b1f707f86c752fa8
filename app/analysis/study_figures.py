"""The user study's pictures, one function each, from an export alone.

Every picture that stands for numbers shows the people too: a point is a person. Brackets and
asterisks mark pairs that differ after correction (:mod:`app.analysis.comparisons`).
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app.analysis import study_values as values
from app.analysis.comparisons import Comparison, Values, compare
from app.analysis.measures import heat_map
from app.analysis.pictures import COLOURS, STYLE
from app.analysis.study_export import StudyExport
from models.alignment import STRATEGIES
from models.tasks import TASKS, get_task

_QUATERNION = ("hand_qw", "hand_qx", "hand_qy", "hand_qz")
_TICKS = ("raw_x", "raw_y", "hand_x", "hand_y", *_QUATERNION)
_WIDTH = 0.8  # of all bars of a group
_PATH_POINTS = 300  # of a hand's way; more are not seen
_POINT: dict[str, Any] = {"s": 9, "color": "black", "alpha": 0.45, "linewidths": 0, "zorder": 3}
# What a hand's way is drawn over: from above, or how far it turned where it goes to and fro.
_FROM_ABOVE = ("hand_y", "hand_x")
_TURNING = {"pour-cup": ("hand_x", "turned")}
_AXES = {"hand_x": "ahead [m]", "hand_y": "to the left [m]", "turned": "turned [°]"}


@dataclass(frozen=True)
class Picture:
    """A figure of a study.

    Attributes:
        name: Of its file.
        title: What it shows.
        says: What it shows, for who does not see it and for its caption.
        figure: The figure itself.
    """

    name: str
    title: str
    says: str
    figure: Figure


def comparisons(export: StudyExport, about: str | None = None) -> list[Comparison]:
    """Pairs of strategies under every measure, each measure corrected by itself.

    The items of a questionnaire stand where a measure's tasks do: they are corrected together.

    Args:
        export: The study's.
        about: Only pairs with this strategy, if the hypothesis is about it.
    """
    found = []
    for measure in values.OBJECTIVE:
        found += compare(measure.name, values.objective(export, measure), about)
    items = values.scale_items(export)
    for name in dict.fromkeys(item.questionnaire for item in items):
        asked = {item.key: item.values for item in items if item.questionnaire == name}
        found += compare(name, asked, about)
    return found


def pictures(export: StudyExport, found: Sequence[Comparison]) -> Iterator[Picture]:
    """Every picture that there are data for, with what was found of pairs of strategies."""
    rows = values.tries(export)
    if rows:
        yield _picture("objective", "Time, path and undo", _objective(export, found), (
            "For each task and strategy the mean over people, with the standard deviation and a "
            "point for each person; brackets join strategies that differ."
        ))  # fmt: skip
    items = values.scale_items(export)
    if items:
        yield _picture("responses", "What people said", _responses(items, found), (
            "For each item and strategy the mean over people of their mean over tasks, with the "
            "standard deviation and a point for each person; brackets join strategies that differ."
        ))  # fmt: skip
    if any(values.chosen(export).values()):
        yield _picture("preference", "What people chose", _preference(export), (
            "How often each strategy was chosen as the best one."
        ))  # fmt: skip
    if rows:
        ways, sticks = _drives(export)
        yield _picture("trajectories", "Where the hand went", _trajectories(rows, ways), (
            "For each task and strategy the hand's way in every try; a colour is a person."
        ))  # fmt: skip
        yield _picture("stick", "Where the stick was", _sticks(rows, sticks), (
            "For each task and strategy the share of the pushed time that the stick was in each "
            "cell of its square, as a mean over people."
        ))  # fmt: skip
    again = values.repeats(export)
    if again:
        yield _picture("consistency", "How alike people answered", _consistency(again), (
            "For each task the angle between the two answers to each question that was asked twice."
        ))  # fmt: skip
    curves = _curves(export)
    if curves:
        yield _picture("learning", "How the alignments were learned", _learning(curves), (
            "For each task the supervised loss of each strategy against the optimiser's steps, a "
            "line for each person."
        ))  # fmt: skip


def _picture(name: str, title: str, draw: Callable[[], Figure], says: str) -> Picture:
    with rc_context(STYLE):
        return Picture(name, title, says, draw())


def _objective(export: StudyExport, found: Sequence[Comparison]) -> Callable[[], Figure]:
    def draw() -> Figure:
        count = len(values.tasks_of(values.tries(export)))
        figure = Figure(figsize=(3.2 + 2.6 * count, 3.6), layout="constrained")
        panels = figure.subplots(1, len(values.OBJECTIVE))
        for panel, measure in zip(panels, values.OBJECTIVE, strict=True):
            tasks = values.objective(export, measure)
            _bars(panel, tasks, [each for each in found if each.measure == measure.name])
            panel.set_xticks(range(len(tasks)), [get_task(task).title for task in tasks])
            panel.set_ylabel(measure.title)
        _legend(figure, panels[0])
        return figure

    return draw


def _responses(
    items: Sequence[values.ScaleItem], found: Sequence[Comparison]
) -> Callable[[], Figure]:
    def draw() -> Figure:
        names = list(dict.fromkeys(item.questionnaire for item in items))
        widest = max(sum(item.questionnaire == name for item in items) for name in names)
        figure = Figure(figsize=(2.0 + 1.2 * widest, 3.2 * len(names)), layout="constrained")
        panels = figure.subplots(len(names), 1, squeeze=False)[:, 0]
        for panel, name in zip(panels, names, strict=True):
            groups = {item.key: item.values for item in items if item.questionnaire == name}
            _bars(panel, groups, [each for each in found if each.measure == name])
            panel.set_xticks(range(len(groups)), list(groups))
            panel.set_ylabel(name)
        _legend(figure, panels[0])
        return figure

    return draw


def _bars(panel: Axes, groups: Mapping[str, Values], found: Sequence[Comparison]) -> None:
    """Groups of bars, one for each strategy, with people as points and brackets where they differ.

    Args:
        panel: Where.
        groups: By what the comparisons call their task.
        found: The comparisons of these groups.
    """
    top = 0.0
    for place, (key, strategies) in enumerate(groups.items()):
        width = _WIDTH / max(1, len(strategies))
        x = {
            name: place + (index - (len(strategies) - 1) / 2) * width
            for index, name in enumerate(strategies)
        }
        highest = max(
            (_bar(panel, x[name], width, name, people) for name, people in strategies.items()),
            default=0.0,
        )
        for each in found:
            if each.task == key and each.is_significant:
                highest *= 1.08
                _bracket(panel, x[each.first], x[each.second], highest, _stars(each.p_holm))
        top = max(top, highest)
    panel.set_ylim(0.0, 1.1 * top if top else 1.0)
    _plain(panel)


def _bar(panel: Axes, x: float, width: float, strategy: str, people: Mapping[str, float]) -> float:
    """A bar with its people; how high it reaches."""
    if not people:
        return 0.0
    mean, deviation = values.mean_of(people)
    deviation = float(np.nan_to_num(deviation))
    panel.bar(
        x, mean, 0.92 * width, color=COLOURS[strategy], label=STRATEGIES[strategy].title,
        yerr=deviation, error_kw={"elinewidth": 0.8, "ecolor": "#333333"}, capsize=2,
    )  # fmt: skip
    spots = list(people.values())
    beside = np.linspace(-1.0, 1.0, len(spots)) if len(spots) > 1 else np.zeros(1)
    panel.scatter(x + 0.25 * width * beside, spots, **_POINT)
    return max(*spots, mean + deviation)


def _bracket(panel: Axes, left: float, right: float, height: float, mark: str) -> None:
    panel.plot([left, right], [height, height], color="#333333", linewidth=0.8)
    panel.annotate(mark, ((left + right) / 2, height), ha="center", va="center", fontsize=8.0,
                   xytext=(0, 2), textcoords="offset points")  # fmt: skip


def _stars(p: float) -> str:
    return "*" * (1 + (p < 0.01) + (p < 0.001))


def _preference(export: StudyExport) -> Callable[[], Figure]:
    def draw() -> Figure:
        counts = values.chosen(export)
        figure = Figure(figsize=(5.0, 0.8 + 0.4 * len(counts)), layout="constrained")
        panel = figure.subplots()
        panel.barh(
            [STRATEGIES[name].title for name in counts],
            list(counts.values()),
            color=[COLOURS[name] for name in counts],
        )
        panel.set_xlabel("times chosen")
        panel.invert_yaxis()
        _plain(panel)
        return figure

    return draw


_Ways = dict[tuple[str, str], list[tuple[str, dict[str, np.ndarray]]]]
_Sticks = dict[tuple[str, str], list[np.ndarray]]


def _drives(export: StudyExport) -> tuple[_Ways, _Sticks]:
    """The hand's ways and the stick's heat-maps by task and strategy, read once."""
    rows = {row["drive"]: row for row in values.tries(export)}
    ways: _Ways = {}
    sticks: _Sticks = {}
    for drive in export.ticks(_TICKS):
        row = rows.get(drive.drive)
        if row is None:
            continue
        key = (row["task"], row["strategy"])
        every = max(1, len(drive.columns["hand_x"]) // _PATH_POINTS)
        columns = drive.columns | {"turned": _turned(drive.columns)}
        way = {name: columns[name][::every] for name in _AXES}
        ways.setdefault(key, []).append((row["participant"], way))
        sticks.setdefault(key, []).append(heat_map(drive.columns))
    return ways, sticks


def _turned(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """How far the hand is turned from where it began, ``(n,)`` in [°]."""
    q = np.stack([columns[name] for name in _QUATERNION], axis=-1)
    angle: np.ndarray = np.degrees(2.0 * np.arccos(np.clip(np.abs(q @ q[0]), 0.0, 1.0)))
    return angle


def _grid(rows: values.Rows, size: float) -> tuple[Figure, Iterator[tuple[Axes, str, str]]]:
    """A panel for each task (a row, named at its left) and strategy (a column)."""
    tasks, strategies = values.tasks_of(rows), values.strategies_of(rows)
    figure = Figure(
        figsize=(0.6 + size * len(strategies), 0.6 + size * len(tasks)), layout="constrained"
    )
    panels = figure.subplots(len(tasks), len(strategies), squeeze=False, sharex="row", sharey="row")

    def cells() -> Iterator[tuple[Axes, str, str]]:
        for (line, task), (column, strategy) in product(enumerate(tasks), enumerate(strategies)):
            panel = panels[line, column]
            if line == 0:
                panel.set_title(STRATEGIES[strategy].title)
            yield panel, task, strategy
            if column == 0:
                panel.set_ylabel(f"$\\bf{{{_bold(get_task(task).title)}}}$\n{panel.get_ylabel()}")
            else:
                panel.set_ylabel("")

    return figure, cells()


def _bold(words: str) -> str:
    return words.replace(" ", r"\ ")


def _trajectories(rows: values.Rows, ways: _Ways) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure, cells = _grid(rows, 2.5)
        people = sorted({row["participant"] for row in rows})
        colours = {who: f"C{index % 10}" for index, who in enumerate(people)}
        for panel, task, strategy in cells:
            across, along = _TURNING.get(task, _FROM_ABOVE)
            for who, way in ways.get((task, strategy), []):
                panel.plot(way[across], way[along], color=colours[who], linewidth=0.7, alpha=0.7)
            if task not in _TURNING:
                panel.set_aspect("equal")
            panel.set_xlabel(_AXES[across])
            panel.set_ylabel(_AXES[along])
            if across == "hand_y" and not panel.xaxis_inverted():
                panel.invert_xaxis()  # the base's y points to the left
            _plain(panel)
        return figure

    return draw


def _sticks(rows: values.Rows, sticks: _Sticks) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure, cells = _grid(rows, 2.1)
        image: Any = None
        for panel, task, strategy in cells:
            maps = sticks.get((task, strategy), [])
            mean = np.mean(maps, axis=0) if maps else np.zeros((1, 1))
            # The root lets what is seldom be seen beside what is often.
            image = panel.imshow(
                np.sqrt(mean.T), origin="lower", extent=(-1, 1, -1, 1), cmap="viridis", vmin=0.0,
                vmax=0.4,
            )  # fmt: skip
            panel.set_xlabel("stick to the right")
            panel.set_ylabel("stick up")
        bar = figure.colorbar(image, ax=figure.axes, shrink=0.6, label="share of the pushed time")
        shares = np.array([0.0, 0.01, 0.04, 0.09, 0.16])
        bar.set_ticks(list(np.sqrt(shares)), labels=[f"{share:.0%}" for share in shares])
        return figure

    return draw


def _consistency(again: Sequence[values.Repeat]) -> Callable[[], Figure]:
    def draw() -> Figure:
        tasks = [name for name in TASKS if any(each.task == name for each in again)]
        people = sorted({each.participant for each in again})
        figure = Figure(figsize=(1.6 + 1.8 * len(tasks), 3.0), layout="constrained")
        panel = figure.subplots()
        for place, task in enumerate(tasks):
            here = [each for each in again if each.task == task]
            x = [place + 0.5 * (people.index(each.participant) / max(1, len(people) - 1) - 0.5)
                 for each in here]  # fmt: skip
            panel.scatter(x, [each.angle_deg for each in here], **_POINT)
            median = float(np.median([each.angle_deg for each in here]))
            panel.plot([place - 0.3, place + 0.3], [median, median], color=COLOURS["all-priors"])
            panel.annotate(f"median {median:.0f}°", (place, median), xytext=(0, 4), ha="center",
                           textcoords="offset points", fontsize=8.0)  # fmt: skip
        panel.set_xticks(range(len(tasks)), [get_task(task).title for task in tasks])
        panel.set_ylabel("angle between two answers [°]")
        panel.set_ylim(bottom=0.0)
        _plain(panel)
        return figure

    return draw


_Curves = dict[str, list[tuple[str, np.ndarray]]]


def _curves(export: StudyExport) -> _Curves:
    """By task: a strategy and ``(n, 2)`` steps and losses, for each person."""
    found: _Curves = {}
    for row in export.tables["trainings"]:
        for strategy, curve in json.loads(row.get("curves") or "{}").items():
            if len(curve) > 1:
                found.setdefault(row["task"], []).append((strategy, np.array(curve, dtype=float)))
    return found


def _learning(curves: _Curves) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure = Figure(figsize=(1.2 + 2.8 * len(curves), 3.0), layout="constrained")
        panels = figure.subplots(1, len(curves), squeeze=False, sharey=True)[0]
        for panel, (task, lines) in zip(panels, curves.items(), strict=True):
            for strategy, curve in lines:
                panel.plot(curve[:, 0], curve[:, 1], color=COLOURS[strategy], linewidth=0.7,
                           alpha=0.7, label=STRATEGIES[strategy].title)  # fmt: skip
            panel.set_yscale("log")
            panel.set_title(get_task(task).title)
            panel.set_xlabel("step")
            _plain(panel)
        panels[0].set_ylabel("supervised loss")
        _legend(figure, panels[0])
        return figure

    return draw


def _legend(figure: Figure, panel: Axes) -> None:
    handles, titles = panel.get_legend_handles_labels()
    once = dict(zip(titles, handles, strict=True))
    figure.legend(
        list(once.values()), list(once), loc="outside lower center", ncols=len(once), frameon=False
    )


def _plain(panel: Axes) -> None:
    panel.set_axisbelow(True)
    panel.grid(axis="y", color="#dddddd", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)
