"""The strategies by name: the paper's, ours, and those that installed packages bring.

A package adds a strategy by an entry point in the group :data:`ENTRY_POINTS` that names a
:class:`Strategy`. It is then offered wherever strategies are: in simulations, studies, trainings
and drives.
"""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType

from .affine import AffineMethod
from .errors import InputError
from .fitting import Method
from .identity import IdentityMethod
from .priors import PriorWeights
from .task_space import TaskSpaceMethod
from .training import NetworkMethod, TrainingSettings

ENTRY_POINTS = "joymap.strategies"
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Strategy:
    """A method under the name that studies and files know it by.

    Attributes:
        name: The word in files and addresses.
        method: How the alignment is learned.
        needs_everything: Whether it is given what nobody has: an exact label for every state.
    """

    name: str
    method: Method
    needs_everything: bool = False


# Chosen on simulated people of all three tasks, with seeds from 100 to 105.
_PROPORTIONALITY = 0.5
_REVERSIBILITY = 0.5
_CONSISTENCY = 3.0

PAPER = (
    Strategy("no-align", IdentityMethod()),
    Strategy("manual-align", AffineMethod(), needs_everything=True),
    Strategy("no-priors", NetworkMethod()),
    Strategy(
        "proportionality",
        NetworkMethod(PriorWeights(proportionality=_PROPORTIONALITY)),
    ),
    Strategy(
        "reversibility",
        NetworkMethod(PriorWeights(reversibility=_REVERSIBILITY)),
    ),
    Strategy(
        "consistency",
        NetworkMethod(PriorWeights(consistency=_CONSISTENCY)),
    ),
    Strategy(
        "all-priors",
        NetworkMethod(PriorWeights(_PROPORTIONALITY, _REVERSIBILITY, _CONSISTENCY)),
    ),
    # With an exact label for every state, longer.
    Strategy(
        "ideal-align",
        NetworkMethod(settings=TrainingSettings(steps=1500)),
        needs_everything=True,
    ),
)
OURS = (Strategy("task-space", TaskSpaceMethod()),)


def get_strategy(name: str) -> Strategy:
    """The strategy of that name.

    Raises:
        InputError: If there is none.
    """
    if name not in STRATEGIES:
        raise InputError(f"There is no strategy '{name}'; choose one of: {', '.join(STRATEGIES)}.")
    return STRATEGIES[name]


def collect(installed: Iterable[EntryPoint]) -> Mapping[str, Strategy]:
    """The strategies by name, Joymap's own first.

    An entry point that cannot be loaded, is no strategy, or takes a name that is there already is
    left out, and the log says so.
    """
    found = {strategy.name: strategy for strategy in (*PAPER, *OURS)}
    for entry in installed:
        try:
            strategy = entry.load()
        except Exception as error:  # whatever a package that is not ours does
            _LOG.warning("The strategy '%s' cannot be loaded: %r.", entry.name, error)
            continue
        if not isinstance(strategy, Strategy) or strategy.name != entry.name:
            _LOG.warning("'%s' is not a strategy named '%s'.", entry.value, entry.name)
        elif strategy.name in found:
            _LOG.warning("There is a strategy '%s' already.", strategy.name)
        else:
            found[strategy.name] = strategy
    return MappingProxyType(found)


STRATEGIES = collect(entry_points(group=ENTRY_POINTS))
