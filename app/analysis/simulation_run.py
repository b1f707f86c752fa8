"""Carries cells out in worker processes: those of a grid, or whatever else a run is made of."""

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Generic, TypeVar

from pebble import ProcessExpired, ProcessPool

from app.analysis.simulation_rows import SimulationError
from app.worker_pool import new_pool, settle
from models.errors import ModelsError

C = TypeVar("C")  # a cell: all that decides a row
R = TypeVar("R")  # a row: what comes of it


class WorkersKilled(SimulationError):
    """Nobody is left to do the work."""


@dataclass(frozen=True)
class Failure(Generic[C]):
    """A cell that came to nothing, and why, in one sentence."""

    cell: C
    reason: str


def run_cells(
    cells: Sequence[C],
    keep: Callable[[C, R, float], None],
    workers: int,
    on_end: Callable[[Failure[C] | None], None],
    run: Callable[[C], R],
) -> list[Failure[C]]:
    """Run the cells, in their order as far as workers are free, and keep each row at once.

    A cell that fails leaves the others alone.

    Args:
        cells: What to run.
        keep: Takes a cell, its row, and how long it took in [s]; it is not lost then.
        workers: How many processes.
        on_end: Called after each cell, with what went wrong or ``None``.
        run: What a worker does with a cell; importable by name.

    Raises:
        WorkersKilled: If the workers were killed from outside.
        KeyboardInterrupt: On Ctrl-C; every row that was finished is kept.
    """
    failures: list[Failure[C]] = []
    with _pool(workers) as pool:
        with _ignoring_ctrl_c():
            futures: dict[Future[tuple[R, float]], C] = {
                pool.schedule(_timed, args=(run, cell)): cell for cell in cells
            }
        for future in as_completed(futures):
            cell = futures[future]
            failure = _end(future, cell, keep)
            failures += [failure] if failure else []
            on_end(failure)
    return failures


def _end(
    future: Future[tuple[R, float]], cell: C, keep: Callable[[C, R, float], None]
) -> Failure[C] | None:
    try:
        row, seconds = future.result()
    except BrokenProcessPool as error:
        raise WorkersKilled(
            "The worker processes were killed; the same command goes on from there."
        ) from error
    except ProcessExpired as error:
        return Failure(cell, f"Its process died (exit code {error.exitcode}).")
    except ModelsError as error:
        return Failure(cell, str(error))
    except Exception as error:
        # Whatever it is, it is this cell's alone; its kind helps those who look for the cause.
        return Failure(cell, f"{type(error).__name__}: {error}")
    keep(cell, row, seconds)
    return None


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPool]:
    pool = new_pool(workers, __name__, settle)
    try:
        yield pool
    finally:
        # Nothing is lost: a cell that is under way has not been counted.
        pool.stop()  # type: ignore[no-untyped-call]
        pool.join()


@contextmanager
def _ignoring_ctrl_c() -> Iterator[None]:
    """Processes started meanwhile never hear Ctrl-C, which the terminal sends to all of them."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _timed(run: Callable[[C], R], cell: C) -> tuple[R, float]:
    began_s = time.perf_counter()
    return run(cell), time.perf_counter() - began_s
