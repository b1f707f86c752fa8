"""Three minutes of driving: the hand must stay in the plane and keep pointing down."""

import numpy as np

from models.panda import Q_MAX, Q_MIN

RATE_HZ = 60
DRIVE_S = 180
DRIVERS = 4


def test_the_hand_stays_in_the_plane_and_points_down(person, kinematics, plane, rng):
    low, high = plane.workspace
    q = np.tile(plane.home_q, (DRIVERS, 1))
    h, target = np.zeros((DRIVERS, 2)), np.zeros((DRIVERS, 2))
    heights, tilts, travelled_m = [], [], 0.0
    for tick in range(RATE_HZ * DRIVE_S):
        if tick % 30 == 0:
            turns = rng.uniform(0, 2 * np.pi, DRIVERS)
            wish = rng.uniform(0.3, 1.0, (DRIVERS, 1)) * np.stack(
                [np.cos(turns), np.sin(turns)], -1
            )
            target = np.where(rng.random((DRIVERS, 1)) < 0.4, wish, target)
        h += (target - h) / RATE_HZ / 0.15
        a = person.mapping(h, q)
        if tick % 6 == 0:
            pose, jacobian = kinematics.hand_pose(q), kinematics.jacobian(q)[:, :2]
            heights.append(pose.position[:, 2])
            tilts.append(np.degrees(np.arccos(np.clip(-pose.rotation[:, 2, 2], -1, 1))))
        velocity = np.einsum("nij,nj->ni", jacobian, a)
        at = pose.position[:, :2]
        leaves = np.any(((at < low) & (velocity < 0)) | ((at > high) & (velocity > 0)), axis=1)
        target[leaves], h[leaves], a[leaves] = -target[leaves], -h[leaves], 0.0
        travelled_m += np.linalg.norm(velocity[~leaves], axis=1).sum() / RATE_HZ
        q = np.clip(q + a / RATE_HZ, Q_MIN, Q_MAX)
    assert travelled_m / DRIVERS > 5.0
    assert np.abs(np.array(heights) - plane.height_m).max() < 0.02
    assert np.max(tilts) < 5.0
