"""Who holds a participant's stick, and where it is.

A connection holds it, not a tab: when a line is lost, the same page comes back by a new connection,
and what the server then learns of the old one's end must not take the stick from the new one.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)  # two connections are never the same
class Connection:
    """A page's websocket.

    Attributes:
        tab: The page's own id, the same each time it connects.
        generation: How many connections the page had before this one.
    """

    tab: str
    generation: int = 0


class StickLease:
    """The stick: one connection's to move; at rest when its input was not found for a while."""

    def __init__(self, silence_s: float) -> None:
        """Nobody holds it; it is at rest ``silence_s`` after it was last found, in [s]."""
        self.raw = np.zeros(2)
        self._silence_s = silence_s
        self._found_s = -np.inf
        self._holder: Connection | None = None
        self._last: Connection | None = None  # whose it was when a line was lost

    def connect(self, connection: Connection) -> None:
        """A page is there: a new one takes the stick, one that comes back only what was its own."""
        is_new = connection.generation == 0 or self._last is None
        if is_new or self._was_held_before(connection):
            self.take(connection)

    def take(self, connection: Connection) -> None:
        """This connection holds the stick from now on."""
        if connection is not self._holder:
            self._holder = self._last = connection
            self.let_go()

    def leave(self, connection: Connection) -> None:
        """This connection has ended; if it held the stick, nobody does."""
        if connection is self._holder:
            self._holder = None
            self.let_go()

    def is_held_by(self, connection: Connection) -> bool:
        """Whether this connection's stick counts."""
        return connection is self._holder

    def move(self, connection: Connection, x: float, y: float, found_s: float) -> None:
        """The stick was found at ``(x, y)`` in [-1, 1]² at ``found_s``, if it is theirs to say."""
        if connection is self._holder:
            self.raw = np.array([x, y])
            self._found_s = found_s

    def let_go(self) -> None:
        """The stick is released."""
        self.raw = np.zeros(2)
        self._found_s = -np.inf

    def is_silent(self, now_s: float) -> bool:
        """Whether nothing that could push it has been found for too long."""
        return now_s - self._found_s > self._silence_s

    def _was_held_before(self, connection: Connection) -> bool:
        """Whether the page of this connection held the stick last, by an earlier one."""
        last = self._last
        return (
            last is not None
            and last.tab == connection.tab
            and last.generation < connection.generation
        )
