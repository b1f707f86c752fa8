"""The control loop, with a clock of its own: everyone gets their ticks, evenly, late or not."""

from typing import Any

import numpy as np
import pytest

from app.teleop.loop import ControlLoop

RATE_HZ = 60.0


class FakeSession:
    """Remembers its ticks."""

    def __init__(self) -> None:
        self.ticks: list[float] = []

    def tick(self, now_s: float, dt_s: float) -> None:
        assert dt_s == pytest.approx(1 / RATE_HZ)
        self.ticks.append(now_s)


def run(
    loop: ControlLoop, until_s: float, now_s: float = 0.0, a_tick_takes_s: float = 0.0
) -> float:
    """Run the loop without waiting, as ``ControlLoop.run`` would."""
    while now_s < until_s:
        now_s += loop.wait_s(now_s) + 1e-6
        sessions: list[Any] = list(loop.sessions.values())
        before = sum(len(session.ticks) for session in sessions)
        loop.tick(now_s)
        after = sum(len(session.ticks) for session in sessions)
        now_s += a_tick_takes_s * (after - before)
    return now_s


def crowd(count: int) -> tuple[ControlLoop, list[FakeSession]]:
    loop, sessions = ControlLoop(RATE_HZ), [FakeSession() for _ in range(count)]
    loop.sessions.update({str(index): each for index, each in enumerate(sessions)})  # type: ignore[misc]
    return loop, sessions


def test_everyone_ticks_sixty_times_a_second_and_evenly() -> None:
    loop, sessions = crowd(12)
    run(loop, 10.0, a_tick_takes_s=0.001)
    for session in sessions:
        assert len(session.ticks) == pytest.approx(600, abs=2)
        assert np.diff(session.ticks) == pytest.approx(1 / RATE_HZ, abs=0.004)


def test_turns_are_spread_over_the_period() -> None:
    loop, sessions = crowd(12)
    run(loop, 1.0)
    ticks = np.sort(np.concatenate([session.ticks[-10:] for session in sessions]))
    assert np.diff(ticks).max() < 0.2 / RATE_HZ


def test_after_a_stall_nobody_leaps_and_the_rhythm_returns() -> None:
    loop, sessions = crowd(3)
    now_s = run(loop, 1.0)
    counts = [len(session.ticks) for session in sessions]
    run(loop, 2.0, now_s + 0.5)
    for session, before in zip(sessions, counts, strict=True):
        intervals = np.diff(session.ticks[before:])
        assert intervals.min() > 1 / RATE_HZ - 0.004
        assert len(intervals) == pytest.approx(30, abs=2)


def test_when_there_is_too_much_to_do_everyone_gets_the_same_share() -> None:
    loop, sessions = crowd(10)
    run(loop, 10.0, a_tick_takes_s=0.003)  # 30 ms of work for 16.7 ms
    counts = [len(session.ticks) for session in sessions]
    assert max(counts) - min(counts) <= 2
    assert sum(counts) == pytest.approx(10.0 / 0.003, rel=0.02)


def test_who_leaves_is_ticked_no_more_and_who_comes_is() -> None:
    loop, sessions = crowd(2)
    now_s = run(loop, 1.0)
    del loop.sessions["0"]
    newcomer = FakeSession()
    loop.sessions["2"] = newcomer  # type: ignore[assignment]
    gone = len(sessions[0].ticks)
    run(loop, 2.0, now_s)
    assert len(sessions[0].ticks) == gone
    assert len(newcomer.ticks) == pytest.approx(60, abs=2)
