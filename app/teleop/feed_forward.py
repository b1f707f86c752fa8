"""Where each direction of the stick would move the hand now, as arrows at the hand."""

import numpy as np

from models.beads import rotation_matrix
from models.mapping import Mapping
from models.panda import QD_MAX
from models.simulation import Simulation

# Full stick to the four sides, in the order of the arrows: up, right, down, left.
DIRECTIONS = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
# Arrows begin this far before the hand, so that a turn on the spot is a way, too.
_AHEAD_M = 0.10
AHEAD_S = 0.8  # an arrow ends where the stick would lead in so long a time


def arrows(mapping: Mapping, simulation: Simulation) -> np.ndarray:
    """Begin and end of an arrow for each of :data:`DIRECTIONS`, ``(4, 2, 3)`` in [m]."""
    s = np.broadcast_to(simulation.q, (len(DIRECTIONS), simulation.q.size))
    a = mapping(DIRECTIONS, s)
    a = a / np.maximum(1.0, np.max(np.abs(a) / QD_MAX, axis=1, keepdims=True))
    twist = a @ simulation.hand_jacobian.T
    hand = simulation.hand
    ahead = rotation_matrix(hand.wxyz)[:, 2] * _AHEAD_M
    velocity = twist[:, :3] + np.cross(twist[:, 3:], ahead)
    begin = hand.position + ahead
    return np.stack([np.broadcast_to(begin, velocity.shape), begin + AHEAD_S * velocity], axis=1)
