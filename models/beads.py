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
    in_cup_frame = None
    if cup_position is not None and cup_wxyz is not None:
        in_cup_frame = in_frame(beads, cup_position, cup_wxyz)
    in_cup, in_bowls, spilt = _where(props, beads, in_cup_frame)
    return BeadCounts(
        int(np.count_nonzero(in_cup)),
        tuple(int(np.count_nonzero(inside)) for inside in in_bowls),
        int(np.count_nonzero(spilt)),
    )


def count_beads_by_tick(
    props: Props,
    beads: Float[np.ndarray, "ticks n 3"],
    cup_positions: Float[np.ndarray, "ticks 3"],
    cup_wxyzs: Float[np.ndarray, "ticks 4"],
) -> list[BeadCounts]:
    """As :func:`count_beads` for each tick of a record, all at once.

    One call a tick would keep the interpreter so busy that the arms of others wait.
    """
    turned = np.array([rotation_matrix(wxyz) for wxyz in cup_wxyzs]).reshape(-1, 3, 3)
    in_cup_frame = (beads - cup_positions[:, None]) @ turned
    in_cup, in_bowls, spilt = _where(props, beads, in_cup_frame)
    counts = np.array([inside.sum(axis=-1) for inside in (in_cup, spilt, *in_bowls)])
    return [BeadCounts(cup, tuple(bowls), out) for cup, out, *bowls in counts.T.tolist()]


def in_frame(points: np.ndarray, position: np.ndarray, wxyz: np.ndarray) -> np.ndarray:
    """Points ``(..., 3)`` of the world in a frame at ``position``, turned by ``wxyz``, in [m]."""
    places: np.ndarray = (points - position) @ rotation_matrix(wxyz)
    return places


def rotation_matrix(wxyz: np.ndarray) -> np.ndarray:
    """The rotation matrix ``(3, 3)`` of a quaternion ``(4,)``."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, wxyz)
    return matrix.reshape(3, 3)


def _where(
    props: Props, beads: np.ndarray, in_cup_frame: np.ndarray | None
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Which beads ``(..., n, 3)`` are in the cup, in each bowl, and spilt: each ``(..., n)``."""
    outside = np.ones(beads.shape[:-1], dtype=bool)
    in_cup = ~outside
    if props.cup is not None and in_cup_frame is not None:
        in_cup = _are_in(in_cup_frame, (0.0, 0.0), props.cup.radius_m, props.cup.height_m)
        in_cup &= in_cup_frame[..., 2] > 0.0
        outside &= ~in_cup
    in_bowls = [_are_in(beads, bowl.position, bowl.radius_m, bowl.height_m) for bowl in props.bowls]
    for inside in in_bowls:
        outside &= ~inside
    radius_m = props.beads.radius_m if props.beads else 0.0
    rim_m = min((bowl.height_m for bowl in props.bowls), default=3 * radius_m)
    outside &= beads[..., 2] < TABLE_TOP_M + rim_m
    return in_cup, in_bowls, outside


def _are_in(points: np.ndarray, middle: Place, radius_m: float, height_m: float) -> np.ndarray:
    """Which points ``(..., 3)`` are within an upright round thing and below its rim: ``(...)``."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    aside = np.hypot(x - middle[0], y - middle[1])
    inside: np.ndarray = (aside < radius_m + WALL_M) & (z < height_m)
    return inside
