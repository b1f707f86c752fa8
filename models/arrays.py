"""The shapes that go round, by name. ``*batch`` is any number of leading axes, also none.

The names are checked at run time where jaxtyping's import hook is installed (the tests do), and
are documentation everywhere else.
"""

import numpy as np
from jaxtyping import Float, Int
from torch import Tensor

# The arm.
JointPositions = Float[np.ndarray, "*batch 7"]  # s, [rad]
JointVelocities = Float[np.ndarray, "*batch 7"]  # a, [rad/s]
JointPath = Float[np.ndarray, "steps 7"]  # [rad]
HandPosition = Float[np.ndarray, "*batch 3"]  # [m], in the world
HandRotation = Float[np.ndarray, "*batch 3 3"]  # R_world_hand
HandJacobian = Float[np.ndarray, "*batch 6 7"]  # linear [m/rad] above angular [rad/rad]

# The two ends of the mapping.
HumanInput = Float[np.ndarray, "*batch 2"]  # h, the stick, in [-1, 1]^2
LatentAction = Float[np.ndarray, "*batch 2"]  # z, in [-1, 1]^2
LatentJacobian = Float[np.ndarray, "*batch 7 2"]  # da/dz, [rad/s]
DofChange = Float[np.ndarray, "*batch 2"]  # in the task's two degrees of freedom
PoseChange = Float[np.ndarray, "*batch d"]  # [m]; rotations, if they count, turned into metres

# Rows of numbers that mean the same thing.
Scalars = Float[np.ndarray, "*batch"]
Indices = Int[np.ndarray, "*batch"]

# The same, where gradients are wanted.
JointTensor = Float[Tensor, "*batch 7"]
PlaneTensor = Float[Tensor, "*batch 2"]
PositionTensor = Float[Tensor, "*batch 3"]
RotationTensor = Float[Tensor, "*batch 3 3"]
PoseChangeTensor = Float[Tensor, "*batch d"]
ScalarTensor = Float[Tensor, ""]
