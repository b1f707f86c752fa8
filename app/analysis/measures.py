"""What a drive's record says of how it went: one documented function a measure.

Everything is worked out from the rows that were recorded (:data:`app.storage.ticks.COLUMNS`), so
that it can be worked out again, with other thresholds, from an export.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np

from models.beads import BeadCounts
from models.tasks.avoid import LET_GO_S

_REFILL = 5  # beads; so many do not get into a cup by themselves in one tick
Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Thresholds:
    """The numbers that the measures depend on.

    Attributes:
        moved: A stick pushed less than this is at rest.
        undo_window_s: How far back the stick's recent direction reaches.
        undo_angle_deg: A stick turned further than this from its recent direction undoes.
        let_go_s: A touch ends when nothing has touched for so long.
        bins: Of the heat-map, along each axis of the stick.
    """

    moved: float = 0.1
    undo_window_s: float = 1.0
    undo_angle_deg: float = 120.0
    let_go_s: float = LET_GO_S
    bins: int = 15


@dataclass(frozen=True)
class Measures:
    """How a drive went.

    Attributes:
        completion_time_s: From its first tick to its last.
        path_length_m: See :func:`path_length`.
        undo_share: See :func:`undo_share`.
        idle_time_s: See :func:`idle_time`.
        evenness: See :func:`evenness`.
        touches: See :func:`touches`; None where it was not recorded, or there is no obstacle.
        spills: See :func:`spills`; None where there are no beads.
        counts: What the task counted: touches, beads, ...
        is_success: Whether the task was achieved; None for one without a goal.
    """

    completion_time_s: float
    path_length_m: float
    undo_share: float
    idle_time_s: float
    evenness: float
    touches: int | None
    spills: int | None
    counts: dict[str, int]
    is_success: bool | None

    def as_row(self) -> dict[str, object]:
        """One flat row for a table."""
        row: dict[str, object] = asdict(self)
        return {name: value for name, value in row.items() if name != "counts"} | dict(self.counts)


def measure(
    rows: np.ndarray,
    names: Sequence[str],
    outcome: Mapping[str, object] | None = None,
    thresholds: Thresholds | None = None,
    beads: Sequence[BeadCounts] = (),
) -> Measures:
    """Measure a drive.

    Args:
        rows: Its ticks, ``(n, columns)``, in order.
        names: Of the columns.
        outcome: What the task said at the end, as it was recorded.
        thresholds: The usual ones if None.
        beads: Where they were at each tick.
    """
    chosen = thresholds or Thresholds()
    columns = {name: rows[:, index] for index, name in enumerate(names)}
    said = outcome or {}
    counts = said.get("counts", {})
    return Measures(
        completion_time_s=duration(columns),
        path_length_m=path_length(columns),
        undo_share=undo_share(columns, chosen),
        idle_time_s=idle_time(columns, chosen),
        evenness=evenness(columns, chosen),
        touches=touches(columns, chosen),
        spills=spills(beads),
        counts={name: int(count) for name, count in counts.items()}
        if isinstance(counts, Mapping)
        else {},
        is_success=bool(said["is_success"]) if "is_success" in said else None,
    )


def duration(columns: Columns) -> float:
    """From the first tick to the end of the last, by the server's clock, in [s]."""
    times = columns["monotonic_s"]
    if len(times) < 2:
        return 0.0
    return float(times[-1] - times[0] + np.median(np.diff(times)))


def path_length(columns: Columns) -> float:
    """How far the hand went, in [m]: the sum of its steps from tick to tick."""
    return float(np.linalg.norm(np.diff(trajectory(columns), axis=0), axis=1).sum())


def undo_share(columns: Columns, thresholds: Thresholds) -> float:
    """Share of the time the stick is pushed in which it is turned against its recent direction.

    The recent direction is the mean of the stick over the window before; a stick that was at rest
    then has none, and undoes nothing. People turn back when the arm did not do what they meant.
    """
    times, h = columns["monotonic_s"], _stick(columns)
    pushed = _is_pushed(h, thresholds)
    if not pushed.any():
        return 0.0
    # Sums up to each tick, so that a window's mean is a difference of two.
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum(h, axis=0)])
    first = np.searchsorted(times, times - thresholds.undo_window_s)
    now = np.arange(len(times))
    recent = (sums[now] - sums[first]) / np.maximum(now - first, 1)[:, None]
    length = np.linalg.norm(recent, axis=1) * np.linalg.norm(h, axis=1)
    has_direction = np.linalg.norm(recent, axis=1) > thresholds.moved
    cosine = np.sum(recent * h, axis=1) / np.maximum(length, 1e-12)
    against = has_direction & (cosine < np.cos(np.radians(thresholds.undo_angle_deg)))
    return float((against & pushed).sum() / pushed.sum())


def idle_time(columns: Columns, thresholds: Thresholds) -> float:
    """How long the stick was at rest, in [s]."""
    pushed = _is_pushed(_stick(columns), thresholds)
    return float(duration(columns) * np.mean(~pushed)) if len(pushed) else 0.0


def evenness(columns: Columns, thresholds: Thresholds) -> float:
    """How evenly the stick's directions were used, from 0 (one) to 1 (all alike).

    The entropy of eight sectors over that of a uniform use.
    """
    h = _stick(columns)
    h = h[_is_pushed(h, thresholds)]
    if not len(h):
        return 0.0
    sector = np.floor((np.arctan2(h[:, 1], h[:, 0]) / (2 * np.pi) * 8 + 0.5) % 8).astype(int)
    share = np.bincount(sector, minlength=8) / len(h)
    used = share[share > 0]
    return float(-(used * np.log(used)).sum() / np.log(8)) + 0.0


def touches(columns: Columns, thresholds: Thresholds) -> int | None:
    """How often the arm touched the obstacle; a bump in several ticks is one touch.

    Counted tick by tick, as :class:`models.tasks.avoid.GoingRound` counts: what a late tick adds
    to the clock is no time in which the arm could let go.
    """
    touching, tick_s = columns["touching"], _tick(columns["monotonic_s"])
    if not len(touching) or np.isnan(touching).any():
        return None
    count, untouched_s = 0, np.inf
    for is_touching in (touching > 0.0).tolist():
        if is_touching:
            count += untouched_s > thresholds.let_go_s
            untouched_s = 0.0
        else:
            untouched_s += tick_s
    return count


def spills(beads: Sequence[BeadCounts]) -> int | None:
    """How many beads were spilt: those that lie about at the end, and before each refill."""
    return sum(filling.spilt for filling in fillings(beads)) if beads else None


def fillings(beads: Sequence[BeadCounts]) -> list[BeadCounts]:
    """Where the beads of each filling of the cup came to be: before each refill, and at the end."""
    refills = [before for before, now in pairwise(beads) if now.in_cup - before.in_cup > _REFILL]
    return [*refills, *beads[-1:]]


def trajectory(columns: Columns) -> np.ndarray:
    """Where the hand was at each tick, ``(n, 3)`` in [m]."""
    return np.stack([columns[name] for name in ("hand_x", "hand_y", "hand_z")], axis=1)


def heat_map(columns: Columns, thresholds: Thresholds | None = None) -> np.ndarray:
    """Share of the pushed time in each cell of the stick's square, ``(bins, bins)``; x, then y."""
    chosen = thresholds or Thresholds()
    h = _stick(columns)
    h = h[_is_pushed(h, chosen)]
    edges = np.linspace(-1.0, 1.0, chosen.bins + 1)
    counts, _, _ = np.histogram2d(h[:, 0], h[:, 1], bins=(edges, edges))
    shares: np.ndarray = counts / max(1, len(h))
    return shares


def _tick(times_s: np.ndarray) -> float:
    """How long a tick was meant to be, in [s]: a whole number of them a second."""
    if len(times_s) < 2:
        return 0.0
    return 1.0 / max(1.0, round(1.0 / float(np.median(np.diff(times_s)))))


def _stick(columns: Columns) -> np.ndarray:
    return np.stack([columns["raw_x"], columns["raw_y"]], axis=1)


def _is_pushed(h: np.ndarray, thresholds: Thresholds) -> np.ndarray:
    pushed: np.ndarray = np.linalg.norm(h, axis=1) > thresholds.moved
    return pushed
