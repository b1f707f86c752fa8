"""The paper's figure of an alignment: where the hand goes for up, down, left, right, everywhere."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .arrays import JointPositions
from .evaluation import step
from .kinematics import Kinematics
from .mapping import Mapping
from .tasks import Task

STICKS = {"up": (0.0, 1.0), "down": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}


@dataclass(frozen=True)
class Field:
    """Points over the workspace, and the hand's moves from each.

    Attributes:
        points: In the task's two DoF, ``(p, 2)``.
        moves: One step for each of :data:`STICKS` in their order, ``(p, 4, 2)``.
    """

    points: Float[np.ndarray, "p 2"]
    moves: Float[np.ndarray, "p 4 2"]


def learned_field(
    mapping: Mapping,
    kinematics: Kinematics,
    task: Task,
    grid: tuple[int, int] = (5, 5),
    states: JointPositions | None = None,
) -> Field:
    """Push the stick to all four sides at points over the workspace.

    Args:
        mapping: What to show.
        kinematics: The arm.
        task: Whose workspace and degrees of freedom.
        grid: Points along each DoF.
        states: Joint positions ``(p, 7)`` of the points, as :meth:`Task.spread` found them before;
            found anew if None.
    """
    s = task.spread(kinematics, grid) if states is None else states
    before = kinematics.hand_pose(s)
    moves = []
    for stick in STICKS.values():
        h = np.broadcast_to(np.array(stick), (len(s), 2))
        moves.append(task.dof_change(before, kinematics.hand_pose(step(mapping, h, s))))
    return Field(task.dof(before), np.stack(moves, axis=1))
