"""The physical world: what is held, poured, hit and grasped behaves like the real thing."""

from collections.abc import Callable, Iterator

import mujoco
import numpy as np
import pytest

from models.errors import InputError
from models.kinematics import Kinematics
from models.panda import FINGER_OPEN_M, Q_MAX, Q_MIN, QD_MAX
from models.panda_pack import PandaPack
from models.props import HANDLE_SIZE_M, WALL_M, Beads, Bowl, Cup, Obstacle, Props
from models.simulation import GRASP_REACH_M, Simulation
from models.world import settled
from tests.soak.random_drives import BEAD_MASK, WORLDS, random_drives

DT_S = 1 / 60
# The hand 0.3 m over the table, pointing down.
START = np.array([0.0, -0.08094, 0.0, -2.2394, 0.0, 2.15846, np.pi / 4])
CUP, BEADS = Cup(), Beads()
FULL = Props(cup=CUP, beads=BEADS)
STANDING = Props(cup=Cup(place=(0.55, 0.1)), beads=BEADS)
POST = Obstacle((0.66, 0.0), 0.04, 0.4)

Drive = Callable[[Simulation, np.ndarray, np.ndarray, float], Iterator[int]]


@pytest.fixture
def drive(kinematics: Kinematics) -> Drive:
    """Move the hand at a velocity in [m/s] and a turn in [rad/s], as fast as the joints allow."""

    def go(sim: Simulation, v: np.ndarray, w: np.ndarray, seconds: float) -> Iterator[int]:
        for tick in range(round(seconds / DT_S)):
            jacobian = kinematics.jacobian(sim.target)
            damped = jacobian @ jacobian.T + 1e-4 * np.eye(6)
            a = jacobian.T @ np.linalg.solve(damped, np.concatenate([v, w]))
            a /= max(1.0, np.max(np.abs(a) / QD_MAX))
            sim.set_target(sim.target + a * DT_S)
            sim.step(DT_S)
            yield tick

    return go


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
        mujoco.mj_geomDistance(sim._mj_model, sim._mj_data, one, other, 0.2, None)
        for one in some
        for other in others
    )


def cup_in_hand(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """The cup's position in the hand frame and its axis there."""
    mujoco.mj_kinematics(sim._mj_model, sim._mj_data)
    hand, cup = np.empty(9), np.empty(9)
    mujoco.mju_quat2Mat(hand, sim.hand.wxyz)
    mujoco.mju_quat2Mat(cup, sim.cup.wxyz)
    hand = hand.reshape(3, 3)
    return hand.T @ (sim.cup.position - sim.hand.position), hand.T @ cup.reshape(3, 3)[:, 2]


def put_beads(sim: Simulation, places: np.ndarray) -> None:
    sim._mj_data.qpos[16:] = places.ravel()
    sim._mj_data.qvel[15:] = 0.0


def hand_geoms(sim: Simulation) -> list[int]:
    return geoms(sim, "panda_hand", "panda_leftfinger", "panda_rightfinger")


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


def test_a_full_cup_keeps_its_beads_when_the_hand_starts_and_stops(pack, drive):
    sim = started(pack, FULL)
    level, still = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [-1, 1], [1, -1]]), np.zeros(3)
    for seconds in (0.2, 0.35, 0.5):
        for way in level:
            run(drive(sim, 0.25 * np.array([*way, 0.0]) / np.linalg.norm(way), still, seconds))
            wait(sim, 0.1)
        for way in (1.0, -1.0):
            run(drive(sim, np.array([0.0, 0.0, 0.25 * way]), still, seconds))
    wait(sim, 0.5)
    assert sim.beads_in_cup == 20
    position, _ = cup_in_hand(sim)
    assert position == pytest.approx(CUP.in_hand, abs=2e-3)


@pytest.mark.parametrize("speed", [30.0, 90.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cup_tilted_by_120_degrees_pours_everything_clear_of_the_fingers(
    pack, drive, side, speed
):
    sim = started(pack, FULL)
    beads = np.flatnonzero(sim._mj_model.geom_bodyid >= sim._first_bead).tolist()
    fingers = geoms(sim, "panda_leftfinger", "panda_rightfinger")
    turn = np.array([np.radians(speed) * side, 0.0, 0.0])
    nearest = np.inf
    for tick in drive(sim, np.zeros(3), turn, 120.0 / speed):
        nearest = min(nearest, distance(sim, beads, fingers)) if tick % 3 == 0 else nearest
    for _ in range(60):
        sim.step(DT_S)
        nearest = min(nearest, distance(sim, beads, fingers))
    assert sim.beads_in_cup == 0
    assert sim.beads_spilt == 20
    assert nearest > 0.005


def test_an_upright_turn_pours_nothing(pack, drive):
    sim = started(pack, FULL)
    run(drive(sim, np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.5))
    assert sim.beads_in_cup == 20


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_poured_over_a_bowl_stays_in_it(pack, drive, side):
    bowl = Bowl("under", (0.51 + CUP.in_hand[0], -0.06 * side), 0.08, 0.05)
    sim = started(pack, Props(bowls=(bowl,), cup=CUP, beads=BEADS))
    poured = 0
    run(drive(sim, np.zeros(3), np.array([np.radians(45.0) * side, 0.0, 0.0]), 120.0 / 45.0))
    for _ in range(240):
        sim.step(DT_S)
        assert sim.beads_in("under") >= poured
        poured = sim.beads_in("under")
        assert poured + sim.beads_spilt + sim.beads_in_cup <= 20
    assert poured >= 18
    assert poured + sim.beads_spilt == 20


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
def test_neither_hand_nor_held_cup_gets_into_the_table(pack, drive, held, speed):
    sim = started(pack, Props(cup=held))
    table, ours = [sim._mj_model.geom("table").id], [*hand_geoms(sim), *geoms(sim, "cup")]
    nearest = np.inf
    for _ in drive(sim, np.array([0.0, 0.0, -speed]), np.zeros(3), 3.0):
        nearest = min(nearest, distance(sim, ours, table))
    assert -0.006 < nearest < 0.0


@pytest.mark.parametrize("speed", [0.25, 1.0])
@pytest.mark.parametrize("props", [Props(POST), Props(POST, cup=CUP, beads=BEADS)])
@pytest.mark.parametrize("aside", [0.0, 0.05])
def test_pushing_into_the_obstacle_neither_gets_through_nor_launches_the_arm(
    pack, drive, props, aside, speed
):
    sim = started(pack, props)
    post, ours = [sim._mj_model.geom("obstacle").id], [*hand_geoms(sim), *geoms(sim, "cup")]
    way = speed * np.array([1.0, aside, 0.0]) / np.hypot(1.0, aside)
    touched = 0
    for tick in drive(sim, way, np.zeros(3), 3.0):
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
    put_beads(sim, CUP.radius_m / 0.035 * settled(CUP, BEADS) + np.array([0.3, 0.3, 0.1]))
    wait(sim, 0.3)
    assert sim._mj_data.contact.geom.size
    assert (np.abs(sim.bead_positions[:, 2] - 0.106) < 0.003).any()
    assert not sim.is_touching


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


def over_the_handle(sim: Simulation, kinematics: Kinematics, away_m: float) -> None:
    """Put the hand where it would hold the standing cup, or so far over that."""
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


def test_a_cup_out_of_reach_is_not_grasped_and_nothing_changes(pack, kinematics):
    sim = Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, GRASP_REACH_M + 0.01)
    before = sim._mj_data.qpos.copy()
    assert not sim.grasp()
    assert not sim.is_holding
    assert np.array_equal(sim._mj_data.qpos, before)
    sim.step(DT_S)
    assert sim._mj_data.qpos[7:9] == pytest.approx([FINGER_OPEN_M] * 2, abs=1e-3)


@pytest.mark.parametrize("away_m", [0.0, GRASP_REACH_M - 0.01])
def test_a_grasped_cup_does_not_jump_and_comes_along(pack, kinematics, drive, away_m):
    sim, other = Simulation(pack, STANDING), Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, away_m)
    wait(sim, 0.5)
    before, placed = cup_in_hand(sim), sim.cup.position
    assert sim.grasp()
    assert sim.is_holding
    assert sim.grasp()
    wait(sim, 1.0)
    assert sim.cup.position == pytest.approx(placed, abs=1e-3)
    assert sim._mj_data.qpos[7:9] == pytest.approx([HANDLE_SIZE_M[1] / 2] * 2, abs=1e-3)
    run(drive(sim, np.array([0.0, 0.0, 0.2]), np.zeros(3), 1.0))
    wait(sim, 0.5)
    assert sim.cup.position[2] > 0.15
    for now, then in zip(cup_in_hand(sim), before, strict=True):
        assert now == pytest.approx(then, abs=1e-3)
    assert sim.beads_in_cup == 20
    # Somebody else's cup in an equal world stands where it stood.
    over_the_handle(other, kinematics, 0.0)
    assert not other.is_holding
    assert other.grasp()
    wait(other, 0.3)
    assert other.cup.position == pytest.approx([0.55, 0.1, 0.0], abs=1e-3)
    wait(sim, 0.3)
    assert cup_in_hand(sim)[0] == pytest.approx(before[0], abs=1e-3)
    sim.reset(START)
    assert not sim.is_holding
    assert sim.cup.position == pytest.approx([0.55, 0.1, 0.0], abs=1e-9)


def test_the_hand_passes_through_the_cup_that_it_may_grasp(pack, kinematics, drive):
    sim = Simulation(pack, STANDING)
    over_the_handle(sim, kinematics, 0.0)
    run(drive(sim, np.array([0.1, 0.0, 0.0]), np.zeros(3), 0.5))
    assert distance(sim, geoms(sim, "cup"), hand_geoms(sim)) < -0.005
    assert sim.cup.position == pytest.approx([0.55, 0.1, 0.0], abs=1e-3)
    assert sim.grasp()


# Beginning again.


def test_refilled_beads_rest_in_the_cup_wherever_it_is_held(pack, drive):
    sim = started(pack, FULL)
    run(drive(sim, np.zeros(3), np.array([1.5, 0.0, 0.0]), 1.4))
    wait(sim, 0.5)
    run(drive(sim, np.array([0.0, 0.0, 0.0]), np.array([-1.5, 0.0, 0.0]), 1.4))
    run(drive(sim, np.array([0.0, 0.2, 0.0]), np.zeros(3), 0.5))
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
def test_after_a_reset_the_same_drive_is_the_same_to_the_bit(pack, drive, props):
    sim = Simulation(pack, props)
    ends = []
    for _ in range(2):
        sim.reset(START)
        sim.grasp()
        run(drive(sim, np.array([0.2, 0.1, -0.1]), np.array([0.5, 0.0, 0.0]), 1.5))
        ends.append(np.concatenate([sim._mj_data.qpos, sim._mj_data.qvel]))
    assert np.array_equal(*ends)


# At random.


@pytest.mark.parametrize("world", WORLDS)
def test_random_drives_at_full_speed_do_no_harm(pack, world):
    findings = random_drives(pack, WORLDS[world], drives=3, seed=2)
    assert findings.tunnelled == 0
    assert findings.nans == 0
    assert findings.lowest_m > -0.005
    assert findings.limit_excess_rad < 0.01
    assert findings.fastest < 2.0
