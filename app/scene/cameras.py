"""Where the picture of a task is looked at from."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """A place to look from.

    The default is behind the base and above it, looking where the robot looks: forward is forward.
    It is high and a little aside, so that the elbow does not hide the hand.

    Attributes:
        position: In the world, in [m].
        look_at: What is in the middle of the picture, in [m].
    """

    position: Point = (-0.32, -0.70, 1.60)
    look_at: Point = (0.35, 0.03, 0.14)


# From the left: when it pours, the hand comes to the right of the cup and would hide it.
_FROM_THE_LEFT = Camera((0.12, 1.05, 0.85), (0.42, 0.0, 0.22))
CAMERAS: Mapping[str, Camera] = MappingProxyType(
    {"pour-cup": _FROM_THE_LEFT, "fetch-and-pour": _FROM_THE_LEFT}
)


def camera_of(task: str) -> Camera:
    """The camera of a task: its own, or the default."""
    return CAMERAS.get(task, Camera())
