"""Random drives at full speed: does anything get through anything, or the arm out of its limits?

Run ``python -m tests.soak.random_drives --drives 1000``; one line a world is printed.
"""

import argparse
from dataclasses import dataclass

import mujoco
import numpy as np

from models.beads import in_frame
from models.checkpoints import load_controller
from models.panda import Q_MAX, Q_MIN, QD_MAX
from models.panda_pack import PandaPack, open_pack
from models.props import WALL_M, Beads, Bowl, Cup, Obstacle, Props
from models.simulation import Simulation
from models.tasks import get_task
from tests.drivers import unaligned

RATE_HZ = 60
DRIVE_S = 10.0
WORLDS = {
    "obstacle": Props(obstacle=Obstacle((0.6, 0.1), 0.05, 0.35)),
    "cup, beads and bowls": Props(
        bowls=(Bowl("left", (0.5, 0.22), 0.07, 0.05), Bowl("right", (0.5, -0.22), 0.07, 0.05)),
        cup=Cup(),
        beads=Beads(),
    ),
    "all of it": Props(
        obstacle=Obstacle((0.65, 0.1), 0.04, 0.3),
        bowls=(Bowl("left", (0.45, 0.25), 0.07, 0.05), Bowl("right", (0.5, -0.22), 0.07, 0.05)),
        cup=Cup(),
        beads=Beads(),
    ),
}
BEAD_MASK = 2  # what only beads touch
# A bead that was this far below a rim one tick ago did not come over it, in [m].
_UNDER_RIM_M = 0.025
_LANDING_M = 0.05  # no bead that comes down on the table dips deeper into it


@dataclass
class Findings:
    """The worst of all drives of one world.

    Attributes:
        tunnelled: Beads that got through the wall or floor of a cup or a bowl, or the table.
        nans: Ticks at which something was not a number.
        lowest_m: How near hand, fingers and held cup came to the table; negative: so deep in it.
        limit_excess_rad: How far a joint was beyond its limit; negative: never.
        fastest: Of the joints, in shares of their greatest speeds.
        lost: Beads neither in the cup nor a bowl at the end of a drive.
        touched: Drives that touched the obstacle.
    """

    tunnelled: int = 0
    nans: int = 0
    lowest_m: float = np.inf
    limit_excess_rad: float = -np.inf
    fastest: float = 0.0
    lost: int = 0
    touched: int = 0

    def __str__(self) -> str:
        return (
            f"{self.tunnelled} beads tunnelled, {self.nans} NaNs, lowest hand point "
            f"{1000 * self.lowest_m:.1f} mm, worst joint limit excess "
            f"{self.limit_excess_rad:.4f} rad, fastest joint {self.fastest:.2f} of its limit, "
            f"{self.lost} beads spilt, {self.touched} drives touched the obstacle"
        )


def random_drives(pack: PandaPack, props: Props, drives: int, seed: int) -> Findings:
    """Drive and watch."""
    simulation, findings = Simulation(pack, props), Findings()
    mapping, home_q = unaligned(load_controller("plane")), get_task("plane").home_q
    for drive in range(drives):
        rng = np.random.default_rng([seed, drive])
        simulation.reset(home_q)
        watch = Watch(simulation, props)
        h, until, touched = np.zeros(2), 0.0, False
        for tick in range(round(DRIVE_S * RATE_HZ)):
            if tick / RATE_HZ >= until:
                turn = rng.uniform(0.0, 2.0 * np.pi)
                h = np.array([np.cos(turn), np.sin(turn)])
                until = tick / RATE_HZ + rng.uniform(0.1, 2.0)
            a = mapping(h, simulation.q)
            a = a / max(1.0, float(np.max(np.abs(a) / QD_MAX)))
            simulation.set_target(simulation.target + a / RATE_HZ)
            simulation.step(1.0 / RATE_HZ)
            watch.look(findings)
            touched |= simulation.is_touching
        findings.touched += touched
        findings.lost += simulation.beads_spilt
    return findings


class Watch:
    """Looks at a simulation after every tick."""

    def __init__(self, simulation: Simulation, props: Props) -> None:
        """Remember where every bead is now."""
        self._simulation, self._props = simulation, props
        mj_model = simulation._mj_model
        bodies = [mj_model.body(int(body)).name for body in mj_model.geom_bodyid]
        ours = ("panda_hand", "panda_leftfinger", "panda_rightfinger", "cup")
        self._table = mj_model.geom("table").id
        # What only beads or only the obstacle touch is larger than what is seen.
        self._geoms = [
            geom
            for geom, name in enumerate(bodies)
            if name in ours and mj_model.geom_contype[geom] not in (0, BEAD_MASK)
        ]
        self._before = self._frames()

    def look(self, findings: Findings) -> None:
        """Add what happened since the last look."""
        mj_model, mj_data = self._simulation._mj_model, self._simulation._mj_data
        q, qd = mj_data.qpos[:7], mj_data.qvel[:7]
        findings.nans += not np.isfinite(mj_data.qpos).all()
        excess = max(float(np.max(Q_MIN - q)), float(np.max(q - Q_MAX)))
        findings.limit_excess_rad = max(findings.limit_excess_rad, excess)
        findings.fastest = max(findings.fastest, float(np.max(np.abs(qd) / QD_MAX)))
        mujoco.mj_kinematics(mj_model, mj_data)
        lowest = min(
            mujoco.mj_geomDistance(mj_model, mj_data, self._table, geom, 1.0, None)
            for geom in self._geoms
        )
        findings.lowest_m = min(findings.lowest_m, lowest)
        frames = self._frames()
        for (before, radius_m, rim_m), (now, _, _) in zip(self._before, frames, strict=True):
            was, is_in = _inside(before, radius_m, rim_m), _inside(now, radius_m, rim_m)
            far_under = np.where(was, before[:, 2], now[:, 2]) < rim_m - _UNDER_RIM_M
            findings.tunnelled += int(((was != is_in) & far_under).sum())
        findings.tunnelled += int((self._simulation.bead_positions[:, 2] < -_LANDING_M).sum())
        self._before = frames

    def _frames(self) -> list[tuple[np.ndarray, float, float]]:
        """Every bead in the frame of every vessel, with the vessel's radius and rim."""
        beads = self._simulation.bead_positions
        frames = [
            (beads - np.array([*bowl.position, 0.0]), bowl.radius_m, bowl.height_m)
            for bowl in self._props.bowls
        ]
        if self._props.cup is not None:
            cup = self._simulation.cup
            assert cup is not None
            in_cup = in_frame(beads, cup.position, cup.wxyz)
            frames.append((in_cup, self._props.cup.radius_m, self._props.cup.height_m))
        return frames


def _inside(places: np.ndarray, radius_m: float, rim_m: float) -> np.ndarray:
    # In a jerk a bead may sink into a wall for a moment; it is out when it is past the wall.
    aside = np.hypot(places[:, 0], places[:, 1])
    between = (places[:, 2] > -WALL_M) & (places[:, 2] < rim_m)
    inside: np.ndarray = (aside < radius_m + 2 * WALL_M) & between
    return inside


def main() -> None:
    """Drive in every world."""
    parser = argparse.ArgumentParser(description="Drive at random and look for accidents.")
    parser.add_argument("--drives", type=int, default=1000, help="of ten seconds each, a world")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    for name, props in WORLDS.items():
        findings = random_drives(open_pack(), props, arguments.drives, arguments.seed)
        print(f"{name}: {arguments.drives} drives, {findings}", flush=True)


if __name__ == "__main__":
    main()
