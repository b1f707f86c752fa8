"""How many participants a study needs: studies of every size, drawn from people who drove.

The power of a study is how often one like it shows a difference that is there. Here a study's
people are drawn without replacement from a pool, its two strategies are compared by the test that
a real study is reported with (:mod:`app.analysis.comparisons`), and studies are counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from statsmodels.stats.proportion import proportion_confint

from app.analysis.comparisons import p_of, rank_biserial
from app.analysis.pictures import COLOURS, STYLE

POOL_FACTOR = 2  # studies of more than half of the pool would be all but the same
_SIZE = (5.6, 3.4)


@dataclass(frozen=True)
class Power:
    """Of studies of one size.

    Attributes:
        people: In each study.
        studies: How many were drawn.
        shown: In how many of them the first strategy is significantly better.
    """

    people: int
    studies: int
    shown: int

    @property
    def share(self) -> float:
        """The power: of the studies, how many show it."""
        return self.shown / self.studies

    @property
    def interval(self) -> tuple[float, float]:
        """What the share may be, given that so many studies were drawn: Wilson's, 95 %."""
        low, high = proportion_confint(self.shown, self.studies, alpha=0.05, method="wilson")
        return float(low), float(high)


def powers(
    differences: np.ndarray, sizes: Sequence[int], studies: int, level: float, seed: int
) -> list[Power]:
    """The power of studies of each size; a size's is the same whatever other sizes there are.

    Args:
        differences: ``(pool,)``, a person's value under the first strategy minus the second's;
            lower is better.
        sizes: At most half of the pool each.
        studies: How many to draw of each size.
        level: A difference is shown if p is below it.
        seed: All chance.

    Raises:
        ValueError: If the pool is too small.
    """
    if POOL_FACTOR * max(sizes) > len(differences):
        raise ValueError(f"Studies of {max(sizes)} cannot be drawn from {len(differences)}.")
    found = []
    for size in sizes:
        rng = np.random.default_rng([seed, size])
        drawn = [rng.choice(differences, size, replace=False) for _ in range(studies)]
        shown = sum(p_of(each) < level and bool(rank_biserial(each) < 0.0) for each in drawn)
        found.append(Power(size, studies, shown))
    return found


def says(found: Sequence[Power], wanted: float) -> str:
    """The answer, in a sentence: the smallest size with the power that is wanted."""
    enough = next((each for each in found if each.share >= wanted), None)
    if enough is None:
        return f"No size up to {found[-1].people} shows it in {_percent(wanted)} of studies."
    low, high = enough.interval
    smaller = (
        "fewer were not tried"
        if enough is found[0]
        else f"of the smaller sizes that were tried none does so in {_percent(wanted)}"
    )
    return (
        f"{enough.people} participants show it in {_percent(enough.share)} of studies "
        f"({100 * low:.0f} to {_percent(high)}); {smaller}."
    )


def table(found: Sequence[Power]) -> str:
    """A line a size, for people."""
    lines = ["participants  studies that show it  95 % interval"]
    for each in found:
        low, high = each.interval
        lines.append(
            f"{each.people:12}  {_percent(each.share):>20}  {100 * low:6.0f} to {_percent(high)}"
        )
    return "\n".join(lines)


def table_csv(found: Sequence[Power]) -> str:
    """A line a size, for programs: shares from 0 to 1."""
    lines = ["participants,studies,shown,power,low,high"]
    for each in found:
        low, high = each.interval
        numbers = f"{each.people},{each.studies},{each.shown}"
        lines.append(f"{numbers},{each.share:.6g},{low:.6g},{high:.6g}")
    return "\n".join(lines) + "\n"


def power_figure(found: Sequence[Power], wanted: float, first: str, title: str) -> Figure:
    """Power against the size of the study, its interval as a band, what is wanted as a line.

    Args:
        found: In the order of their sizes.
        wanted: The power that is wanted.
        first: The strategy that is hoped to be better; its colour.
        title: What is compared.
    """
    people = [each.people for each in found]
    low, high = zip(*(each.interval for each in found), strict=True)
    with rc_context(STYLE):
        figure = Figure(figsize=_SIZE, layout="constrained")
        panel = figure.subplots()
        panel.fill_between(people, low, high, color=COLOURS[first], alpha=0.25, linewidth=0)
        panel.plot(people, [each.share for each in found], "o-", color=COLOURS[first], ms=4)
        panel.axhline(wanted, color="black", linestyle="--", linewidth=0.8)  # what is wanted
        panel.set_ylim(-0.02, 1.02)
        panel.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        panel.spines[["top", "right"]].set_visible(False)
        panel.set_xlabel("participants")
        panel.set_ylabel("studies that show it")
        panel.set_title(title)
    return figure


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
