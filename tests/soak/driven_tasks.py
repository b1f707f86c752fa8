"""Do people get the user study's tasks done, from random starts, through the running server?

``python -m tests.soak.driven_tasks`` lets simulated people with ideas of their own answer the
paper's number of questions and then drive each task under each strategy, all of them at once. One
line a task and strategy is printed.
"""

import argparse
import asyncio
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from models.experiment import PAPER_LABELS
from tests.page import Page, ideal, person_of
from tests.running_server import Participant, running_server

TASKS = ("avoid", "pour-cup", "fetch-and-pour")
STRATEGIES = ("all-priors", "no-priors", "task-space", "no-align", "ideal")
AIMS = {"ideal": "≥ 95 %", "all-priors": "≥ 85 %", "no-align": "far fewer"}


async def drives_of(page: Page, strategy: str, starts: int, limit_s: float) -> list[dict[str, Any]]:
    return [await page.drive(strategy, limit_s) for _ in range(starts)]


async def drive_all(
    pages: list[Page], strategy: str, starts: int, limit_s: float
) -> list[dict[str, Any]]:
    """Every page at once."""
    if strategy == "ideal":
        for page in pages:
            page.put(ideal(page.person), "all-priors")
    name = "all-priors" if strategy == "ideal" else strategy
    found = await asyncio.gather(*(drives_of(page, name, starts, limit_s) for page in pages))
    return [outcome for outcomes in found for outcome in outcomes]


def main() -> None:
    parser = argparse.ArgumentParser(description="Let simulated people drive the tasks.")
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--starts", type=int, default=2, help="of each, under each strategy")
    parser.add_argument("--limit", type=float, default=90.0, help="of a drive, in seconds")
    parser.add_argument("--noise", type=float, default=0.1, help="of the answers")
    parser.add_argument("--preference", default="random")
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--strategies", default=",".join(STRATEGIES))
    arguments = parser.parse_args()
    console, table = Console(width=120), Table(title="Driven tasks", title_justify="left")
    for column in ("task", "strategy", "done", "aim", "median time", "worst", "counts, mean"):
        table.add_column(column)
    for task in arguments.tasks.split(","):
        people = [
            person_of(task, arguments.preference, arguments.seed + n, arguments.noise)
            for n in range(arguments.people)
        ]
        settings = {"task": task, "labels_wanted": PAPER_LABELS[task]}
        with (
            tempfile.TemporaryDirectory() as folder,
            running_server(Path(folder), **settings) as server,
        ):
            links = server.participant_links(len(people))
            pages = [
                Page(server, Participant(link), person, arguments.seed + n)
                for n, (link, person) in enumerate(zip(links, people, strict=True))
            ]
            for page in track(pages, description=f"{task}: answering", console=console):
                page.label()
            for strategy in arguments.strategies.split(","):
                console.print(f"{task}: driving under {strategy}")
                table.add_row(
                    task,
                    strategy,
                    *summary(
                        asyncio.run(drive_all(pages, strategy, arguments.starts, arguments.limit)),
                        AIMS.get(strategy, ""),
                    ),
                )
                console.print(table)
            assert "Traceback" not in server.log()


def summary(outcomes: list[dict[str, Any]], aim: str) -> tuple[str, ...]:
    """Of how many drives, how many were successes, how long these took, and what was counted."""
    done = [outcome for outcome in outcomes if outcome["is_success"]]
    times = [outcome["elapsed_s"] for outcome in done]
    counted = {
        name: np.mean([outcome["counts"][name] for outcome in outcomes])
        for name in outcomes[0]["counts"]
    }
    return (
        f"{len(done)} of {len(outcomes)}",
        aim,
        f"{np.median(times):.0f} s" if times else "",
        f"{max(times):.0f} s" if times else "",
        ", ".join(f"{name} {mean:.1f}" for name, mean in counted.items()),
    )


if __name__ == "__main__":
    main()
