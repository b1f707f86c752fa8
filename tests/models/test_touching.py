"""Nothing gets through anything, and touching does no harm to the arm."""

import numpy as np
import pytest

from models.panda import Q_MAX, Q_MIN, QD_MAX
from models.props import WALL_M, Beads, Bowl, Obstacle, Props
from models.world import settled
from tests.models.hand_driving import (
    BEADS,
    CUP,
    DT_S,
    FULL,
    POST,
    START,
    cup_in_hand,
    distance,
    drive,
    geoms,
    hand_geoms,
    put_beads,
    started,
    wait,
)
from tests.soak.random_drives import WORLDS, random_drives

# The arm.


@pytest.mark.parametrize("props", [Props(), FULL], ids=["empty", "full cup"])
def test_the_arm_follows_its_target_at_full_speed_and_stops_there(pack, props):
    sim = started(pack, props)
    # Away from the table, from where the others stand still meanwhile.
    speed = np.array([1.0, -1.0, 1.0, 1.0, 1.0, -1.0, 1.0]) * QD_MAX
    for joint in range(7):
        sim.reset(START)
        for tick in range(60):
            if tick < 20:
                target = sim.target
                target[joint] += speed[joint] * DT_S
                sim.set_target(target)
            sim.step(DT_S)
            behind = (sim.target - sim.q)[joint] * np.sign(speed[joint])
            assert -0.02 < behind < 0.06, (joint, tick)
        assert np.abs(sim.q - sim.target).max() < 5e-4


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_no_joint_can_be_driven_beyond_its_limit(pack, joint, way):
    sim = started(pack, FULL)
    for _ in range(200):
        target = sim.target
        target[joint] += way * QD_MAX[joint] * DT_S
        sim.set_target(target)
        sim.step(DT_S)
        assert np.all((sim.q > Q_MIN - 0.01) & (sim.q < Q_MAX + 0.01))


# Nothing gets through.


def test_beads_that_fall_from_high_get_through_neither_bowl_nor_table(pack, rng):
    bowl = Bowl("b", (0.6, 0.2), 0.09, 0.05)
    sim = started(pack, Props(bowls=(bowl,), cup=CUP, beads=BEADS))
    places = np.column_stack([rng.uniform(-0.05, 0.05, (20, 2)), np.linspace(0.8, 1.4, 20)])
    for middle in (bowl.position, (0.3, -0.3)):
        put_beads(sim, places + np.array([*middle, 0.0]))
        lowest = np.inf
        for _ in range(150):
            sim.step(DT_S)
            lowest = min(lowest, sim.bead_positions[:, 2].min())
        assert lowest > -0.03  # in the middle of the fastest landing
        assert sim.bead_positions[:, 2].min() > 0.005
        if middle == bowl.position:
            assert sim.beads_in("b") == 20
            assert sim.bead_positions[:, 2].min() > WALL_M + 0.005


def test_a_heap_of_beads_stays_in_a_full_bowl(pack):
    beads, bowl = Beads(60), Bowl("b", (0.4, 0.2), 0.035, 0.05)
    sim = started(pack, Props(bowls=(bowl,), cup=CUP, beads=beads))
    put_beads(sim, settled(CUP, beads) + np.array([*bowl.position, 0.002]))
    wait(sim, 2.0)
    assert sim.beads_in("b") == 60
    assert sim.bead_positions[:, 2].max() > 0.02


@pytest.mark.parametrize("speed", [0.25, 1.0])
@pytest.mark.parametrize("held", [None, CUP], ids=["hand", "held cup"])
def test_neither_hand_nor_held_cup_gets_into_the_table(pack, kinematics, held, speed):
    sim = started(pack, Props(cup=held))
    table, ours = [sim._mj_model.geom("table").id], [*hand_geoms(sim), *geoms(sim, "cup")]
    nearest = np.inf
    for _ in drive(sim, kinematics, np.array([0.0, 0.0, -speed]), np.zeros(3), 3.0):
        nearest = min(nearest, distance(sim, ours, table))
    assert -0.006 < nearest < 0.0


@pytest.mark.parametrize("speed", [0.25, 1.0])
@pytest.mark.parametrize("props", [Props(POST), Props(POST, cup=CUP, beads=BEADS)])
@pytest.mark.parametrize("aside", [0.0, 0.05])
def test_pushing_into_the_obstacle_neither_gets_through_nor_launches_the_arm(
    pack, kinematics, props, aside, speed
):
    sim = started(pack, props)
    post, ours = [sim._mj_model.geom("obstacle").id], [*hand_geoms(sim), *geoms(sim, "cup")]
    way = speed * np.array([1.0, aside, 0.0]) / np.hypot(1.0, aside)
    touched = 0
    for tick in drive(sim, kinematics, way, np.zeros(3), 3.0):
        touched += sim.is_touching
        assert np.all(np.abs(sim._mj_data.qvel[:7]) < 2 * QD_MAX)
        assert np.all((sim.q > Q_MIN - 0.01) & (sim.q < Q_MAX + 0.01))
        if tick % 3 == 0:
            assert distance(sim, ours, post) > -0.006
    assert touched > 60
    # Away, and back to where it began: as if nothing had been.
    for _ in range(240):
        to_go = START - sim.target
        sim.set_target(sim.target + np.clip(to_go, -1.0 * DT_S, 1.0 * DT_S))
        sim.step(DT_S)
        assert np.all(np.abs(sim._mj_data.qvel[:7]) < 2 * QD_MAX)
    assert not sim.is_touching
    assert np.abs(sim.q - START).max() < 1e-3
    if props.cup is not None:
        assert cup_in_hand(sim)[0] == pytest.approx(CUP.in_hand, abs=1e-3)


def test_beads_on_the_obstacle_are_no_touch(pack):
    sim = started(pack, Props(Obstacle((0.3, 0.3), 0.1, 0.1), cup=CUP, beads=BEADS))
    put_beads(sim, settled(CUP, BEADS) + np.array([0.3, 0.3, 0.1]))
    wait(sim, 0.3)
    assert sim._mj_data.contact.geom.size
    assert (np.abs(sim.bead_positions[:, 2] - 0.106) < 0.003).any()
    assert not sim.is_touching


# At random.


@pytest.mark.parametrize("world", WORLDS)
def test_random_drives_at_full_speed_do_no_harm(pack, world):
    findings = random_drives(pack, WORLDS[world], drives=3, seed=2)
    assert findings.tunnelled == 0
    assert findings.nans == 0
    assert findings.lowest_m > -0.005
    assert findings.limit_excess_rad < 0.01
    assert findings.fastest < 2.0
