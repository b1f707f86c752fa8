"""What is kept of each tick of a drive, and in which form."""

import zlib

import numpy as np

COLUMNS = (
    "monotonic_s",  # the server's clock
    "raw_x",
    "raw_y",  # the stick as the page sent it
    "h_x",
    "h_y",  # the stick after the filter: the human input h
    "z_1",
    "z_2",  # the latent action
    *(f"a_{i}" for i in range(1, 8)),  # joint velocities asked for, [rad/s]
    *(f"q_{i}" for i in range(1, 8)),  # joint positions reached, [rad]
    "hand_x",
    "hand_y",
    "hand_z",  # [m]
    "hand_qw",
    "hand_qx",
    "hand_qy",
    "hand_qz",
    "hold",  # why the arm held: 0 it moved, else 1 + the place in HOLDS
    "touching",  # 1 while arm or hand touch the obstacle, else 0; NaN in records older than this
)
HOLDS = ("released", "silent", "edge", "moving-home", "by-itself")


def pack(rows: np.ndarray) -> bytes:
    """Rows of ``COLUMNS`` as they are stored: little-endian float64, compressed."""
    return zlib.compress(np.ascontiguousarray(rows, dtype="<f8").tobytes(), level=1)


def pack_props(rows: np.ndarray) -> bytes:
    """Where the props were at each tick, compressed little-endian float32.

    A row is the cup's position in [m] and orientation (w, x, y, z), then each bead's position;
    what a task does not have is not in it.
    """
    return zlib.compress(np.ascontiguousarray(rows, dtype="<f4").tobytes(), level=1)


def unpack_props(props: bytes, ticks: int) -> np.ndarray:
    """Stored props as one row a tick."""
    return np.frombuffer(zlib.decompress(props), dtype="<f4").reshape(ticks, -1)


def unpack(samples: bytes) -> np.ndarray:
    """Stored samples as rows of ``COLUMNS``."""
    return np.frombuffer(zlib.decompress(samples), dtype="<f8").reshape(-1, len(COLUMNS))
