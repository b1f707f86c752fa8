"""How far a run is: a bar on a terminal, a plain line now and then elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from app.analysis.simulation_run import Failure

_LINE_EVERY_S = 10.0
_SPEED_OVER_S = 300.0  # the time left is worked out from the speed of so long


@contextmanager
def progress(
    console: Console, done: int, total: int, what: str = "cells"
) -> Iterator[Callable[[Failure[Any] | None], None]]:
    """Shows the progress; gives what is to be called after each cell.

    Args:
        console: Where; standard error, so that results stay apart.
        done: Cells that an earlier run finished.
        total: All cells.
        what: The word for cells.
    """
    if console.is_terminal:
        with Progress(
            TextColumn("simulating"),
            BarColumn(bar_width=None),
            MofNCompleteColumn(),
            TextColumn(f"{what},"),
            TimeRemainingColumn(),
            TextColumn("left"),
            console=console,
            speed_estimate_period=_SPEED_OVER_S,
        ) as bar:
            task = bar.add_task("", total=total, completed=done)

            def advance(failure: Failure[Any] | None) -> None:
                bar.advance(task)
                _say_failure(console, failure)

            yield advance
    else:
        yield _Lines(console, done, total, what).advance


class _Lines:
    def __init__(self, console: Console, done: int, total: int, what: str) -> None:
        self._console = console
        self._what = what
        self._before = self._done = done
        self._total = total
        self._began_s = self._said_s = time.monotonic()

    def advance(self, failure: Failure[Any] | None) -> None:
        self._done += 1
        _say_failure(self._console, failure)
        now_s = time.monotonic()
        if now_s - self._said_s < _LINE_EVERY_S and self._done < self._total:
            return
        self._said_s = now_s
        pace_s = (now_s - self._began_s) / (self._done - self._before)
        left_s = pace_s * (self._total - self._done)
        say(self._console, f"{self._done} of {self._total} {self._what}, {duration(left_s)} left")


def _say_failure(console: Console, failure: Failure[Any] | None) -> None:
    if failure is not None:
        cell = ", ".join(f"{name} {value}" for name, value in vars(failure.cell).items())
        say(console, f"failed: {failure.reason} (cell: {cell})")


def say(console: Console, line: str) -> None:
    """Print a line as it is, on one line however narrow the terminal."""
    console.print(line, markup=False, highlight=False, soft_wrap=True)


def duration(seconds: float) -> str:
    """For people: "40 s", "12 min"."""
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.0f} min"
