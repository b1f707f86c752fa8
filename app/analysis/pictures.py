"""What all pictures share: a colour a strategy, and files that are the same for the same data."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.strategies import STRATEGIES

# Okabe and Ito's colours for all eyes (https://jfly.uni-koeln.de/color), greys for what learns
# nothing and black for what is given everything.
_PAPER_AND_OURS = {
    "no-align": "#bbbbbb",
    "manual-align": "#777777",
    "no-priors": "#e69f00",
    "proportionality": "#56b4e9",
    "reversibility": "#0072b2",
    "consistency": "#009e73",
    "all-priors": "#d55e00",
    "ideal-align": "#000000",
    "task-space": "#cc79a7",
}
# Those that other packages bring take turns.
_OTHERS = ("#f0e442", "#882255", "#44aa99", "#999933")
COLOURS = {
    name: _PAPER_AND_OURS.get(name, _OTHERS[place % len(_OTHERS)])
    for place, name in enumerate(STRATEGIES)
}
ENDINGS = ("png", "pdf", "svg")
STYLE: dict[Any, Any] = {
    "svg.hashsalt": "joymap",
    "svg.fonttype": "none",
    "font.size": 9.0,
    "pdf.fonttype": 42,
}
# Without these every file would say when it was made, and by which version.
_NO_DATES: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None, "Creator": None},
}


def save_figure(figure: Figure, stem: Path, endings: Sequence[str] = ENDINGS) -> list[Path]:
    """Write a figure as ``STEM.png`` and so on; same figure, same bytes.

    Args:
        figure: What to write.
        stem: The files' path without their ending.
        endings: Of "png", "pdf" and "svg".
    """
    paths = [stem.parent / f"{stem.name}.{ending}" for ending in endings]
    with rc_context(STYLE):
        # Once for all files: finding the layout is what takes the time.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for path, ending in zip(paths, endings, strict=True):
            figure.savefig(path, format=ending, dpi=150, metadata=_NO_DATES[ending])
    return paths


def legend_below(figure: Figure, panel: Axes) -> None:
    """What the colours of a panel mean, once each, below all panels."""
    handles, titles = panel.get_legend_handles_labels()
    once = dict(zip(titles, handles, strict=True))
    figure.legend(
        list(once.values()), list(once), loc="outside lower center", ncols=len(once), frameon=False
    )


def plain(panel: Axes) -> None:
    """Nothing but faint lines across and the two axes."""
    panel.set_axisbelow(True)
    panel.grid(axis="y", color="#dddddd", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)
