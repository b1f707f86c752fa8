"""Simulated participants in a crowd, and rude ones: do all finish, is anything lost or doubled?

``python -m tests.soak.crowds_of_bots`` sends fifty at once through a study of one task, and then
the same people politely and, a third of them, rudely. One line for each is printed; 1 at the end
if anything was lost, doubled or refused.
"""

import argparse
import asyncio
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.analysis.study_export import StudyExport, read_export
from app.analysis.study_values import MADE
from app.bots.crowd import Crowd, send
from app.bots.own_server import own_study
from app.bots.visit import Report
from models.panda_pack import default_folder

LABELS, STRATEGIES, ITEMS = 5, ("no-align", "all-priors"), 6
PROTOCOL = f"""
title: A crowd
tasks: [{{task: avoid, labels: {LABELS}, unlabelled: 300, time_limit_s: 600}}]
strategies: [{", ".join(STRATEGIES)}]
practice_s: 0
questionnaires: {{after_each_strategy: [steering]}}
"""


def take_part(crowd: Crowd) -> tuple[list[Report], StudyExport, str]:
    """Everybody goes through the study; how, what it gave, and what the server said."""
    settings = {"JOYMAP_PANDA_DIR": str(default_folder())}
    with tempfile.TemporaryDirectory() as folder, own_study(PROTOCOL, settings) as own:
        reports = asyncio.run(send(crowd, own.join_link, lambda _reports: None))
        out = Path(folder) / "study.zip"
        own.export(out)
        export = read_export(out)
        assert_samples_whole(export)
        return reports, export, own.log.read_text()


def assert_samples_whole(export: StudyExport) -> None:
    """Every tick of every drive is there once, and time goes on in all of them."""
    ticks = {each.drive: each.columns for each in export.ticks(["tick", "monotonic_s"])}
    for drive in export.tables["drives"]:
        if not drive["ticks"]:
            continue
        columns = ticks[drive["drive"]]
        assert np.array_equal(columns["tick"], np.arange(drive["ticks"])), drive
        assert np.all(np.diff(columns["monotonic_s"]) > 0.0), drive


def given(export: StudyExport) -> Counter[tuple[int, ...]]:
    """What each who did everything gave: answers, responses, tries, orders of both strategies."""
    found: Counter[tuple[int, ...]] = Counter()
    for person in export.tables["participants"]:
        if person["state"] != "completed":
            continue
        mine = {
            name: [row for row in rows if row["participant"] == person["participant"]]
            for name, rows in export.tables.items()
        }
        made = [row for row in mine["drives"] if row["end"] in MADE]
        found[
            len([row for row in mine["answers"] if row["counts"] and row["h_x"] is not None]),
            len(mine["answers"]),
            len(mine["responses"]),
            len(made),
            len({row["strategy"] for row in made}),
        ] += 1
    return found


def verdict(reports: list[Report], export: StudyExport, log: str) -> str:
    """What is wrong; "" if nothing is."""
    wrong = []
    states = Counter(report.state for report in reports)
    if set(states) - {"completed", "dropped out"}:
        wrong.append(f"not all finished: {dict(states)}")
    if any(report.refusals for report in reports):
        wrong.append(f"{sum(report.refusals for report in reports)} answers with 5xx")
    if "Traceback" in log:
        wrong.append("the server complained")
    whole = (LABELS, LABELS, len(STRATEGIES) * ITEMS, len(STRATEGIES), len(STRATEGIES))
    if given(export) != Counter({whole: states["completed"]}):
        wrong.append(f"people gave {dict(given(export))}, not {whole}")
    return "; ".join(wrong)


def line(name: str, crowd: Crowd) -> bool:
    """Send a crowd, say how it went; whether all is well."""
    began_s = time.monotonic()
    reports, export, log = take_part(crowd)
    wrong = verdict(reports, export, log)
    driven, waited = (
        sum(getattr(report, what) for report in reports) for what in ("driven_s", "waited_s")
    )
    states: dict[str, Any] = Counter(report.state for report in reports)
    rows = ", ".join(
        f"{len(export.tables[table])} {table}" for table in ("answers", "drives", "responses")
    )
    print(
        f"{name}: {wrong or 'nothing lost, nothing doubled'} "
        f"({', '.join(f'{count} {state}' for state, count in states.items())}; {rows}; "
        f"drives at {100 * driven / waited:.0f} % of real time; "
        f"{time.monotonic() - began_s:.0f} s)",
        flush=True,
    )
    return not wrong


def main() -> int:
    """Fifty at once; then some politely, and the same, a third of them, rudely."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crowd", type=int, default=50)
    parser.add_argument("--some", type=int, default=9)
    chosen = parser.parse_args()
    many = Crowd(chosen.crowd, parallel=chosen.crowd, seed=900, gives_up_s=300.0)
    some = Crowd(chosen.some, parallel=chosen.some, seed=901, gives_up_s=30.0)
    third = replace(some, rude_share=1 / 3)
    crowds = {
        f"{chosen.crowd} at once": many,
        "polite": some,
        "a third sends everything twice": replace(third, double_submit=True),
        "a third loses the line now and then": replace(third, reconnect=True),
        "a third has two tabs": replace(third, two_tabs=True),
        "a third leaves": replace(some, drop_out=1 / 3),
    }
    return 0 if all([line(name, crowd) for name, crowd in crowds.items()]) else 1


if __name__ == "__main__":
    sys.exit(main())
