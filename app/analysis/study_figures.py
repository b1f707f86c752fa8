"""The user study's pictures, one function each, from an export alone.

Every picture that stands for numbers shows the people too: a point is a person. Brackets and
asterisks mark pairs that differ after correction (:mod:`app.analysis.comparisons`).
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from statistics import fmean
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from app import texts
from app.analysis import study_values as values
from app.analysis.comparisons import Comparison, Values, compare
from app.analysis.drive_figures import heat_maps, read_drives, trajectories
from app.analysis.pictures import COLOURS, STYLE, legend_below, plain
from app.analysis.study_export import StudyExport
from models.tasks import TASKS

_WIDTH = 0.8  # of all bars of a group
_POINT: dict[str, Any] = {"s": 9, "color": "black", "alpha": 0.45, "linewidths": 0, "zorder": 3}


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
        ways, sticks = read_drives(export)
        yield _picture("trajectories", "Where the hand went", trajectories(rows, ways), (
            "For each task and strategy the hand's way in every try; a colour is a person."
        ))  # fmt: skip
        yield _picture("stick", "Where the stick was", heat_maps(rows, sticks), (
            "For each task and strategy the share of the pushed time that the stick was in each "
            "cell of its square, as a mean over people."
        ))  # fmt: skip
    times = values.each_try(export, values.OBJECTIVE[0])
    if _most_tries(times) > 1:
        yield _picture("tries", "From try to try", _tries(times), (
            "For each task and strategy the time of the first try, of the second, and so on: the "
            "mean over people, and a thin line for each person."
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
            panel.set_xticks(range(len(tasks)), [texts.title_of(task) for task in tasks])
            panel.set_ylabel(measure.title)
        legend_below(figure, panels[0])
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
        legend_below(figure, panels[0])
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
    plain(panel)


def _bar(panel: Axes, x: float, width: float, strategy: str, people: Mapping[str, float]) -> float:
    """A bar with its people; how high it reaches."""
    if not people:
        return 0.0
    mean, deviation = values.mean_of(people)
    deviation = float(np.nan_to_num(deviation))
    panel.bar(
        x, mean, 0.92 * width, color=COLOURS[strategy], label=texts.STRATEGIES[strategy],
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
            [texts.STRATEGIES[name] for name in counts],
            list(counts.values()),
            color=[COLOURS[name] for name in counts],
        )
        panel.set_xlabel("times chosen")
        panel.invert_yaxis()
        plain(panel)
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
        panel.set_xticks(range(len(tasks)), [texts.title_of(task) for task in tasks])
        panel.set_ylabel("angle between two answers [°]")
        panel.set_ylim(bottom=0.0)
        plain(panel)
        return figure

    return draw


def _most_tries(tasks: values.Tries) -> int:
    counts = [
        len(made)
        for strategies in tasks.values()
        for people in strategies.values()
        for made in people.values()
    ]
    return max(counts, default=0)


def _tries(tasks: values.Tries) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure = Figure(figsize=(1.2 + 2.4 * len(tasks), 3.0), layout="constrained")
        panels = figure.subplots(1, len(tasks), squeeze=False, sharey=True)[0]
        for panel, (task, strategies) in zip(panels, tasks.items(), strict=True):
            for strategy, people in strategies.items():
                for made in people.values():
                    panel.plot(range(1, 1 + len(made)), made, color=COLOURS[strategy],
                               linewidth=0.6, alpha=0.5)  # fmt: skip
                each = list(zip_longest(*people.values()))
                means = [fmean(time for time in times if time is not None) for times in each]
                panel.plot(range(1, 1 + len(means)), means, "o-", color=COLOURS[strategy], ms=4,
                           linewidth=2.0, label=texts.STRATEGIES[strategy])  # fmt: skip
            panel.set_title(texts.title_of(task))
            panel.set_xlabel("try")
            panel.xaxis.set_major_locator(MaxNLocator(integer=True))
            panel.set_ylim(bottom=0.0)
            plain(panel)
        panels[0].set_ylabel(values.OBJECTIVE[0].title)
        legend_below(figure, panels[0])
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
                           alpha=0.7, label=texts.STRATEGIES[strategy])  # fmt: skip
            panel.set_yscale("log")
            panel.set_title(texts.title_of(task))
            panel.set_xlabel("step")
            plain(panel)
        panels[0].set_ylabel("supervised loss")
        legend_below(figure, panels[0])
        return figure

    return draw
