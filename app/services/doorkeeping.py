"""How often somebody may knock: so many times a minute, by whatever they are known."""

import math
import threading
from collections import OrderedDict, deque
from collections.abc import Callable

from app.doors import TooOften

# Times a minute: log-ins and set-ups of an address or a name, links that are nobody's of an
# address, requests of a login or a key.
LOG_INS = 20
WRONG_LINKS = 60
REQUESTS = 600

_WINDOW_S = 60.0
_KEPT = 10_000


class Doorkeeper:
    """Counts knocks in the last minute, by name. In memory: a restart forgets them."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Count by a clock in seconds that never goes back."""
        self._clock = clock
        self._knocks: OrderedDict[str, deque[float]] = OrderedDict()
        self._one_at_a_time = threading.Lock()

    def admit(self, name: str, a_minute: int = LOG_INS) -> None:
        """Count a knock; those that are refused do not count.

        Raises:
            TooOften: If there were as many already in the last minute.
        """
        now = self._clock()
        with self._one_at_a_time:
            knocks = self._knocks.setdefault(name, deque())
            self._knocks.move_to_end(name)
            while knocks and knocks[0] <= now - _WINDOW_S:
                knocks.popleft()
            if len(knocks) >= a_minute:
                raise TooOften(math.ceil(knocks[0] + _WINDOW_S - now))
            knocks.append(now)
            if len(self._knocks) > _KEPT:
                self._knocks.popitem(last=False)
