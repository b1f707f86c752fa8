"""``joymap simulate`` and ``joymap simulate-page``: from the command line to files.

What needs the learning core is imported late, after ``app.cli`` has pinned the threads.
"""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.settings import Settings
from models.errors import ModelsError

if TYPE_CHECKING:
    from app.analysis.simulation_grid import Grid

# What the numeric libraries read when they are loaded.
THREAD_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_MOST_SEEDS = 10_000
_MOST_WORKERS = 256
_REFUSED = 2
_STOPPED = 130  # what a shell expects of a command that Ctrl-C ended


def add_simulate(commands: Any) -> None:
    """Add both commands' words to argparse's subcommands."""
    parser = commands.add_parser(
        "simulate",
        help="run the paper's simulation experiments",
        description="Run the paper's simulation experiments on simulated people. Lists are "
        "separated by commas; every combination is run. Without options: the paper's grid. "
        "A run that was stopped goes on where it was when the same command is given again.",
        allow_abbrev=False,
    )
    texts, numbers, wholes = _listed(str), _listed(_number), _listed(_whole)
    lists: tuple[tuple[str, Callable[[str], Any], str], ...] = (
        ("--task", texts, "plane, pour, reach-and-pour (default: all)"),
        ("--method", texts, "no-align, …, all-priors, ideal-align, task-space (default: all)"),
        ("--noise", numbers, "coefficients of variation of the labels (default: 0,0.1,0.5)"),
        ("--labels", wholes, "K (default: the paper's, 10, 10 and 20)"),
        ("--preference", texts, "such as random, axes, polar+gain:0.6 (default: random)"),
        ("--controller", texts, "autoencoder, linear, principal, warped (default: the first)"),
        ("--queries", texts, "random, designed (default: random)"),
        ("--wrong-answers", numbers, "shares of plainly wrong answers (default: 0)"),
    )
    for name, kind, what in lists:
        parser.add_argument(name, type=kind, metavar="LIST", help=what)
    parser.add_argument("--seeds", type=_whole, default=10, help="how many (default: 10)")
    parser.add_argument("--first-seed", type=_whole, default=0, help="default: 0")
    parser.add_argument(
        "--unlabelled", type=_whole, metavar="N", help="default: the paper's, 1000, 1000 and 2000"
    )
    parser.add_argument(
        "--rotation-weight", type=_number, default=None, metavar="W",
        help="alignment error = position error + W/rad × rotation error (default: 10)",
    )  # fmt: skip
    parser.add_argument("--workers", type=_whole, help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="for the files")
    parser.add_argument("--json", type=Path, metavar="FILE", help="rows and summary for programs")
    parser.add_argument("--fresh", action="store_true", help="throw away what DIR holds")
    _add_page(commands)


def _add_page(commands: Any) -> None:
    parser = commands.add_parser(
        "simulate-page",
        help="write a page about simulations",
        description="Write a page from the folders that 'joymap simulate' filled.",
        allow_abbrev=False,
    )
    for name, is_needed, what in (
        ("--paper", True, "the paper's grid"),
        ("--labels", True, "several numbers of labels, random and designed questions"),
        ("--people", False, "several preferences, and shares of wrong answers"),
        ("--controllers", False, "several controllers"),
    ):
        parser.add_argument(
            name, type=Path, nargs="+", required=is_needed, default=[], metavar="DIR", help=what
        )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the page")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="default: images beside it")


def run_simulate(chosen: argparse.Namespace, settings: Settings) -> int:
    """Run or finish a grid and write its files; returns the exit code."""
    # The workers inherit these: where the learning core looks for the arm's pack, and one thread
    # each, whatever the shell says, since the last digits of a row depend on their number.
    os.environ["JOYMAP_PANDA_DIR"] = str(settings.pack_dir)
    os.environ.update(dict.fromkeys(THREAD_COUNTS, "1"))
    try:
        return _simulate(chosen)
    except KeyboardInterrupt:
        again = "the same command without --fresh" if chosen.fresh else "the same command"
        return _end(_STOPPED, f"Stopped; finished cells are kept, and {again} goes on from there.")


def run_page(chosen: argparse.Namespace, settings: Settings) -> int:
    """Write the page and its pictures; returns the exit code."""
    del settings
    from app.analysis.simulation_output import read_run
    from app.analysis.simulation_page import Runs, write_page
    from app.analysis.simulation_rows import SimulationError

    pictures = chosen.pictures or chosen.out.parent / "images"
    try:
        groups = [chosen.paper, chosen.labels, chosen.people, chosen.controllers]
        runs = Runs(*(tuple(read_run(folder) for folder in group) for group in groups))
        write_page(runs, chosen.out, pictures)
    except SimulationError as error:
        return _end(_REFUSED, str(error))
    except OSError as error:
        return _end(_REFUSED, f"{error.filename}: {error.strerror}.")
    print(f"Wrote {chosen.out}.")
    return 0


def _simulate(chosen: argparse.Namespace) -> int:
    from app.analysis.simulation_rows import SimulationError
    from app.analysis.simulation_run import WorkersKilled
    from models.panda_pack import open_pack

    try:
        workers = _workers(chosen.workers)
        _check_places(chosen)
        grid = _grid(chosen)
        cells = grid.cells()
    except (ModelsError, SimulationError) as error:
        return _end(_REFUSED, str(error))
    try:
        open_pack()  # better to miss it once than in every cell
    except ModelsError as error:
        return _end(1, str(error))
    try:
        return _carry_out(chosen, grid, cells, workers)
    except WorkersKilled as error:
        return _end(1, str(error))
    except SimulationError as error:
        return _end(_REFUSED, str(error))
    except OSError as error:
        return _end(1, f"{error.filename or chosen.out}: {error.strerror}.")


def _carry_out(chosen: argparse.Namespace, grid: "Grid", cells: list[Any], workers: int) -> int:
    from rich.console import Console

    from app.analysis.simulation_grid import running_order
    from app.analysis.simulation_journal import open_journal, origin
    from app.analysis.simulation_output import (
        Run,
        as_json,
        remove_results,
        write_run,
        written_names,
    )
    from app.analysis.simulation_progress import duration, progress, say
    from app.analysis.simulation_rows import write_file
    from app.analysis.simulation_run import run_cells
    from models.experiment import run_cell

    console = Console(stderr=True)
    with open_journal(chosen.out, is_fresh=chosen.fresh) as journal:
        missing = [cell for cell in running_order(cells) if cell not in journal.rows]
        if len(missing) < len(cells):
            say(console, f"{len(cells) - len(missing)} of {len(cells)} cells are there already.")
        if missing:
            remove_results(chosen.out)
        with progress(console, len(cells) - len(missing), len(cells)) as on_end:
            failures = run_cells(missing, journal.add, workers, on_end, run_cell)
        done = [cell for cell in cells if cell in journal.rows]
        run = Run(
            chosen.out,
            [journal.rows[cell] for cell in done],
            grid.rotation_weight,
            origin(),
            sum(journal.seconds[cell] for cell in done),
        )
        if run.rows:
            paths = write_run(run, grid)
            print(
                f"{len(run.rows)} cells, {duration(run.worker_seconds)} of work: "
                f"{written_names(paths)} in {chosen.out}"
            )
            if chosen.json is not None:
                write_file(chosen.json, as_json(run, grid))
    if failures:
        return _end(1, f"{len(failures)} cells failed; the same command tries them again.")
    return 0


def _grid(chosen: argparse.Namespace) -> "Grid":
    from app.analysis.simulation_grid import Grid
    from app.analysis.simulation_rows import SimulationError
    from models.experiment import METHODS, PAPER_NOISES, PAPER_TASKS, ROTATION_WEIGHT

    for method in set(chosen.method or ()) - set(METHODS):
        offered = ", ".join(METHODS)
        raise SimulationError(f"There is no method '{method}'; choose one of: {offered}.")
    seeds = _between("--seeds", chosen.seeds, 1, _MOST_SEEDS)
    weight = ROTATION_WEIGHT if chosen.rotation_weight is None else chosen.rotation_weight
    if chosen.unlabelled is not None:
        _between("--unlabelled", chosen.unlabelled, 1, None)
    return Grid(
        tasks=chosen.task or PAPER_TASKS,
        methods=chosen.method or METHODS,
        noises=chosen.noise or PAPER_NOISES,
        seeds=tuple(range(chosen.first_seed, chosen.first_seed + seeds)),
        labels=chosen.labels,
        unlabelled=chosen.unlabelled,
        preferences=chosen.preference or ("random",),
        queries=chosen.queries or ("random",),
        controllers=chosen.controller or ("autoencoder",),
        wrong_answers=chosen.wrong_answers or (0.0,),
        rotation_weight=weight,
    )


def _workers(asked: int | None) -> int:
    if asked is None:
        return len(os.sched_getaffinity(0))
    return _between("--workers", asked, 1, _MOST_WORKERS)


def _check_places(chosen: argparse.Namespace) -> None:
    from app.analysis.simulation_rows import SimulationError

    if chosen.out.exists() and not chosen.out.is_dir():
        raise SimulationError(f"--out must be a folder, and {chosen.out} is a file.")
    if chosen.json is not None and (chosen.json.is_dir() or not chosen.json.parent.is_dir()):
        raise SimulationError(f"--json must be a file in a folder that exists, not {chosen.json}.")


def _between(name: str, value: int, low: int, high: int | None) -> int:
    from app.analysis.simulation_rows import SimulationError

    if value < low or (high is not None and value > high):
        range_ = f"at least {low}" if high is None else f"between {low} and {high}"
        raise SimulationError(f"{name} must be {range_}, not {value}.")
    return value


def _listed(kind: Callable[[str], Any]) -> Callable[[str], tuple[Any, ...]]:
    """Values separated by commas, each of them once."""

    def parse(text: str) -> tuple[Any, ...]:
        parts = [part.strip() for part in text.split(",")]
        if "" in parts:
            raise argparse.ArgumentTypeError(f"'{text}' is not a list such as A,B")
        return tuple(dict.fromkeys(kind(part) for part in parts))

    return parse


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None


def _end(code: int, sentence: str) -> int:
    print(f"joymap: {sentence}", file=sys.stderr)
    return code
