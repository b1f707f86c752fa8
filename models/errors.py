"""What can go wrong in the learning core.

::

    ModelsError
    ├── ShapeError            arrays that do not belong together
    ├── InputError            a number outside what it may be
    ├── UnknownTaskError      a task that does not exist
    ├── PandaPackError        the arm's asset pack is missing or damaged
    ├── CheckpointError       a file of weights that cannot be used
    └── TooFewLabelsError     nothing to learn from
"""


class ModelsError(Exception):
    """Base of every error of the learning core; the message is one sentence for a person."""


class ShapeError(ModelsError):
    """Arrays whose shapes disagree."""


class InputError(ModelsError):
    """A value outside its range, or not a number."""


class UnknownTaskError(ModelsError):
    """A task was named that does not exist."""


class PandaPackError(ModelsError):
    """The arm's asset pack is missing or damaged."""


class CheckpointError(ModelsError):
    """A file of weights that is missing, damaged or made for something else."""


class TooFewLabelsError(ModelsError):
    """An alignment was asked for with too few labels."""
