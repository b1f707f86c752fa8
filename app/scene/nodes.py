"""Moving nodes of a viser scene cheaply.

viser's setters compare each pose with the last one through numpy, which at sixty poses a second and
a dozen arms costs more than all else. These queue the same messages without asking
(docs/decisions/0003 says what of viser 1.1.1 is leant on).
"""

from collections.abc import Iterable

import numpy as np
import viser
from viser import _messages


def put(node: viser.SceneNodeHandle, position: Iterable[float]) -> None:
    """Put a node at ``position`` ``(3,)`` in its parent's frame, in [m]."""
    x, y, z = (float(value) for value in position)
    place = node._impl
    place.position[:] = (x, y, z)
    place.api._queue_scene_message(_messages.SetPositionMessage(place.name, (x, y, z)))


def turn(node: viser.SceneNodeHandle, wxyz: Iterable[float]) -> None:
    """Turn a node to the unit quaternion ``wxyz`` ``(4,)`` in its parent's frame."""
    w, x, y, z = (float(value) for value in wxyz)
    place = node._impl
    place.wxyz[:] = (w, x, y, z)
    place.api._queue_scene_message(_messages.SetOrientationMessage(place.name, (w, x, y, z)))


def scatter(batch: viser.BatchedMeshHandle, positions: np.ndarray) -> None:
    """Put the copies of a mesh at ``positions`` ``(n, 3)``, in [m]."""
    rows = np.array(positions, dtype=np.float32)
    batch._impl.props.batched_positions[:] = rows
    batch._queue_update("batched_positions", rows)
