"""The control loop: a tick for each live session sixty times a second, one after the other.

The sessions' turns are spread over the period, and between any two of them the sockets get theirs:
what a person's stick says is in their own next tick, and its pose is out right after it, however
many others drive.
"""

import asyncio
from collections.abc import Callable

from app.teleop.live_session import LiveSession

_SPREAD = 0.618  # of a period between a session's turn and the next one's that comes
_CATCH_UP_S = 0.003  # at most what a late tick lets the next one come sooner


class ControlLoop:
    """Ticks the sessions. ``tick`` knows no clock; ``run`` hands it the time."""

    def __init__(self, rate_hz: float) -> None:
        """Begin without sessions."""
        self.period_s = 1.0 / rate_hz
        self.sessions: dict[str, LiveSession] = {}
        self._due_s: dict[str, float] = {}
        self._come = 0

    def tick(self, now_s: float) -> None:
        """Let one period pass for the session whose turn has come, if one's has."""
        self._give_turns(now_s)
        first = min(self._due_s, key=self._due_s.__getitem__, default=None)
        if first is None or now_s < self._due_s[first]:
            return
        # A late loop leaves time out: the arm does not leap to catch up.
        self._due_s[first] = max(self._due_s[first], now_s - _CATCH_UP_S) + self.period_s
        self.sessions[first].tick(now_s, self.period_s)

    def wait_s(self, now_s: float) -> float:
        """For how long it is nobody's turn, in [s]."""
        self._give_turns(now_s)
        return max(0.0, min(self._due_s.values(), default=now_s + self.period_s) - now_s)

    async def run(self, clock: Callable[[], float], speed: float = 1.0) -> None:
        """Tick on time until cancelled, by a clock that goes so much faster than the machine's."""
        while True:
            await asyncio.sleep(self.wait_s(clock()) / speed)
            self.tick(clock())

    def _give_turns(self, now_s: float) -> None:
        if self._due_s.keys() == self.sessions.keys():
            return
        for gone in self._due_s.keys() - self.sessions.keys():
            del self._due_s[gone]
        for new in self.sessions.keys() - self._due_s.keys():
            self._come += 1
            self._due_s[new] = now_s + self.period_s * (self._come * _SPREAD % 1.0)
