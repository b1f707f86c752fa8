"""Where the moving nodes of a scene are, told to its viewers right away and cheaply.

viser queues every pose as a message, compares it with the last one through numpy and serialises it
for each viewer, which at sixty poses a second and a dozen arms costs as much as the physics. Here
only the newest place of a node is kept; a viewer that reads slowly hears of that, not of all before
it (docs/decisions/0003 says what of viser 1.1.1's wire format is leant on).
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard

_ZSTD = zstandard.ZstdCompressor(level=1)
_PADDING = 8  # arrays begin at multiples of so many bytes

Places = dict[tuple[str, str], Any]  # by kind of message and node


@dataclass
class _Viewer:
    moved: Places
    wake: asyncio.Event = field(default_factory=asyncio.Event)


class Poses:
    """The newest places of the nodes of one scene. All calls are made on the event loop."""

    def __init__(self) -> None:
        """Begin with every node where it was made."""
        self.newest: Places = {}
        self._moved: Places = {}
        self._viewers: list[_Viewer] = []

    def put(self, node: viser.SceneNodeHandle, position: Iterable[float]) -> None:
        """Put a node at ``position`` ``(3,)`` in its parent's frame, in [m]."""
        self._moved["SetPositionMessage", node.name] = tuple(map(float, position))

    def turn(self, node: viser.SceneNodeHandle, wxyz: Iterable[float]) -> None:
        """Turn a node to the unit quaternion ``wxyz`` ``(4,)`` in its parent's frame."""
        self._moved["SetOrientationMessage", node.name] = tuple(map(float, wxyz))

    def scatter(self, batch: viser.BatchedMeshHandle, positions: np.ndarray) -> None:
        """Put the copies of a mesh at ``positions`` ``(n, 3)``, in [m]."""
        self._moved["SceneNodeUpdateMessage", batch.name] = np.array(positions, dtype="<f4")

    def flush(self) -> None:
        """Tell every viewer what has moved since the last time."""
        self.newest.update(self._moved)
        for viewer in self._viewers:
            viewer.moved.update(self._moved)
            viewer.wake.set()
        self._moved = {}

    async def follow(self, send: Callable[[bytes], Awaitable[None]]) -> None:
        """Tell one viewer where everything is, and from then on what moves, until cancelled."""
        viewer = _Viewer(dict(self.newest))
        viewer.wake.set()
        self._viewers.append(viewer)
        try:
            while True:
                await viewer.wake.wait()
                viewer.wake.clear()
                moved, viewer.moved = viewer.moved, {}
                if moved:
                    await send(_encode_moved(moved))
        finally:
            self._viewers.remove(viewer)


def _encode_moved(moved: Places) -> bytes:
    messages: list[dict[str, Any]] = []
    arrays: list[memoryview] = []
    for (kind, name), value in moved.items():
        message: dict[str, Any] = {"type": kind, "name": name, "owner": ""}
        if kind == "SetPositionMessage":
            message["position"] = value
        elif kind == "SetOrientationMessage":
            message["wxyz"] = value
        else:
            array = {"__binary_index": len(arrays), "dtype": "<f4"}
            message["updates"] = {"batched_positions": array}
            arrays.append(value.data)
        messages.append(message)
    return encode(messages, arrays)


def encode(messages: list[dict[str, Any]], arrays: list[memoryview]) -> bytes:
    """One message on viser's wire: lengths, compressed msgpack, then the arrays as they are."""
    inner = msgspec.msgpack.encode(
        {
            "messages": messages,
            "timestampSec": time.perf_counter(),
            "binaryBufferLengths": [array.nbytes for array in arrays],
        }
    )
    packed = _ZSTD.compress(inner)
    parts = [len(inner).to_bytes(8, "little"), len(packed).to_bytes(8, "little"), packed]
    length = 16 + len(packed)
    for array in arrays:
        padding = -length % _PADDING
        parts += [bytes(padding), array.tobytes()]
        length += padding + array.nbytes
    return b"".join(parts)
