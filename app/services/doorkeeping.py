"""How often somebody may knock: so many times a minute, by whatever they are known."""

from collections import OrderedDict, deque
from collections.abc import Callable

from app.errors import JoymapError

_WINDOW_S = 60.0
_KEPT = 10_000


class TooOften(JoymapError):
    """Somebody who knocks too often."""

    status_code = 429
    kind = "too-often"

    def __init__(self) -> None:
        """Say when to come back."""
        super().__init__("That was too often; please wait a minute and try again.")


class Doorkeeper:
    """Counts knocks in the last minute, by name. In memory: a restart forgets them."""

    def __init__(self, clock: Callable[[], float], a_minute: int = 20) -> None:
        """Let each name in so many times a minute."""
        self._clock = clock
        self._a_minute = a_minute
        self._knocks: OrderedDict[str, deque[float]] = OrderedDict()

    def admit(self, name: str) -> None:
        """Count a knock.

        Raises:
            TooOften: If there were too many in the last minute.
        """
        now = self._clock()
        knocks = self._knocks.setdefault(name, deque())
        self._knocks.move_to_end(name)
        while knocks and knocks[0] < now - _WINDOW_S:
            knocks.popleft()
        if len(knocks) >= self._a_minute:
            raise TooOften
        knocks.append(now)
        if len(self._knocks) > _KEPT:
            self._knocks.popitem(last=False)
