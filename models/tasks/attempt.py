"""One try at a task in the simulation: where it begins, how far it is, when it is over."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from ..arrays import JointPositions
from ..beads import rotation_matrix
from ..kinematics import HandPose
from ..simulation import HandState, Simulation


@dataclass(frozen=True)
class Progress:
    """How far an attempt is.

    Attributes:
        fraction: From 0 to 1.
        says: One sentence: what to do now, or how it ended.
        counts: Whatever the task counts, by a word for people.
        is_done: Whether it is over.
        is_success: Whether it is over and was achieved.
    """

    fraction: float
    says: str
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

    def press(self) -> str | None:
        """The button was pressed; a sentence if there is nothing to do with it."""
        return "There is nothing to grasp in this task."

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
        """None to speak of."""
        return Progress(0.0, "")


def hand_pose(hand: HandState) -> HandPose:
    """The hand's pose as tasks take it, from a quaternion (w, x, y, z)."""
    return HandPose(hand.position, rotation_matrix(hand.wxyz))
