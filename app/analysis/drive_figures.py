"""Where hand and stick were in a study: the pictures that are drawn from the ticks of drives."""

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app import texts
from app.analysis import study_values as values
from app.analysis.measures import heat_map
from app.analysis.pictures import plain
from app.analysis.study_export import StudyExport

_QUATERNION = ("hand_qw", "hand_qx", "hand_qy", "hand_qz")
_TICKS = ("raw_x", "raw_y", "hand_x", "hand_y", *_QUATERNION)
_PATH_POINTS = 300  # of a hand's way; more are not seen
# What a hand's way is drawn over: from above, or how far it turned where it goes to and fro.
_FROM_ABOVE = ("hand_y", "hand_x")
_TURNING = {"pour-cup": ("hand_x", "turned")}
_AXES = {"hand_x": "ahead [m]", "hand_y": "to the left [m]", "turned": "turned [°]"}

Ways = dict[tuple[str, str], list[tuple[str, dict[str, np.ndarray]]]]
Sticks = dict[tuple[str, str], list[np.ndarray]]


def read_drives(export: StudyExport) -> tuple[Ways, Sticks]:
    """The hand's ways and the stick's heat-maps by task and strategy, read once."""
    rows = {row["drive"]: row for row in values.tries(export)}
    ways: Ways = {}
    sticks: Sticks = {}
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
                panel.set_title(texts.STRATEGIES[strategy])
            yield panel, task, strategy
            if column == 0:
                panel.set_ylabel(f"$\\bf{{{_bold(texts.title_of(task))}}}$\n{panel.get_ylabel()}")
            else:
                panel.set_ylabel("")

    return figure, cells()


def _bold(words: str) -> str:
    return words.replace(" ", r"\ ")


def trajectories(rows: values.Rows, ways: Ways) -> Callable[[], Figure]:
    """The hand's way in every try, a panel for each task and strategy."""

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
            plain(panel)
        return figure

    return draw


def heat_maps(rows: values.Rows, sticks: Sticks) -> Callable[[], Figure]:
    """How long the stick was where, a panel for each task and strategy."""

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
