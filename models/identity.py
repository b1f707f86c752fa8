"""No alignment: the stick is the latent action (the paper's "no align")."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .alignment import Alignment, check_batch
from .arrays import HumanInput, JointPositions, LatentAction
from .controller import LatentController
from .fitting import AlignmentContext, Fit, FitProblem, Method, Report, no_report


@dataclass(frozen=True)
class IdentityAlignment(Alignment):
    """z = h."""

    controller_hash: str

    @classmethod
    def of(cls, controller: LatentController) -> "IdentityAlignment":
        """The identity for a controller."""
        return cls(controller.content_hash)

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The stick itself."""
        check_batch(h, s)
        return h

    def to_arrays(self) -> dict[str, np.ndarray]:
        """It has no numbers."""
        return {}


class IdentityMethod(Method):
    """Learns nothing."""

    is_learned = False

    def fit(self, problem: FitProblem, seed: int, report: Report = no_report) -> Fit:
        """The identity, whatever was answered."""
        del seed, report
        return Fit.at_once(IdentityAlignment.of(problem.controller))

    def from_arrays(
        self, arrays: Mapping[str, np.ndarray], context: AlignmentContext
    ) -> IdentityAlignment:
        """The identity for the controller of ``context``."""
        del arrays
        return IdentityAlignment.of(context.controller)
