"""``joymap power``: how many participants a study needs, by simulated ones."""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app import texts
from app.settings import Settings

if TYPE_CHECKING:
    import numpy as np

    from app.analysis.power import Power
    from app.rehearsal.participant import Part
    from app.rehearsal.people import People

# Of a drive; the lower, the better.
MEASURES = {
    "completion_time_s": "completion time",
    "path_length_m": "path length",
    "undo_share": "undo share",
}
_FILES = ("png", "svg")
_STOPPED = 130  # what a shell expects of a command that Ctrl-C ended


def add_power(commands: Any) -> None:
    """Declare the command."""
    power = commands.add_parser(
        "power",
        help="how many participants a study needs, by simulated ones",
        description="Let a pool of simulated participants drive a task under two strategies, "
        "draw studies of every size from it, and say how many participants show that the first "
        "strategy is better. A run that was stopped goes on where it was.",
        allow_abbrev=False,
    )
    power.add_argument("--task", required=True, help="avoid, pour-cup or fetch-and-pour")
    power.add_argument("--measure", choices=MEASURES, default="completion_time_s")
    power.add_argument(
        "--compare",
        default="all-priors,no-priors",
        metavar="BETTER,OTHER",
        help="what is hoped to be better, and than what (all-priors,no-priors)",
    )
    studies = power.add_argument_group("studies")
    studies.add_argument("--smallest", type=int, default=4, help="participants of one (4)")
    studies.add_argument("--largest", type=int, default=20, help="participants of one (20)")
    studies.add_argument("--step", type=int, default=2, help="from a size to the next (2)")
    studies.add_argument("--studies", type=int, default=200, help="drawn of each size (200)")
    studies.add_argument("--level", type=float, default=0.05, help="of the test (0.05)")
    studies.add_argument("--wanted", type=float, default=0.8, help="power (0.8)")
    people = power.add_argument_group("people")
    people.add_argument("--people", type=int, default=40, help="in the pool (40)")
    people.add_argument("--preference", default="random", help="their idea of the stick (random)")
    people.add_argument("--labels", type=int, help="answers of each (the paper's: 7, 10, 30)")
    people.add_argument("--label-noise", type=float, default=0.1, help="of their answers (0.1)")
    people.add_argument("--motor-noise", type=float, default=0.1, help="of their hands (0.1)")
    people.add_argument("--reaction-ms", type=float, default=200.0, help="reaction time (200)")
    people.add_argument("--adapting", action="store_true", help="they learn while they drive")
    people.add_argument("--limit-s", type=float, default=60.0, help="of a try (60)")
    power.add_argument("--seed", type=int, default=0, help="the same seed, the same result (0)")
    power.add_argument("--workers", type=int, help="processes (default: one a core)")
    power.add_argument("--out", type=Path, required=True, metavar="DIR", help="for the files")
    power.add_argument("--fresh", action="store_true", help="throw away what DIR holds")


def run_power(chosen: argparse.Namespace, settings: Settings) -> int:
    """Let them drive, draw the studies and say how many show it; returns the exit code."""
    from app.analysis.simulation_rows import SimulationError
    from models.errors import ModelsError

    os.environ["JOYMAP_PANDA_DIR"] = str(settings.pack_dir)  # the workers look there, too
    try:
        sentence = _wrong(chosen)
        return _carry_out(chosen) if sentence is None else _end(2, sentence)
    except (ModelsError, SimulationError) as error:
        return _end(2, str(error))
    except OSError as error:
        return _end(1, f"{error.filename or chosen.out}: {error.strerror}.")
    except KeyboardInterrupt:
        again = "the same command without --fresh" if chosen.fresh else "the same command"
        return _end(_STOPPED, f"Stopped; who has driven is kept, and {again} goes on from there.")


def _carry_out(chosen: argparse.Namespace) -> int:
    from app.analysis.power import powers, says, table
    from app.rehearsal.people import open_people

    part = _part(chosen)
    part.check()
    with open_people(chosen.out, part, is_fresh=chosen.fresh) as people:
        failed = _send(chosen, people)
        if failed:
            return _end(1, f"{failed} participants failed; the same command tries them again.")
        values = people.values(chosen.measure, chosen.people)
        arrived = people.values("is_success", chosen.people).sum(axis=0)
    sizes = range(chosen.smallest, chosen.largest + 1, chosen.step)
    found = powers(values[:, 0] - values[:, 1], sizes, chosen.studies, chosen.level, chosen.seed)
    about = _about(chosen, part, values, arrived)
    print(says(found, chosen.wanted), table(found), about, sep="\n\n")
    _write(chosen, part, found)
    return 0


def _send(chosen: argparse.Namespace, people: "People") -> int:
    """Let those drive who have not yet; how many came to nothing."""
    from rich.console import Console

    from app.analysis.simulation_progress import progress
    from app.analysis.simulation_run import run_cells
    from app.rehearsal.participant import take_part

    missing = people.missing(chosen.people)
    if not missing:
        return 0
    workers = chosen.workers or len(os.sched_getaffinity(0))
    done = chosen.people - len(missing)
    with progress(Console(stderr=True), done, chosen.people, "participants") as on_end:
        return len(run_cells(missing, people.add, workers, on_end, take_part))


def _about(
    chosen: argparse.Namespace, part: "Part", values: "np.ndarray", arrived: "np.ndarray"
) -> str:
    import numpy as np

    return "\n".join(
        f"{strategy}: {good:.0f} of {chosen.people} tries ended well, "
        f"median {MEASURES[chosen.measure]} {_with_unit(chosen.measure, float(middle))}"
        for strategy, good, middle in zip(
            part.strategies, arrived, np.median(values, axis=0), strict=True
        )
    )


def _with_unit(measure: str, value: float) -> str:
    if measure == "undo_share":
        return f"{100 * value:.0f} %"
    return f"{value:.1f} {measure.rpartition('_')[2]}"


def _write(chosen: argparse.Namespace, part: "Part", found: "list[Power]") -> None:
    from app.analysis.pictures import save_figure
    from app.analysis.power import power_figure, table_csv
    from app.analysis.simulation_rows import write_file

    first, second = part.strategies
    title = f"{texts.title_of(part.task)}, {MEASURES[chosen.measure]}: {first} against {second}"
    write_file(chosen.out / "power.csv", table_csv(found))
    save_figure(
        power_figure(found, chosen.wanted, first, title), chosen.out / "power", endings=_FILES
    )


def _part(chosen: argparse.Namespace) -> "Part":
    from app.bots.person import ADAPTS, Habits
    from app.rehearsal.participant import Part
    from models.experiment import PAPER_LABELS

    return Part(
        task=chosen.task,
        strategies=tuple(chosen.compare.split(",")),
        labels=PAPER_LABELS[chosen.task] if chosen.labels is None else chosen.labels,
        preference=chosen.preference,
        habits=Habits(
            chosen.label_noise,
            chosen.motor_noise,
            chosen.reaction_ms / 1000.0,
            ADAPTS if chosen.adapting else 0.0,
        ),
        limit_s=chosen.limit_s,
        seed=chosen.seed,
    )


def _wrong(chosen: argparse.Namespace) -> str | None:
    """What is wrong with the arguments."""
    from app.analysis.power import POOL_FACTOR
    from app.rehearsal.participant import STRATEGIES
    from models.tasks import TASKS

    tasks = [name for name, task in TASKS.items() if task.has_goal]
    compared = chosen.compare.split(",")
    habits = (chosen.label_noise, chosen.motor_noise, chosen.reaction_ms)
    checks = (
        (chosen.task in tasks, f"--task is one of {', '.join(tasks)}."),
        (
            len(compared) == 2 and set(compared) <= set(STRATEGIES),
            f"--compare takes two of {', '.join(STRATEGIES)}, with a comma between.",
        ),
        (
            2 <= chosen.smallest <= chosen.largest,
            "--smallest is at least 2, and --largest no smaller.",
        ),
        (
            min(chosen.step, chosen.studies) >= 1,
            "--step and --studies are at least 1.",
        ),
        (
            chosen.people >= POOL_FACTOR * chosen.largest,
            f"Studies of {chosen.largest} need a pool of at least {POOL_FACTOR * chosen.largest}, "
            f"since in a pool of {chosen.people} they would be much the same people; "
            "give --people or --largest.",
        ),
        (chosen.workers is None or 1 <= chosen.workers <= 256, "--workers is from 1 to 256."),
        (chosen.labels is None or 5 <= chosen.labels <= 100, "--labels is from 5 to 100."),
        (0.0 < chosen.level < 1.0, "--level lies between 0 and 1."),
        (0.0 < chosen.wanted < 1.0, "--wanted lies between 0 and 1."),
        (all(0.0 <= each < 1e4 for each in habits), "Noise and reaction time cannot be negative."),
        (1.0 <= chosen.limit_s <= 3600.0, "--limit-s is from 1 to 3600."),
        (chosen.seed >= 0, "--seed cannot be negative."),
        (not chosen.out.is_file(), f"--out is a folder, and {chosen.out} is a file."),
    )
    return next((sentence for is_right, sentence in checks if not is_right), None)


def _end(code: int, sentence: str) -> int:
    print(f"joymap power: {sentence}", file=sys.stderr)
    return code
