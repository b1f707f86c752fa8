"""Driving a simulation by the hand's velocity, and looking at what is in it."""

from collections.abc import Iterator

import mujoco
import numpy as np

from models.beads import rotation_matrix
from models.kinematics import Kinematics
from models.panda import QD_MAX
from models.panda_pack import PandaPack
from models.props import Beads, Cup, Obstacle, Props
from models.simulation import Simulation
from tests.soak.random_drives import BEAD_MASK

DT_S = 1 / 60
# The hand 0.3 m over the table, pointing down.
START = np.array([0.0, -0.08094, 0.0, -2.2394, 0.0, 2.15846, np.pi / 4])
CUP, BEADS = Cup(), Beads()
FULL = Props(cup=CUP, beads=BEADS)
STANDING = Props(cup=Cup(place=(0.55, 0.1)), beads=BEADS)
POST = Obstacle((0.66, 0.0), 0.04, 0.33)  # up to the fingers, but not to the palm


def drive(
    sim: Simulation, kinematics: Kinematics, v: np.ndarray, w: np.ndarray, seconds: float
) -> Iterator[int]:
    """Move the hand at a velocity in [m/s] and a turn in [rad/s], as fast as the joints allow."""
    for tick in range(round(seconds / DT_S)):
        jacobian = kinematics.jacobian(sim.target)
        damped = jacobian @ jacobian.T + 1e-4 * np.eye(6)
        a = jacobian.T @ np.linalg.solve(damped, np.concatenate([v, w]))
        a /= max(1.0, np.max(np.abs(a) / QD_MAX))
        sim.set_target(sim.target + a * DT_S)
        sim.step(DT_S)
        yield tick


def run(steps: Iterator[int]) -> None:
    for _ in steps:
        pass


def wait(sim: Simulation, seconds: float) -> None:
    for _ in range(round(seconds / DT_S)):
        sim.step(DT_S)


def started(pack: PandaPack, props: Props) -> Simulation:
    sim = Simulation(pack, props)
    sim.reset(START)
    return sim


def geoms(sim: Simulation, *bodies: str) -> list[int]:
    """What of these bodies others than beads can touch."""
    mj_model = sim._mj_model
    names = [mj_model.body(int(body)).name for body in mj_model.geom_bodyid]
    masks = mj_model.geom_contype
    return [i for i, name in enumerate(names) if name in bodies and masks[i] != BEAD_MASK]


def distance(sim: Simulation, some: list[int], others: list[int]) -> float:
    """How far apart they are, in [m]; negative: how deep in each other."""
    mujoco.mj_kinematics(sim._mj_model, sim._mj_data)
    return min(
        float(mujoco.mj_geomDistance(sim._mj_model, sim._mj_data, one, other, 0.2, None))
        for one in some
        for other in others
    )


def cup_in_hand(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """The cup's position in the hand frame and its axis there."""
    mujoco.mj_kinematics(sim._mj_model, sim._mj_data)
    assert sim.cup is not None
    to_hand = rotation_matrix(sim.hand.wxyz).T
    axis = rotation_matrix(sim.cup.wxyz)[:, 2]
    return to_hand @ (sim.cup.position - sim.hand.position), to_hand @ axis


def put_beads(sim: Simulation, places: np.ndarray) -> None:
    sim._mj_data.qpos[16:] = places.ravel()
    sim._mj_data.qvel[15:] = 0.0


def hand_geoms(sim: Simulation) -> list[int]:
    return geoms(sim, "panda_hand", "panda_leftfinger", "panda_rightfinger")


def over_the_handle(sim: Simulation, kinematics: Kinematics, away_m: float) -> None:
    """Put the hand where it would hold the standing cup, or so far over that."""
    assert STANDING.cup is not None
    assert STANDING.cup.place is not None
    place = np.array([*STANDING.cup.place, 0.0])
    goal = place + np.array([-CUP.in_hand[0], 0.0, CUP.in_hand[2] + away_m])
    q = START.copy()
    for _ in range(60):
        pose = kinematics.hand_pose(q)
        turn = 0.5 * sum(
            np.cross(pose.rotation[:, i], np.diag([1.0, -1.0, -1.0])[:, i]) for i in range(3)
        )
        error = np.concatenate([goal - pose.position, turn])
        jacobian = kinematics.jacobian(q)
        q = q + jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-5 * np.eye(6), error)
    sim.reset(q)
