"""The Franka Emika Panda: its limits, its home pose and the names of its parts.

Limits: Franka Emika, Panda datasheet and control-interface documentation, "Joint space limits";
tests check them against the URDF.
"""

import numpy as np

JOINT_NAMES = tuple(f"panda_joint{i}" for i in range(1, 8))
LINK_NAMES = (
    *(f"panda_link{i}" for i in range(8)),
    "panda_hand",
    "panda_leftfinger",
    "panda_rightfinger",
)
# The frame between the finger tips, 103.4 mm in front of the hand's flange. "The hand" below.
HAND_FRAME = "panda_hand_tcp"
N_JOINTS = 7

Q_MIN = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])  # [rad]
Q_MAX = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])  # [rad]
QD_MAX = np.array([2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100])  # [rad/s]
# The "ready" pose of the manufacturer's own examples: hand in front of the base, pointing down.
Q_HOME = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])  # [rad]
FINGER_OPEN_M = 0.02  # how far each finger stands from the middle, in [m]
