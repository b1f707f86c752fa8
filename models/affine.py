"""One affine map for all states, fitted where z is known (the paper's "manual align")."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .alignment import Alignment, array_of, check_batch
from .arrays import HumanInput, JointPositions, LatentAction
from .errors import InputError
from .fitting import AlignmentContext, Fit, FitProblem, Method, Report, no_report


@dataclass(frozen=True)
class AffineAlignment(Alignment):
    """z = matrix h + offset."""

    matrix: Float[np.ndarray, "2 2"]
    offset: Float[np.ndarray, "2"]
    controller_hash: str

    def __call__(self, h: HumanInput, s: JointPositions) -> LatentAction:
        """The latent action, independent of the state."""
        check_batch(h, s)
        z: np.ndarray = h @ self.matrix.T + self.offset
        return z

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Every number of the alignment by name, for a file."""
        return {"matrix": self.matrix, "offset": self.offset}


class AffineMethod(Method):
    """Least squares from sticks to the latent actions that made the moves."""

    def fit(self, problem: FitProblem, seed: int, report: Report = no_report) -> Fit:
        """The affine map nearest to the answers.

        Raises:
            InputError: If the latent actions of the answers are not known.
        """
        del seed, report
        labels = problem.labels
        if labels.latents is None:
            raise InputError("An affine map is fitted to moves whose latent actions are known.")
        inputs = np.concatenate([labels.human_inputs, np.ones((len(labels), 1))], axis=1)
        solution = np.linalg.lstsq(inputs, labels.latents, rcond=None)[0]
        matrix, offset = solution[:2].T.copy(), solution[2].copy()
        return Fit.at_once(AffineAlignment(matrix, offset, problem.controller.content_hash))

    def from_arrays(
        self, arrays: Mapping[str, np.ndarray], context: AlignmentContext
    ) -> AffineAlignment:
        """The inverse of :meth:`AffineAlignment.to_arrays`.

        Raises:
            ShapeError: If the numbers are not those of an affine map.
        """
        return AffineAlignment(
            array_of(arrays, "matrix", (2, 2)),
            array_of(arrays, "offset", (2,)),
            context.controller.content_hash,
        )
