"""Pour a cup: the hand reaches out and in, and tilts what it holds (the user study's Pour)."""

from dataclasses import dataclass, field

import numpy as np

from ..arrays import DofChange, JointPositions
from ..beads import BeadCounts
from ..demonstrations import joints_at
from ..kinematics import HandPose, Kinematics
from ..props import Beads, Bowl, Cup, Props
from ..simulation import Simulation
from .attempt import Attempt, Phase, Progress, hand_pose
from .base import LEVER_M, Task

_REACH_M = (0.38, 0.64)
_TILT_RAD = (-0.3, 2.3)
_START_M = 0.51  # the hand's reach where the cup is filled
_START_SPREAD_M = 0.03
CUP = Cup()
BEADS = Beads()
_BOWL_RADIUS_M, _BOWL_HEIGHT_M = 0.065, 0.05
# Beads leave the tilted cup beside the line that the hand moves along.
_BESIDE_M = -0.035
_ENOUGH = 0.7  # of a cup
_FAR, _NEAR = 0, 1  # of the bowls
_EMPTY = 2  # beads that may stay in a cup that counts as empty
# No bead has come or gone anywhere for so long, which is longer than one falls: it is over.
_STILL_S = 0.6
_UPRIGHT_RAD = 0.2


def _upright() -> JointPositions:
    # The hand at x = 0.51 m, y = 0, z = 0.3 m, pointing down, the elbow in the arm's own plane.
    return np.array([0.0, -0.08094, 0.0, -2.23940, 0.0, 2.15846, np.pi / 4])


def _box() -> tuple[np.ndarray, np.ndarray]:
    low, high = (np.array([_REACH_M[end], LEVER_M * _TILT_RAD[end]]) for end in (0, 1))
    return low, high


def _along_and_about_x() -> np.ndarray:
    axes = np.zeros((6, 2))
    axes[0, 0], axes[3, 1] = 1.0, 1.0 / LEVER_M
    return axes


@dataclass(frozen=True)
class TiltMotion:
    """The hand's reach away from the base, and its tilt about that direction.

    Attributes:
        height_m: Of the hand over the table.
        home_q: Where the arm starts.
        workspace: Of reach and tilt.
        axes: See :class:`TwoDofMotion`.
    """

    height_m: float = 0.30
    home_q: JointPositions = field(default_factory=_upright)
    workspace: tuple[np.ndarray, np.ndarray] = field(default_factory=_box)
    axes: np.ndarray = field(default_factory=_along_and_about_x)

    def dof(self, pose: HandPose) -> DofChange:
        """The hand's x and its tilt from pointing down, both in [m]."""
        tilt = np.arctan2(-pose.rotation[..., 2, 1], -pose.rotation[..., 1, 1])
        return np.stack([pose.position[..., 0], LEVER_M * tilt], axis=-1)

    def pose_at(self, dof: DofChange) -> HandPose:
        """The hand over a point of the line y = 0, tilted about it."""
        batch = dof.shape[:-1]
        position = np.broadcast_to(np.array([0.0, 0.0, self.height_m]), (*batch, 3)).copy()
        position[..., 0] = dof[..., 0]
        tilt = dof[..., 1] / LEVER_M
        rotation = np.zeros((*batch, 3, 3))
        rotation[..., 0, 0] = 1.0
        rotation[..., 1, 1], rotation[..., 1, 2] = -np.cos(tilt), np.sin(tilt)
        rotation[..., 2, 1], rotation[..., 2, 2] = -np.sin(tilt), -np.cos(tilt)
        return HandPose(position, rotation)


def bowl_at(name: str, reach_m: float) -> Bowl:
    """A bowl where the beads fall when the hand tilts the cup at that reach, in [m]."""
    x = reach_m + CUP.in_hand[0]
    return Bowl(name, (x, _BESIDE_M), _BOWL_RADIUS_M, _BOWL_HEIGHT_M)


@dataclass
class Pouring:
    """Watches one cup being emptied: how much went where, and whether it is over."""

    simulation: Simulation
    bowl: int
    still_s: float = 0.0
    seen: BeadCounts = field(init=False)  # when last looked

    def __post_init__(self) -> None:
        """Look for the first time."""
        self.seen = self.simulation.bead_counts

    def watch(self, dt_s: float) -> None:
        """Count the beads, and note whether they still come."""
        now = self.simulation.bead_counts
        self.still_s = self.still_s + dt_s if now == self.seen else 0.0
        self.seen = now

    @property
    def poured(self) -> int:
        """Beads in the right bowl."""
        return self.seen.in_bowls[self.bowl]

    @property
    def spilt(self) -> int:
        """Beads beside every bowl."""
        return self.seen.spilt

    @property
    def is_empty(self) -> bool:
        """Whether hardly anything is left and nothing falls any more."""
        return self.seen.in_cup <= _EMPTY and self.still_s >= _STILL_S

    @property
    def is_enough(self) -> bool:
        """Whether the right bowl has got its share."""
        return self.poured >= _ENOUGH * BEADS.count


class PourCupPhase(Phase):
    """Which bowl is poured into, and how it ended."""

    POUR_FAR = "pour-far"
    REFILL = "refill"  # back between the bowls, upright
    POUR_NEAR = "pour-near"
    DONE = "done"
    SPILT = "spilt"  # too little is in the bowls


class PouringTwice(Attempt):
    """A cup into the far bowl, back to have it filled again, and into the near bowl."""

    def __init__(self, simulation: Simulation) -> None:
        """Begin with a full cup in the hand."""
        super().__init__(simulation)
        self._far = Pouring(simulation, _FAR)
        self._near: Pouring | None = None
        self._in_far = 0  # beads of the first cup, which are used again
        self._spilt = 0

    def watch(self, dt_s: float) -> None:
        """Follow the pouring; fill the cup again where it began."""
        if self._near is not None:
            self._near.watch(dt_s)
            return
        self._far.watch(dt_s)
        if self._far.is_empty and self._is_at_start():
            self._in_far, self._spilt = self._far.poured, self._far.spilt
            self.simulation.refill()
            self._near = Pouring(self.simulation, _NEAR)

    @property
    def progress(self) -> Progress:
        """Which bowl, and what is in them."""
        near = self._near
        in_far = self._far.poured if near is None else self._in_far
        in_near = 0 if near is None else near.poured
        is_done = near is not None and near.is_empty
        enough = _ENOUGH * BEADS.count
        is_success = is_done and in_far >= enough and in_near >= enough
        if is_done:
            phase = PourCupPhase.DONE if is_success else PourCupPhase.SPILT
        elif near is not None:
            phase = PourCupPhase.POUR_NEAR
        elif self._far.is_empty:
            phase = PourCupPhase.REFILL
        else:
            phase = PourCupPhase.POUR_FAR
        return Progress(
            phase=phase,
            fraction=min(1.0, (in_far + in_near) / (2 * BEADS.count)),
            counts={
                "far bowl": in_far,
                "near bowl": in_near,
                "spilt": self._spilt + (self._far if near is None else near).spilt,
            },
            is_done=is_done,
            is_success=is_success,
        )

    def _is_at_start(self) -> bool:
        reach, tilt = POUR_CUP.motions[0].dof(hand_pose(self.simulation.hand))
        is_between = abs(reach - _START_M) < _START_SPREAD_M
        return bool(is_between and abs(tilt) < LEVER_M * _UPRIGHT_RAD)


def begin(simulation: Simulation, kinematics: Kinematics, rng: np.random.Generator) -> Attempt:
    """Hold a full cup between the bowls, a little to one side or the other."""
    reach = _START_M + rng.uniform(-_START_SPREAD_M, _START_SPREAD_M)
    simulation.reset(joints_at(POUR_CUP.motions[0], kinematics, np.array([[reach, 0.0]]))[0])
    return PouringTwice(simulation)


POUR_CUP = Task(
    "pour-cup",
    (TiltMotion(),),
    rotation_weight_m=LEVER_M,
    props=Props(bowls=(bowl_at("far", 0.60), bowl_at("near", 0.42)), cup=CUP, beads=BEADS),
    begin=begin,
    phases=PourCupPhase,
)
