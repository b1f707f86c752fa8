"""``joymap bots``: simulated participants take part in a study of a running server."""

import argparse
import sys
from collections import Counter
from typing import Any

from app.settings import Settings


def add_bots(commands: Any) -> None:
    """Declare the command."""
    bots = commands.add_parser("bots", help="let simulated participants take part in a study")
    bots.add_argument("--study", required=True, help="the study's shared link")
    bots.add_argument("--participants", type=int, default=4, help="how many (4)")
    bots.add_argument("--preference", default="random", help="their idea of the stick (random)")
    bots.add_argument("--label-noise", type=float, default=0.1, help="of their answers (0.1)")
    bots.add_argument("--motor-noise", type=float, default=0.1, help="of their hands (0.1)")
    bots.add_argument("--reaction-ms", type=float, default=200.0, help="reaction time (200)")
    bots.add_argument("--adapting", action="store_true", help="they learn while they drive")
    bots.add_argument("--parallel", type=int, default=4, help="how many at once (4)")
    bots.add_argument("--seed", type=int, default=0, help="the same seed, the same people (0)")
    bots.add_argument("--gives-up-s", type=float, default=60.0, help="patience with a drive (60)")
    bots.add_argument("--drop-out", type=float, default=0.0, help="share that leaves early (0)")
    bots.add_argument("--double-submit", action="store_true", help="they send everything twice")
    bots.add_argument("--reconnect", action="store_true", help="their connections break")
    bots.add_argument("--two-tabs", action="store_true", help="a second tab looks on")


def run_bots(chosen: argparse.Namespace, _settings: Settings) -> int:
    """Let them come; 0 if all did what they came for."""
    import asyncio

    from rich.progress import Progress

    from app.bots.crowd import Crowd, send
    from app.bots.person import Habits
    from app.bots.visit import Report
    from models.errors import ModelsError

    wrong = _wrong(chosen)
    if wrong is not None:
        print(f"joymap bots: {wrong}", file=sys.stderr)
        return 2
    adapts = 0.05 if chosen.adapting else 0.0
    crowd = Crowd(
        participants=chosen.participants,
        preference=chosen.preference,
        habits=Habits(chosen.label_noise, chosen.motor_noise, chosen.reaction_ms / 1000.0, adapts),
        seed=chosen.seed,
        parallel=chosen.parallel,
        drop_out=chosen.drop_out,
        double_submit=chosen.double_submit,
        reconnect=chosen.reconnect,
        two_tabs=chosen.two_tabs,
        gives_up_s=chosen.gives_up_s,
    )
    try:
        crowd.person(0)
    except ModelsError as error:
        print(f"joymap bots: {error}", file=sys.stderr)
        return 2
    with Progress() as progress:
        bar = progress.add_task("participants", total=float(chosen.participants))

        def note(reports: list[Report]) -> None:
            progress.update(bar, completed=sum(report.place for report in reports))

        reports = asyncio.run(send(crowd, chosen.study.rstrip("/"), note))
    for state, count in Counter(report.state for report in reports).most_common():
        print(f"{count} {state}")
    driven, waited = (
        sum(getattr(report, name) for report in reports) for name in ("driven_s", "waited_s")
    )
    drives = sum(report.drives for report in reports)
    refusals = sum(report.refusals for report in reports)
    share = driven / waited if waited else 1.0
    print(f"{drives} drives at {100 * share:.1f} % of real time; {refusals} answers with 5xx")
    good = ("completed", "dropped out")
    return 0 if refusals == 0 and all(report.state in good for report in reports) else 1


def _wrong(chosen: argparse.Namespace) -> str | None:
    """What is wrong with the arguments."""
    if "/join/" not in chosen.study:
        return "--study takes a study's shared link, such as http://127.0.0.1:8000/join/…."
    if chosen.participants < 1 or chosen.parallel < 1:
        return "--participants and --parallel must be at least 1."
    if not 0.0 <= chosen.drop_out <= 1.0:
        return "--drop-out is a share between 0 and 1."
    if min(chosen.label_noise, chosen.motor_noise, chosen.reaction_ms, chosen.gives_up_s) < 0.0:
        return "noise and times cannot be negative."
    return None
