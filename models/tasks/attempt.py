"""One try at a task in the simulation: where it begins, how far it is, when it is over."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import StrEnum

from ..arrays import JointPositions
from ..beads import rotation_matrix
from ..kinematics import HandPose
from ..simulation import HandState, Simulation


class Phase(StrEnum):
    """What is to be done now in an attempt, or how it ended; each task has its own phases."""


class FreePhase(Phase):
    """The phase of a task without a goal."""

    DRIVE = "drive"


class NoGrasp(StrEnum):
    """Why the button does nothing."""

    NOTHING_TO_GRASP = "nothing-to-grasp"
    OUT_OF_REACH = "out-of-reach"
    ALREADY_HELD = "already-held"


@dataclass(frozen=True)
class Progress:
    """How far an attempt is.

    Attributes:
        phase: One of the task's.
        fraction: From 0 to 1.
        counts: Whatever the task counts, by name.
        is_done: Whether it is over.
        is_success: Whether it is over and was achieved.
    """

    phase: Phase
    fraction: float
    counts: dict[str, int] = field(default_factory=dict)
    is_done: bool = False
    is_success: bool = False


class Attempt(ABC):
    """One try at a task. It watches the simulation and never steps it.

    Attributes:
        has_goal: Whether there is anything to achieve, and so an end.
    """

    has_goal = True

    def __init__(self, simulation: Simulation) -> None:
        """Watch a simulation that stands where the attempt begins."""
        self.simulation = simulation

    @abstractmethod
    def watch(self, dt_s: float) -> None:
        """Take in what happened in the ``dt_s`` seconds just simulated."""

    @property
    @abstractmethod
    def progress(self) -> Progress:
        """How far it is."""

    @property
    def can_grasp(self) -> bool:
        """Whether the button would grasp something now."""
        return False

    def press(self) -> NoGrasp | None:
        """The button was pressed; the reason if that does nothing."""
        return NoGrasp.NOTHING_TO_GRASP

    @property
    def way(self) -> JointPositions | None:
        """Where the arm goes by itself now, ``(7,)`` in [rad]; None: the person steers."""
        return None


class FreeDrive(Attempt):
    """Driving for its own sake: no goal and no end."""

    has_goal = False

    def watch(self, dt_s: float) -> None:
        """Nothing counts."""

    @property
    def progress(self) -> Progress:
        """Always the same."""
        return Progress(FreePhase.DRIVE, 0.0)


def hand_pose(hand: HandState) -> HandPose:
    """The hand's pose as tasks take it, from a quaternion (w, x, y, z)."""
    return HandPose(hand.position, rotation_matrix(hand.wxyz))
