"""Where the beads are: in the cup, in a bowl, or spilt. From positions alone, live or recorded."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from .props import TABLE_TOP_M, WALL_M, Place, Props


@dataclass(frozen=True)
class BeadCounts:
    """How many beads are where; those in the air over the rims are nowhere.

    Attributes:
        in_cup: Between the cup's floor and its rim.
        in_bowls: In each bowl, below its rim, in the order of the props.
        spilt: Outside cup and bowls and below the rims of all bowls; with no bowl, only what has
            come down to the table.
    """

    in_cup: int
    in_bowls: tuple[int, ...]
    spilt: int


def count_beads(
    props: Props,
    beads: Float[np.ndarray, "n 3"],
    cup_position: Float[np.ndarray, "3"] | None = None,
    cup_wxyz: Float[np.ndarray, "4"] | None = None,
) -> BeadCounts:
    """Count the beads by where their middles are.

    Args:
        props: What else there is.
        beads: The middles, in [m].
        cup_position: Of the cup, in the middle below its floor, in [m]; None: there is no cup.
        cup_wxyz: The cup's orientation; z goes to its opening.
    """
    outside, in_cup = np.ones(len(beads), dtype=bool), 0
    if props.cup is not None and cup_position is not None and cup_wxyz is not None:
        at = in_frame(beads, cup_position, cup_wxyz)
        inside = _are_in(at, (0.0, 0.0), props.cup.radius_m, props.cup.height_m)
        inside &= at[:, 2] > 0.0
        in_cup = int(np.count_nonzero(inside))
        outside &= ~inside
    in_bowls = []
    for bowl in props.bowls:
        inside = _are_in(beads, bowl.position, bowl.radius_m, bowl.height_m)
        in_bowls.append(int(np.count_nonzero(inside)))
        outside &= ~inside
    radius_m = props.beads.radius_m if props.beads else 0.0
    rim_m = min((bowl.height_m for bowl in props.bowls), default=3 * radius_m)
    outside &= beads[:, 2] < TABLE_TOP_M + rim_m
    return BeadCounts(in_cup, tuple(in_bowls), int(np.count_nonzero(outside)))


def in_frame(points: np.ndarray, position: np.ndarray, wxyz: np.ndarray) -> np.ndarray:
    """Points ``(..., 3)`` of the world in a frame at ``position``, turned by ``wxyz``, in [m]."""
    places: np.ndarray = (points - position) @ rotation_matrix(wxyz)
    return places


def rotation_matrix(wxyz: np.ndarray) -> np.ndarray:
    """The rotation matrix ``(3, 3)`` of a quaternion ``(4,)``."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, wxyz)
    return matrix.reshape(3, 3)


def _are_in(points: np.ndarray, middle: Place, radius_m: float, height_m: float) -> np.ndarray:
    """Which points ``(n, 3)`` are within an upright round thing and below its rim: ``(n,)``."""
    x, y, z = points.T
    aside = np.hypot(x - middle[0], y - middle[1])
    inside: np.ndarray = (aside < radius_m + WALL_M) & (z < height_m)
    return inside
