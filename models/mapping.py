"""The one composition: stick h, through the alignment, to z, through the controller, to a."""

from dataclasses import dataclass

import numpy as np

from .alignment import Alignment
from .arrays import HumanInput, JointPositions, JointVelocities, LatentAction
from .controller import LatentController
from .errors import CheckpointError

# The controller knows z in [-1, 1]^2; this much further out it can still be trusted.
Z_REACH = 1.3


@dataclass(frozen=True)
class Mapping:
    """a = phi(f(h, s), s), equation 1 of the paper.

    Raises:
        CheckpointError: If the alignment was learned for another controller.
    """

    controller: LatentController
    alignment: Alignment

    def __post_init__(self) -> None:
        """Check that the two belong together."""
        if self.alignment.controller_hash != self.controller.content_hash:
            raise CheckpointError("This alignment was learned for another controller.")

    def z(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The latent action for stick ``h`` at state ``s`` in [rad].

        Where the alignment asks for more than the controller was trained for, z is shortened and
        keeps its direction.
        """
        z = self.alignment(h, s)
        largest = np.max(np.abs(z), axis=-1, keepdims=True)
        shortened: np.ndarray = z / np.maximum(1.0, largest / Z_REACH)
        return shortened

    def __call__(self, h: HumanInput, s: JointPositions) -> JointVelocities:
        """Joint velocities in [rad/s]."""
        return self.controller.decode(self.z(h, s), s)
