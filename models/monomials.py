"""The monomials of a latent action up to the third degree, in which a short move is expanded."""

import numpy as np
from jaxtyping import Float

from .arrays import LatentAction

COUNT = 9
Monomials = Float[np.ndarray, "*batch 9"]
# Where the product of two linear forms, one in z1 and z2 each, has its coefficients.
SQUARES = slice(2, 5)


def monomials(z: LatentAction) -> Monomials:
    """x, y, x^2, xy, y^2, x^3, x^2 y, x y^2, y^3."""
    x, y = z[..., 0], z[..., 1]
    powers = np.empty((*z.shape[:-1], COUNT), dtype=z.dtype)
    powers[..., 0], powers[..., 1] = x, y
    powers[..., 2:4] = x[..., None] * powers[..., 0:2]
    powers[..., 4] = y * y
    powers[..., 5:8] = x[..., None] * powers[..., 2:5]
    powers[..., 8] = y * powers[..., 4]
    return powers


def pull_back(z: LatentAction, powers: Monomials, pull: Monomials) -> LatentAction:
    """The gradient in z, given the gradient in its monomials ``powers``."""
    x, y = powers[..., 0], powers[..., 1]
    xx, xy, yy = powers[..., 2], powers[..., 3], powers[..., 4]
    g = np.moveaxis(pull, -1, 0)
    gradient = np.empty_like(z)
    gradient[..., 0] = (
        g[0] + 2.0 * x * g[2] + y * g[3] + 3.0 * xx * g[5] + 2.0 * xy * g[6] + yy * g[7]
    )
    gradient[..., 1] = (
        g[1] + x * g[3] + 2.0 * y * g[4] + xx * g[6] + 2.0 * xy * g[7] + 3.0 * yy * g[8]
    )
    return gradient
