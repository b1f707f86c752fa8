import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure

from app.analysis.pictures import COLOURS, save_figure
from app.analysis.simulation_figure import FLOOR, bars_figure, labels_figure
from models.experiment import METHODS
from tests.app.analysis.experiments import GOOD, labels_rows, make_row, paper_rows


def bars(panel: Axes) -> list[tuple[float, str, float]]:
    """Place, method and height of every bar, from left to right."""
    found = []
    for container in panel.containers:
        if isinstance(container, BarContainer) and len(container.patches) == 1:
            (bar,) = container.patches
            if np.isfinite(bar.get_height()):
                place = bar.get_x() + bar.get_width() / 2.0
                found.append((float(place), container.get_label(), float(bar.get_height())))
    return sorted(found)  # type: ignore[arg-type]


def caption(figure: Figure) -> str:
    return figure.get_suptitle()


def test_there_is_a_panel_a_task_a_group_a_noise_and_a_bar_a_method() -> None:
    figure = bars_figure(paper_rows(), 10.0)
    assert len(figure.axes) == 3
    for panel in figure.axes:
        found = bars(panel)
        assert len(found) == 9 * 3
        groups = [found[start : start + 9] for start in (0, 9, 18)]
        for place, group in enumerate(groups):
            assert [name for _, name, _ in group] == list(METHODS)
            assert np.mean([x for x, _, _ in group]) == pytest.approx(place)
        assert [label.get_text() for label in panel.get_xticklabels()] == ["0", "0.1", "0.5"]


def test_a_bar_is_the_mean_alignment_error_and_its_whisker_the_deviation() -> None:
    rows = [make_row(seed=seed, position_error=0.1 * (seed + 1)) for seed in range(3)]
    panel = bars_figure(rows, 10.0).axes[0]
    ((_, _, height),) = bars(panel)
    assert height == pytest.approx(0.22)
    (container,) = [c for c in panel.containers if isinstance(c, BarContainer) and c.errorbar]
    segments = container.errorbar.lines[2][0].get_segments()  # type: ignore[union-attr]
    assert segments[0][:, 1] == pytest.approx([0.11, 0.33])


def test_the_figure_says_its_weights_its_seeds_and_its_numbers_of_moves() -> None:
    figure = bars_figure(paper_rows(seeds=4), 7.5)
    assert "7.5/rad" in caption(figure)
    assert "n = 4 seeds" in caption(figure)
    assert "K = 20, N = 2000" in figure.axes[2].get_title()


def test_an_error_below_the_floor_gets_a_mark_and_no_bar() -> None:
    rows = paper_rows(GOOD | {"task-space": FLOOR / 50.0})
    panel = bars_figure(rows, 10.0).axes[0]
    assert "task-space" not in [name for _, name, _ in bars(panel)]
    marks = [line for line in panel.lines if line.get_marker() == "v"]
    assert [mark.get_color() for mark in marks] == [COLOURS["task-space"]] * 3


def test_every_bar_is_within_the_panel() -> None:
    rows = [make_row(position_error=0.05), make_row(task="pour", position_error=3.0)]
    figure = bars_figure(rows, 10.0)
    for panel in figure.axes:
        assert panel.get_ylim()[0] == FLOOR
        assert panel.get_ylim()[1] > 3.3


def test_what_else_is_varied_has_rows_of_panels() -> None:
    rows = [
        make_row(preference=preference, task=task)
        for preference in ("axes", "polar")
        for task in ("plane", "pour")
    ]
    titles = [panel.get_title() for panel in bars_figure(rows, 10.0).axes]
    assert len(titles) == 4
    assert sum("polar" in title for title in titles) == 2


def test_labels_are_drawn_with_a_line_for_each_method_and_choice_of_questions() -> None:
    panel = labels_figure(labels_rows(), 0.1).axes[0]
    lines = {str(line.get_label()): line for line in panel.lines}
    assert len(lines) == 6
    designed = lines["task-space, designed"]
    assert list(np.array(designed.get_xdata())) == [3, 5, 8, 10, 20]
    assert list(np.array(designed.get_ydata())) == pytest.approx(
        [0.1 / k for k in (3, 5, 8, 10, 20)]
    )
    assert designed.get_linestyle() == "-"
    assert lines["task-space, random"].get_linestyle() == "--"


def test_every_method_has_a_colour_of_its_own() -> None:
    assert list(COLOURS) == list(METHODS)
    assert len(set(COLOURS.values())) == len(METHODS)


def test_the_same_rows_give_the_same_files(tmp_path: Path) -> None:
    rows = paper_rows(tasks=["plane"], seeds=2)
    for name in ("first", "second"):
        save_figure(bars_figure(rows, 10.0), tmp_path / name)
    for ending in ("png", "pdf", "svg"):
        first, second = (tmp_path / f"{name}.{ending}" for name in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()
        assert not re.search(rb"CreationDate|dc:date", first.read_bytes())
