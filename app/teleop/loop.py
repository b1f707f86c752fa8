"""The control loop: one tick for every live session, sixty times a second."""

import asyncio
from collections.abc import Callable

from app.teleop.live_session import LiveSession


class ControlLoop:
    """Ticks the sessions. ``tick`` knows no clock; ``run`` hands it the time."""

    def __init__(self, rate_hz: float) -> None:
        """Begin without sessions."""
        self.period_s = 1.0 / rate_hz
        self.sessions: dict[str, LiveSession] = {}

    def tick(self, now_s: float) -> None:
        """Let one period pass for every session."""
        for session in tuple(self.sessions.values()):
            session.tick(now_s, self.period_s)

    async def run(self, clock: Callable[[], float]) -> None:
        """Tick on time until cancelled; a late loop leaves ticks out instead of hurrying."""
        due = clock()
        while True:
            due += self.period_s
            now = clock()
            if now < due:
                await asyncio.sleep(due - now)
            else:
                # Late: the sockets still get their turn, and the arm does not leap to catch up.
                due = now
                await asyncio.sleep(0)
            self.tick(clock())
