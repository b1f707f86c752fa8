"""What a page is told of the things on the table; lengths in [m], places in the world."""

from pydantic import BaseModel, ConfigDict

Place = tuple[float, float]


class _ThingOut(BaseModel):
    model_config = ConfigDict(from_attributes=True)

    radius_m: float
    height_m: float


class ObstacleOut(_ThingOut):
    """See :class:`models.props.Obstacle`."""

    position: Place


class BowlOut(_ThingOut):
    """See :class:`models.props.Bowl`."""

    name: str
    position: Place


class CupOut(_ThingOut):
    """See :class:`models.props.Cup`; ``in_hand`` is in the hand's frame."""

    place: Place | None
    in_hand: tuple[float, float, float]


class PropsOut(BaseModel):
    """See :class:`models.props.Props`; make it with ``model_validate``."""

    model_config = ConfigDict(from_attributes=True)

    obstacle: ObstacleOut | None
    bowls: list[BowlOut]
    cup: CupOut | None
