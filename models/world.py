"""The arm, the table and the props as one compiled MuJoCo world."""

from functools import cache

import mujoco
import numpy as np

from .panda import HAND_FRAME, JOINT_NAMES
from .panda_pack import PandaPack
from .props import (
    TABLE_HALF_SIZE,
    TABLE_MIDDLE,
    TABLE_TOP_M,
    WALL_M,
    Beads,
    Cup,
    Obstacle,
    Props,
    heap,
)

TIMESTEP_S = 1.0 / 240.0
# With beads every step costs ten times as much; the arm follows its target as well in longer ones.
BEADS_TIMESTEP_S = 1.0 / 120.0
CUP, GRIP, OBSTACLE = "cup", "grip", "obstacle"  # names in the compiled world
# Stiffness and damping of the joints' position servos. Chosen so that the arm follows a joint
# target at full speed within 0.02 s and without ringing (tests/models/test_touching.py).
_SERVO_KP = np.array([4500.0, 4500.0, 3500.0, 3500.0, 2000.0, 2000.0, 2000.0])  # [N m/rad]
_SERVO_KD = 0.02 * _SERVO_KP  # [N m s/rad]; at 1 rad/s the arm trails its target by 0.02 rad
_ARMATURE = 0.1  # reflected rotor inertia, [kg m^2]
# No joint pushes harder: the URDF's limits, but more at the wrist, where those are too weak to
# brake what an obstacle sets in motion. Free motion needs less than that.
_MAX_TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 30.0, 30.0, 30.0])  # [N m]

# The open fingers and what is between them: half sizes, and how far from the flange.
_FINGERS_SIZE_M = [0.012, 0.036, 0.029]
_FINGERS_MIDDLE_M = 0.085

# Who touches whom: bits of MuJoCo's contact masks. The cup passes through the arm that holds it.
_ARM, _BEAD, _CUP, _HAND = 1, 2, 4, 8
_ROUND = 10  # wall boxes of a cup or a bowl
# MuJoCo's solimp of what must not be pushed into: the whole arm gets a few millimetres far.
_HARD = [0.95, 0.999, 0.001, 0.5, 2.0]
_CUP_KG = 0.15
_BEAD_KG = 0.001
_DRAG_PER_S = 3.0  # share of its speed that a bead loses in a second
_DEEP_M = 0.05
# To the beads the cup's walls are this thick, outwards: however hard the hand jerks when something
# lets it go, no bead gets to the middle of a wall in one time step.
_CUP_WALL_M = 0.014
_UPSIDE_DOWN = (0.0, 1.0, 0.0, 0.0)  # the cup's orientation in the frame of a hand that points down
_SETTLE_S = 2.0


@cache
def compiled(pack: PandaPack, props: Props = Props()) -> mujoco.MjModel:
    """The world of a pack and props; one serves every simulation, which only reads it."""
    spec = _arm_and_table(pack)
    if props.obstacle is not None:
        _add_obstacle(spec, props.obstacle)
    for bowl in props.bowls:
        body = spec.worldbody.add_body(pos=[*bowl.position, TABLE_TOP_M])
        # Its floor goes down into the table, so that a falling bead finds its top side nearest.
        _add_walls(body, bowl.radius_m, bowl.height_m, WALL_M, _DEEP_M, _ARM | _BEAD | _CUP)
    if props.cup is not None:
        _add_cup(spec, props.cup)
    if props.beads is not None:
        spec.option.timestep = BEADS_TIMESTEP_S
        _add_beads(spec, props.beads)
    return spec.compile()


@cache
def settled(cup: Cup, beads: Beads) -> np.ndarray:
    """Where the beads lie in an upright cup, ``(n, 3)`` in [m] in the cup's frame; only read it."""
    spec = mujoco.MjSpec()
    spec.option.timestep = BEADS_TIMESTEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    _add_walls(spec.worldbody, cup.radius_m, cup.height_m, _CUP_WALL_M, _CUP_WALL_M, _BEAD)
    _add_beads(spec, beads)
    mj_model = spec.compile()
    mj_data = mujoco.MjData(mj_model)
    mj_data.qpos[:] = heap(cup, beads).ravel()
    mujoco.mj_step(mj_model, mj_data, round(_SETTLE_S / BEADS_TIMESTEP_S))
    places: np.ndarray = mj_data.qpos.reshape(-1, 3).copy()
    places.flags.writeable = False
    return places


def _arm_and_table(pack: PandaPack) -> mujoco.MjSpec:
    # The URDF has no pictures MuJoCo could read and fixed links we must not lose (the hand frame).
    urdf = pack.urdf.read_text().replace(
        "<link ",
        f'<mujoco><compiler meshdir="{pack.folder}" strippath="false" discardvisual="true" '
        'fusestatic="false"/></mujoco><link ',
        1,
    )
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.timestep = TIMESTEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for body in spec.bodies:
        body.gravcomp = 1.0  # the real arm compensates its own weight
    for index, name in enumerate(JOINT_NAMES):
        joint = spec.joint(name)
        joint.armature = _ARMATURE
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=_SERVO_KP[index], kv=_SERVO_KD[index])
        servo.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        servo.forcerange = [-_MAX_TORQUE[index], _MAX_TORQUE[index]]
    finger = spec.joint("panda_finger_joint1")
    finger.armature = 0.01
    servo = spec.add_actuator(
        name=finger.name, target=finger.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )
    servo.set_to_position(kp=400.0, kv=40.0)
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[*TABLE_HALF_SIZE, 0.02],
        pos=[*TABLE_MIDDLE, TABLE_TOP_M - 0.02],
        priority=1,
        solimp=_HARD,
    )
    # The base is bolted to the table; neighbours in the chain overlap by design.
    spec.add_exclude(bodyname1="world", bodyname2="panda_link0")
    spec.add_exclude(bodyname1="world", bodyname2="panda_link1")
    spec.add_exclude(bodyname1="panda_link5", bodyname2="panda_link7")
    spec.add_exclude(bodyname1="panda_link7", bodyname2="panda_hand")
    return spec


def _add_obstacle(spec: mujoco.MjSpec, obstacle: Obstacle) -> None:
    half_m = obstacle.height_m / 2
    spec.worldbody.add_geom(
        name=OBSTACLE,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[obstacle.radius_m, half_m, 0.0],
        pos=[*obstacle.position, TABLE_TOP_M + half_m],
        contype=_ARM | _BEAD | _CUP | _HAND,
        conaffinity=0,
        priority=1,
        solimp=_HARD,
    )
    # It meets the open fingers as one block, or it would force its way between them.
    spec.body("panda_hand").add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=_FINGERS_SIZE_M,
        pos=[0.0, 0.0, _FINGERS_MIDDLE_M],
        contype=0,
        conaffinity=_HAND,
        mass=0.0,
    )


def _add_cup(spec: mujoco.MjSpec, cup: Cup) -> None:
    # Its frame is in the middle below its floor, with z to the opening.
    body = spec.worldbody.add_body(name=CUP, pos=[*(cup.place or (0.0, 0.0)), TABLE_TOP_M])
    body.gravcomp = 1.0  # the arm knows what it holds; tilted by its weight, beads would creep
    body.add_freejoint()
    # The beads meet its walls; everything else meets a solid cylinder, which is quicker.
    _add_walls(body, cup.radius_m, cup.height_m, _CUP_WALL_M, _CUP_WALL_M, _BEAD)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[cup.radius_m + WALL_M, cup.height_m / 2, 0.0],
        pos=[0.0, 0.0, cup.height_m / 2],
        contype=_CUP,
        conaffinity=_CUP,
        mass=_CUP_KG,
    )
    spec.geom("table").contype |= _CUP
    spec.add_equality(
        name=GRIP,
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1=HAND_FRAME,
        name2=CUP,
        active=cup.place is None,
        data=[0.0, 0.0, 0.0, *cup.in_hand, *_UPSIDE_DOWN, 1.0, 0.0],
        solimp=[0.999, 0.9999, 0.001, 0.5, 2.0],
    )


def _add_beads(spec: mujoco.MjSpec, beads: Beads) -> None:
    # Beads that only shift and never turn look the same, cost half, and do not roll away.
    for _ in range(beads.count):
        body = spec.worldbody.add_body()
        for axis in np.eye(3):
            body.add_joint(
                type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, damping=_BEAD_KG * _DRAG_PER_S
            )
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[beads.radius_m, 0.0, 0.0],
            mass=_BEAD_KG,
            contype=_BEAD,
            conaffinity=_BEAD,
            condim=1,
        )
    # For beads the table is a plane: however fast they fall, they do not get through.
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[1.0, 1.0, 1.0],
        pos=[0.0, 0.0, TABLE_TOP_M],
        contype=_BEAD,
        conaffinity=0,
        priority=1,
        friction=[0.3, 0.0, 0.0],
    )


def _add_walls(
    body: mujoco.MjsBody, radius_m: float, height_m: float, wall_m: float, floor_m: float, mask: int
) -> None:
    """Boxes round the body's z axis, and a floor whose upper side is WALL_M high.

    Beads slide on them without friction, as they do on each other: like balls that roll.
    """
    both = {"contype": mask, "conaffinity": 0, "condim": 1, "priority": 1, "solimp": _HARD}
    out_m, half_m = radius_m + wall_m / 2, (radius_m + wall_m) * np.tan(np.pi / _ROUND)
    for angle in 2 * np.pi * np.arange(_ROUND) / _ROUND:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[wall_m / 2, half_m, height_m / 2],
            pos=[out_m * np.cos(angle), out_m * np.sin(angle), height_m / 2],
            quat=[np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)],
            mass=0.0,
            **both,
        )
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius_m + WALL_M / 2, floor_m / 2, 0.0],
        pos=[0.0, 0.0, WALL_M - floor_m / 2],
        mass=0.0,
        **both,
    )
