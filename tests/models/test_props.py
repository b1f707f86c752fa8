"""What is held, poured, grasped and counted behaves like the real thing."""

import numpy as np
import pytest

from models.errors import InputError
from models.panda import FINGER_OPEN_M
from models.props import HANDLE_SIZE_M, Beads, Bowl, Cup, Obstacle, Props
from models.simulation import GRASP_REACH_M, HandState, Simulation
from tests.models.hand_driving import (
    BEADS,
    CUP,
    DT_S,
    FULL,
    POST,
    STANDING,
    START,
    cup_in_hand,
    distance,
    drive,
    geoms,
    hand_geoms,
    over_the_handle,
    put_beads,
    run,
    started,
    wait,
)
from tests.soak.random_drives import WORLDS

# What there can be.


@pytest.mark.parametrize(
    "make",
    [
        lambda: Obstacle((0.5, 0.0), 0.0, 0.3),
        lambda: Obstacle((0.5, 0.0), 0.05, float("nan")),
        lambda: Obstacle((0.5, 2.0), 0.05, 0.3),
        lambda: Bowl("", (0.5, 0.0), 0.07, 0.05),
        lambda: Bowl("far", (0.5, 0.0), 0.07, -0.05),
        lambda: Cup(height_m=0.01),
        lambda: Cup(place=(-2.0, 0.0)),
        lambda: Beads(count=0),
        lambda: Beads(radius_m=-0.006),
        lambda: Props(beads=BEADS),
        lambda: Props(cup=CUP, beads=Beads(count=2000)),
        lambda: Props(cup=CUP, beads=Beads(radius_m=0.04)),
        lambda: Props(bowls=(Bowl("a", (0.5, 0.0), 0.07, 0.05), Bowl("b", (0.6, 0.0), 0.07, 0.05))),
        lambda: Props(bowls=(Bowl("a", (0.5, 0.0), 0.07, 0.05), Bowl("a", (0.5, 0.3), 0.07, 0.05))),
        lambda: Props(obstacle=POST, cup=Cup(place=(0.66, 0.02))),
    ],
)
def test_what_makes_no_sense_is_refused(make):
    with pytest.raises(InputError, match=r"\.$"):
        make()


def test_equal_props_are_one_compiled_world(pack):
    one = Simulation(pack, Props(obstacle=Obstacle((0.5, 0.0), 0.05, 0.3)))
    other = Simulation(pack, Props(obstacle=Obstacle((0.5, 0.0), 0.05, 0.3)))
    assert one._mj_model is other._mj_model
    assert one._mj_model is not Simulation(pack)._mj_model


def test_a_world_without_props_has_nothing_in_it(pack):
    sim = Simulation(pack)
    assert sim.cup is None
    assert sim.bead_positions.shape == (0, 3)
    assert (sim.beads_in_cup, sim.beads_spilt) == (0, 0)
    assert not sim.is_touching
    assert not sim.is_holding
    assert not sim.grasp()
    sim.refill()
    with pytest.raises(InputError, match="no bowl 'far'"):
        sim.beads_in("far")


# The cup in the hand.


def test_the_held_cup_hangs_upright_from_closed_fingers_that_it_does_not_touch(pack):
    sim = started(pack, FULL)
    wait(sim, 1.0)
    position, axis = cup_in_hand(sim)
    assert sim.is_holding
    assert position == pytest.approx(CUP.in_hand, abs=1e-3)
    assert axis == pytest.approx([0.0, 0.0, -1.0], abs=5e-3)
    assert sim._mj_data.qpos[7:9] == pytest.approx([HANDLE_SIZE_M[1] / 2] * 2, abs=1e-3)
    assert distance(sim, geoms(sim, "cup"), hand_geoms(sim)) > 0.0
    bodies = sim._mj_model.geom_bodyid[sim._mj_data.contact.geom]
    assert not (bodies <= sim._mj_model.body("cup").id - 1).any()


@pytest.mark.parametrize("count", [20, 60])
def test_the_beads_lie_still_in_the_cup_from_the_start(pack, count):
    sim = started(pack, Props(cup=CUP, beads=Beads(count)))
    before = sim.bead_positions
    wait(sim, 1.0)
    assert sim.beads_in_cup == count
    assert np.linalg.norm(sim.bead_positions - before, axis=1).max() < 1e-3


def test_a_full_cup_keeps_its_beads_when_the_hand_starts_and_stops(pack, kinematics):
    sim = started(pack, FULL)
    level, still = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [-1, 1], [1, -1]]), np.zeros(3)
    for seconds in (0.2, 0.35, 0.5):
        for way in level:
            run(
                drive(
                    sim,
                    kinematics,
                    0.25 * np.array([*way, 0.0]) / np.linalg.norm(way),
                    still,
                    seconds,
                )
            )
            wait(sim, 0.1)
        for way in (1.0, -1.0):
            run(drive(sim, kinematics, np.array([0.0, 0.0, 0.25 * way]), still, seconds))
    wait(sim, 0.5)
    assert sim.beads_in_cup == 20
    position, _ = cup_in_hand(sim)
    assert position == pytest.approx(CUP.in_hand, abs=2e-3)


@pytest.mark.parametrize("speed", [30.0, 90.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cup_tilted_by_120_degrees_pours_everything_clear_of_the_fingers(
    pack, kinematics, side, speed
):
    sim = started(pack, FULL)
    beads = np.flatnonzero(sim._mj_model.geom_bodyid >= sim._first_bead).tolist()
    fingers = geoms(sim, "panda_leftfinger", "panda_rightfinger")
    turn = np.array([np.radians(speed) * side, 0.0, 0.0])
    nearest = np.inf
    for tick in drive(sim, kinematics, np.zeros(3), turn, 120.0 / speed):
        nearest = min(nearest, distance(sim, beads, fingers)) if tick % 3 == 0 else nearest
    for _ in range(60):
        sim.step(DT_S)
        nearest = min(nearest, distance(sim, beads, fingers))
    assert sim.beads_in_cup == 0
    assert sim.beads_spilt == 20
    assert nearest > 0.005


def test_an_upright_turn_pours_nothing(pack, kinematics):
    sim = started(pack, FULL)
    run(drive(sim, kinematics, np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.5))
    assert sim.beads_in_cup == 20


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_poured_over_a_bowl_stays_in_it(pack, kinematics, side):
    bowl = Bowl("under", (0.51 + CUP.in_hand[0], -0.06 * side), 0.08, 0.05)
    sim = started(pack, Props(bowls=(bowl,), cup=CUP, beads=BEADS))
    poured = 0
    run(
        drive(
            sim,
            kinematics,
            np.zeros(3),
            np.array([np.radians(45.0) * side, 0.0, 0.0]),
            120.0 / 45.0,
        )
    )
    for _ in range(240):
        sim.step(DT_S)
        assert sim.beads_in("under") >= poured
        poured = sim.beads_in("under")
        assert poured + sim.beads_spilt + sim.beads_in_cup <= 20
    assert poured >= 18
    assert poured + sim.beads_spilt == 20


# Counting.


def test_a_bead_in_the_air_is_not_spilt_and_one_on_the_table_is(pack):
    sim = started(pack, Props(bowls=(Bowl("b", (0.3, 0.3), 0.05, 0.05),), cup=CUP, beads=BEADS))
    places = sim.bead_positions
    places[0] = [0.3, -0.3, 0.2]  # in the air
    places[1] = [0.3, -0.3, 0.006]  # on the table
    places[2] = [0.3, 0.3, 0.02]  # in the bowl
    places[3] = [0.3, 0.3, 0.2]  # in the air over it
    put_beads(sim, places)
    assert (sim.beads_in_cup, sim.beads_in("b"), sim.beads_spilt) == (16, 1, 1)


# Grasping.


def test_a_cup_out_of_reach_is_not_grasped_and_nothing_changes(pack, kinematics):
    sim = Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, GRASP_REACH_M + 0.01)
    before = sim._mj_data.qpos.copy()
    assert not sim.grasp()
    assert not sim.is_holding
    assert np.array_equal(sim._mj_data.qpos, before)
    sim.step(DT_S)
    assert sim._mj_data.qpos[7:9] == pytest.approx([FINGER_OPEN_M] * 2, abs=1e-3)


def cup_of(sim: Simulation) -> HandState:
    assert sim.cup is not None
    return sim.cup


@pytest.mark.parametrize("away_m", [0.0, GRASP_REACH_M - 0.01])
def test_a_grasped_cup_does_not_jump_and_comes_along(pack, kinematics, away_m):
    sim, other = Simulation(pack, STANDING), Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, away_m)
    wait(sim, 0.5)
    before, placed = cup_in_hand(sim), cup_of(sim).position
    assert sim.grasp()
    assert sim.is_holding
    assert sim.grasp()
    wait(sim, 1.0)
    assert cup_of(sim).position == pytest.approx(placed, abs=1e-3)
    assert sim._mj_data.qpos[7:9] == pytest.approx([HANDLE_SIZE_M[1] / 2] * 2, abs=1e-3)
    run(drive(sim, kinematics, np.array([0.0, 0.0, 0.2]), np.zeros(3), 1.0))
    wait(sim, 0.5)
    assert cup_of(sim).position[2] > 0.15
    for now, then in zip(cup_in_hand(sim), before, strict=True):
        assert now == pytest.approx(then, abs=1e-3)
    assert sim.beads_in_cup == 20
    # Somebody else's cup in an equal world stands where it stood.
    over_the_handle(other, kinematics, 0.0)
    assert not other.is_holding
    assert other.grasp()
    wait(other, 0.3)
    assert cup_of(other).position == pytest.approx([0.55, 0.1, 0.0], abs=1e-3)
    wait(sim, 0.3)
    assert cup_in_hand(sim)[0] == pytest.approx(before[0], abs=1e-3)
    sim.reset(START)
    assert not sim.is_holding
    assert cup_of(sim).position == pytest.approx([0.55, 0.1, 0.0], abs=1e-9)


def test_the_hand_passes_through_the_cup_that_it_may_grasp(pack, kinematics):
    sim = Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, 0.0)
    run(drive(sim, kinematics, np.array([0.1, 0.0, 0.0]), np.zeros(3), 0.5))
    assert distance(sim, geoms(sim, "cup"), hand_geoms(sim)) < -0.005
    assert cup_of(sim).position == pytest.approx([0.55, 0.1, 0.0], abs=1e-3)
    assert sim.grasp()


# Beginning again.


def test_refilled_beads_rest_in_the_cup_wherever_it_is_held(pack, kinematics):
    sim = started(pack, FULL)
    run(drive(sim, kinematics, np.zeros(3), np.array([1.5, 0.0, 0.0]), 1.4))
    wait(sim, 0.5)
    run(drive(sim, kinematics, np.zeros(3), np.array([-1.5, 0.0, 0.0]), 1.4))
    run(drive(sim, kinematics, np.array([0.0, 0.2, 0.0]), np.zeros(3), 0.5))
    assert sim.beads_in_cup < 5
    sim.refill()
    assert sim.beads_in_cup == 20
    cup = sim._mj_data.qvel[9:12]
    assert np.linalg.norm(cup) > 0.1
    beads = sim._mj_data.qvel[15:].reshape(-1, 3)
    assert np.linalg.norm(beads - cup, axis=1).max() < 0.02
    wait(sim, 2.0)
    assert sim.beads_in_cup == 20


@pytest.mark.parametrize("props", [WORLDS["all of it"], STANDING])
def test_after_a_reset_the_same_drive_is_the_same_to_the_bit(pack, kinematics, props):
    sim = Simulation(pack, props)
    ends = []
    for _ in range(2):
        sim.reset(START)
        sim.grasp()
        run(drive(sim, kinematics, np.array([0.2, 0.1, -0.1]), np.array([0.5, 0.0, 0.0]), 1.5))
        ends.append(np.concatenate([sim._mj_data.qpos, sim._mj_data.qvel]))
    assert np.array_equal(ends[0], ends[1])
