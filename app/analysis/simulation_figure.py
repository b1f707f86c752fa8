"""Pictures of simulation rows: the paper's figure, and errors against the number of labels."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app import texts
from app.analysis.pictures import COLOURS, STYLE
from app.analysis.simulation_rows import distinct, select, spread, values
from models.experiment import METHODS, Row

_GROUP_WIDTH = 0.86  # of the distance between two noise levels
_WIDEST_BAR = 0.2
# Nobody sees an error of a thousandth of the move. Bars begin here; what is lower gets a mark.
FLOOR = 1e-3
# What a row of panels may stand for, beside the paper's one.
_ROW_FACTORS = ("controller", "preference", "queries", "wrong_answers", "labels", "unlabelled")


def bars_figure(rows: Sequence[Row], rotation_weight: float) -> Figure:
    """The paper's figure: a panel a task, a group of bars a noise level, a bar a method.

    Where more is varied than that, there is a row of panels for every combination.

    Args:
        rows: At least one.
        rotation_weight: Of the alignment errors in the rows, in [1/rad]; it is stated.
    """
    tasks = distinct(rows, "task")
    # K and N belong to the task where a task has but one of them.
    varied = [
        name
        for name in _ROW_FACTORS
        if any(len(distinct(select(rows, task=task), name)) > 1 for task in tasks)
    ]
    lines = list(product(*(distinct(rows, name) for name in varied)))
    with rc_context(STYLE):
        figure = Figure(
            figsize=(1.5 + 3.9 * len(tasks), 1.4 + 2.7 * len(lines)), layout="constrained"
        )
        panels = figure.subplots(len(lines), len(tasks), sharey=True, squeeze=False)
        for (line, combination), (column, task) in product(enumerate(lines), enumerate(tasks)):
            chosen = dict(zip(varied, combination, strict=True))
            shown = select(rows, task=task, **chosen)
            _bars(panels[line, column], shown, str(task), chosen)
        for panel in panels[:, 0]:
            panel.set_ylabel("alignment error")
        # Shared by all panels; set last, since it ends the search for limits that fit.
        panels[0, 0].set_ylim(bottom=FLOOR)
        figure.suptitle(_caption(rows, rotation_weight), fontsize=9.0)
        methods = [name for name in METHODS if name in distinct(rows, "method")]
        handles = [panels[0, 0].bar([np.nan], [np.nan], color=COLOURS[name]) for name in methods]
        figure.legend(
            handles,
            methods,
            loc="outside lower center",
            ncols=len(methods),
            frameon=False,
            handlelength=1.0,
            columnspacing=1.2,
        )
    return figure


def labels_figure(rows: Sequence[Row], noise: float) -> Figure:
    """Position error against the number of labels: a panel a task, a line a method and a choice.

    Args:
        rows: At least one of that noise.
        noise: The only noise level shown.
    """
    rows = select(rows, noise=noise)
    tasks = distinct(rows, "task")
    with rc_context(STYLE):
        figure = Figure(figsize=(1.5 + 3.2 * len(tasks), 3.6), layout="constrained")
        panels = figure.subplots(1, len(tasks), sharey=True, squeeze=False)[0]
        for panel, task in zip(panels, tasks, strict=True):
            for method, queries in product(distinct(rows, "method"), distinct(rows, "queries")):
                line = select(rows, task=task, method=method, queries=queries)
                _line(panel, line, str(method), str(queries))
            panel.set_title(texts.title_of(str(task)))
            panel.set_xlabel("labels K")
        panels[0].set_ylabel("position error $E_d$")
        seeds = len(distinct(rows, "seed"))
        figure.suptitle(
            f"Label noise {noise:g}, mean of {seeds} seeds; dashed: random questions, "
            "solid: designed ones",
            fontsize=9.0,
        )
        handles, titles = panels[0].get_legend_handles_labels()
        figure.legend(handles, titles, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _bars(panel: Axes, rows: Sequence[Row], task: str, chosen: dict[str, object]) -> None:
    noises, methods = distinct(rows, "noise"), distinct(rows, "method")
    present = [name for name in METHODS if name in methods]
    width = min(_GROUP_WIDTH / len(present), _WIDEST_BAR)
    for place, method in enumerate(present):
        offset = (place - (len(present) - 1) / 2) * width
        for group, noise in enumerate(noises):
            found = values(select(rows, method=method, noise=noise), "alignment_error")
            if len(found):
                _bar(panel, group + offset, width, found, method)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter("{x:g}")
    panel.set_xticks(range(len(noises)), [f"{noise:g}" for noise in noises])
    panel.set_xlabel("label noise σ/μ")
    panel.set_axisbelow(True)
    panel.grid(axis="y", color="#dddddd", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)
    panel.set_title(_title(rows, task, chosen))


def _bar(panel: Axes, x: float, width: float, found: np.ndarray, method: str) -> None:
    shown, colour = spread(found), COLOURS[method]
    if shown.mean < FLOOR:
        panel.plot(x, 1.25 * FLOOR, "v", markersize=4, color=colour, clip_on=False)
        return
    deviation = shown.sd or 0.0
    # On a logarithmic axis a whisker cannot go down to zero: it ends at the floor.
    down = min(deviation, shown.mean - FLOOR)
    panel.bar(
        x, shown.mean, width, color=colour, edgecolor="white", linewidth=0.3, label=method,
        yerr=[[down], [deviation]], error_kw={"elinewidth": 0.7, "ecolor": "#444444"}, capsize=1.2,
    )  # fmt: skip


def _line(panel: Axes, rows: Sequence[Row], method: str, queries: str) -> None:
    counts = sorted({row.labels for row in rows})
    means = [values(select(rows, labels=k), "position_error").mean() for k in counts]
    dashes = "--" if queries == "random" else "-"
    panel.plot(
        counts, means, dashes, marker="o", markersize=3, color=COLOURS[method],
        label=f"{method}, {queries}",
    )  # fmt: skip
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter("{x:g}")
    panel.set_xticks(counts, [str(k) for k in counts])
    panel.minorticks_off()
    panel.grid(color="#dddddd", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def _title(rows: Sequence[Row], task: str, chosen: dict[str, object]) -> str:
    title = texts.title_of(task)
    facts = [f"{name.replace('_', ' ')} {value}" for name, value in chosen.items()
             if name not in ("labels", "unlabelled")]  # fmt: skip
    if rows:
        facts += [f"K = {rows[0].labels}, N = {rows[0].unlabelled}"]
    return f"{title}\n{', '.join(facts)}"


def _caption(rows: Sequence[Row], rotation_weight: float) -> str:
    seeds = len(distinct(rows, "seed"))
    return (
        f"alignment error = position error $E_d$ + {rotation_weight:g}/rad × rotation error $E_r$;"
        f" mean and standard deviation of n = {seeds} {'seed' if seeds == 1 else 'seeds'};"
        f" K labels, N unlabelled states; ▾: below {FLOOR:g}"
    )
