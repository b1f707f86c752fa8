"""What stands on the table or is in the hand: an obstacle, bowls, a cup and its beads.

Pure data, lengths in [m], places on the table as (x, y) in the world. :mod:`world` builds it and
:mod:`simulation` lets it move. Two equal :class:`Props` are one compiled world.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import hypot, isfinite

import numpy as np

from .errors import InputError

TABLE_TOP_M = 0.0  # the base stands on the table; its top is the world's z = 0
TABLE_MIDDLE = (0.35, 0.0)
TABLE_HALF_SIZE = (0.6, 0.75)
WALL_M = 0.004  # walls and floors of cup and bowls
# A flat upright handle from the rim down: length away from the wall, thickness, height.
HANDLE_SIZE_M = (0.018, 0.004, 0.03)
GRIP_BELOW_RIM_M = 0.006

Place = tuple[float, float]


@dataclass(frozen=True)
class Obstacle:
    """A cylinder that stands on the table and is fixed to it.

    Raises:
        InputError: If it has no size or does not stand on the table.
    """

    position: Place
    radius_m: float
    height_m: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check("The obstacle", self.radius_m, self.height_m, self.position)


@dataclass(frozen=True)
class Bowl:
    """A bowl that stands on the table, is fixed to it and open at the top.

    Attributes:
        name: The word by which beads in it are asked for.
        position: Its middle on the table.
        radius_m: Of the inside.
        height_m: From the table to the rim.

    Raises:
        InputError: If it has no name or size or does not stand on the table.
    """

    name: str
    position: Place
    radius_m: float
    height_m: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not self.name:
            raise InputError("A bowl needs a name.")
        _check(f"The bowl '{self.name}'", self.radius_m, self.height_m, self.position)


@dataclass(frozen=True)
class Cup:
    """A cup, open at the top, that can be carried and poured from.

    The hand holds it from above by a flat handle (:data:`HANDLE_SIZE_M`), so that it hangs on the
    hand's +x side and pours clear of the fingers over every rim but the handle's: when the hand is
    turned about its x axis, either way, or about its y axis by a positive angle.

    Attributes:
        radius_m: Of the inside.
        height_m: From below the floor to the rim.
        place: Where it stands on the table; None: it is in the hand.

    Raises:
        InputError: If it has no size or does not stand on the table.
    """

    radius_m: float = 0.035
    height_m: float = 0.08
    place: Place | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check("The cup", self.radius_m, self.height_m, self.place or TABLE_MIDDLE)
        if self.height_m < HANDLE_SIZE_M[2]:
            raise InputError(f"The cup is lower than its handle, which is {HANDLE_SIZE_M[2]} m.")

    @property
    def in_hand(self) -> tuple[float, float, float]:
        """Where the middle of the cup's floor is in the hand frame while it hangs upright."""
        to_handle = self.radius_m + WALL_M + HANDLE_SIZE_M[0] / 2
        return to_handle, 0.0, self.height_m - GRIP_BELOW_RIM_M


@dataclass(frozen=True)
class Beads:
    """Beads that are in the cup at the start.

    Raises:
        InputError: If there are none, or they have no size.
    """

    count: int = 20
    radius_m: float = 0.006

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.count < 1:
            raise InputError(f"There cannot be {self.count} beads; leave the beads out instead.")
        if not (isfinite(self.radius_m) and self.radius_m > 0.0):
            raise InputError(f"A bead cannot have a radius of {self.radius_m} m.")


@dataclass(frozen=True)
class Props:
    """Everything in the world beside the arm and the table.

    Raises:
        InputError: If things stand in each other, two bowls have one name, there are beads without
            a cup, or beads that do not fit into it.
    """

    obstacle: Obstacle | None = None
    bowls: tuple[Bowl, ...] = ()
    cup: Cup | None = None
    beads: Beads | None = None

    def __post_init__(self) -> None:
        """Check what belongs together."""
        names = [bowl.name for bowl in self.bowls]
        if len(set(names)) < len(names):
            raise InputError(f"Two bowls have one name, among: {', '.join(names)}.")
        for (one, at, radius_m), (other, there, other_m) in combinations(self._standing(), 2):
            if hypot(at[0] - there[0], at[1] - there[1]) < radius_m + other_m:
                raise InputError(f"{one} and {other} stand in each other.")
        if self.beads is not None:
            if self.cup is None:
                raise InputError("Beads need a cup to be in.")
            heap(self.cup, self.beads)

    def _standing(self) -> Iterator[tuple[str, Place, float]]:
        """What stands on the table: a word for it, where, and its outer radius."""
        if self.obstacle is not None:
            yield "The obstacle", self.obstacle.position, self.obstacle.radius_m
        for bowl in self.bowls:
            yield f"The bowl '{bowl.name}'", bowl.position, bowl.radius_m + WALL_M
        if self.cup is not None and self.cup.place is not None:
            yield "The cup", self.cup.place, self.cup.radius_m + WALL_M


def heap(cup: Cup, beads: Beads) -> np.ndarray:
    """The beads in layers over the cup's floor, ``(n, 3)`` in [m] in its frame, none in another.

    Raises:
        InputError: If they do not fit into the cup.
    """
    pitch_m = 2.05 * beads.radius_m
    reach = int(cup.radius_m / pitch_m)
    steps = pitch_m * np.arange(-reach, reach + 1)
    layer = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    layer = layer[np.hypot(*layer.T) < cup.radius_m - 1.05 * beads.radius_m]
    levels = -(-beads.count // max(1, len(layer)))
    if len(layer) == 0 or WALL_M + pitch_m * levels > cup.height_m:
        raise InputError(
            f"{beads.count} beads of {beads.radius_m} m do not fit into a cup of "
            f"{cup.radius_m} m by {cup.height_m} m."
        )
    index = np.arange(beads.count)
    level = index // len(layer)
    # Every other layer a little aside, so that no bead balances on another.
    xy = layer[index % len(layer)] + 0.02 * pitch_m * (level % 2)[:, None]
    return np.column_stack([xy, WALL_M + pitch_m * (level + 0.5)])


def _check(name: str, radius_m: float, height_m: float, place: Place) -> None:
    if not (isfinite(radius_m) and isfinite(height_m) and radius_m > 0.0 and height_m > 0.0):
        raise InputError(f"{name} needs a radius and a height, not {radius_m} m and {height_m} m.")
    if any(
        not abs(at - middle) <= half_size
        for at, middle, half_size in zip(place, TABLE_MIDDLE, TABLE_HALF_SIZE, strict=True)
    ):
        raise InputError(f"{name} stands beside the table, at {place}.")
