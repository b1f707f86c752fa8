"""A driver who pushes the stick by their own idea of it, without delay or noise."""

import numpy as np

from app.bots import eyes
from models.controller import LatentController
from models.demonstrations import DT_S
from models.identity import IdentityAlignment
from models.mapping import Mapping
from models.simulated_human import SimulatedHuman


def stick(person: SimulatedHuman, sight: eyes.Sight) -> np.ndarray:
    """The stick ``(2,)`` they give now."""
    h = person.answer(eyes.wish(person.task.name, sight) * DT_S, sight.hand)
    return np.asarray(h / max(1.0, float(np.linalg.norm(h))))


def unaligned(controller: LatentController) -> Mapping:
    """The mapping of a stick that goes to the controller as it is."""
    return Mapping(controller, IdentityAlignment.of(controller))
