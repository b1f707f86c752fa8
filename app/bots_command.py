"""``joymap bots``: simulated participants take part in a study."""

import argparse
import contextlib
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.errors import JoymapError
from app.settings import Settings

if TYPE_CHECKING:
    from app.bots.crowd import Crowd
    from app.bots.own_server import OwnStudy
    from app.bots.visit import Report


def add_bots(commands: Any) -> None:
    """Declare the command."""
    bots = commands.add_parser("bots", help="let simulated participants take part in a study")
    bots.add_argument(
        "--study",
        required=True,
        help="the study's shared link; or its YAML file, for which a server is started and ended",
    )
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
    bots.add_argument("--rude", type=float, default=1.0, help="share that is rude like that (1)")
    own = bots.add_argument_group("with a YAML file")
    own.add_argument("--out", type=Path, metavar="ZIP", help="where the study's export goes")
    own.add_argument("--speed", type=float, default=1.0, help="of the arm's time (1)")
    own.add_argument(
        "--same",
        metavar="STRATEGY",
        help="secretly drive with this one under every name: a study that should find nothing",
    )


def run_bots(chosen: argparse.Namespace, settings: Settings) -> int:
    """Let them come; 0 if all did what they came for."""
    from app.bots.crowd import Crowd
    from app.bots.own_server import OwnServerError
    from app.bots.person import ADAPTS, Habits
    from models.errors import ModelsError

    wrong = _wrong(chosen)
    if wrong is not None:
        return _end(wrong)
    adapts = ADAPTS if chosen.adapting else 0.0
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
        rude_share=chosen.rude,
        gives_up_s=chosen.gives_up_s,
        speed=chosen.speed,
    )
    try:
        crowd.person(0)
        with _study(chosen, settings) as (link, own):
            reports = _send(crowd, link)
            if own is not None:
                own.export(chosen.out)
    except (ModelsError, OwnServerError, JoymapError, OSError) as error:
        return _end(str(error))
    _say(reports)
    if chosen.out is not None:
        print(f"The study's data are in {chosen.out}.")
    good = ("completed", "dropped out")
    is_good = all(report.state in good and report.refusals == 0 for report in reports)
    return 0 if is_good else 1


@contextlib.contextmanager
def _study(
    chosen: argparse.Namespace, settings: Settings
) -> "Generator[tuple[str, OwnStudy | None]]":
    """The link to join by, and the study if its server is the bots' own."""
    if _is_link(chosen.study):
        yield chosen.study.rstrip("/"), None
        return
    from app.bots.own_server import own_study
    from app.schemas.yaml_reader import decode

    mine = {"JOYMAP_PANDA_DIR": str(settings.pack_dir), "JOYMAP_SPEED": str(chosen.speed)}
    if chosen.same is not None:
        mine["JOYMAP_SAME_STRATEGY"] = chosen.same
    with own_study(decode(Path(chosen.study).read_bytes()), mine) as own:
        yield own.join_link, own


def _send(crowd: "Crowd", link: str) -> "list[Report]":
    import asyncio

    from rich.progress import Progress

    from app.bots.crowd import send

    with Progress() as progress:
        bar = progress.add_task("participants", total=float(crowd.participants))

        def note(reports: "list[Report]") -> None:
            progress.update(bar, completed=sum(report.place for report in reports))

        return asyncio.run(send(crowd, link, note))


def _say(reports: "list[Report]") -> None:
    for state, count in Counter(report.state for report in reports).most_common():
        print(f"{count} {state}")
    driven, waited = (
        sum(getattr(report, name) for report in reports) for name in ("driven_s", "waited_s")
    )
    drives = sum(report.drives for report in reports)
    refusals = sum(report.refusals for report in reports)
    share = driven / waited if waited else 1.0
    print(f"{drives} drives at {100 * share:.1f} % of real time; {refusals} answers with 5xx")


def _wrong(chosen: argparse.Namespace) -> str | None:
    """What is wrong with the arguments."""
    numbers = (chosen.label_noise, chosen.motor_noise, chosen.reaction_ms, chosen.gives_up_s)
    is_link = _is_link(chosen.study)
    checks = (
        (
            is_link or Path(chosen.study).is_file(),
            "--study takes a study's shared link, such as http://127.0.0.1:8000/join/…, or a file.",
        ),
        (
            chosen.participants >= 1 and chosen.parallel >= 1,
            "--participants and --parallel must be at least 1.",
        ),
        (0.0 <= chosen.drop_out <= 1.0, "--drop-out is a share between 0 and 1."),
        (0.0 <= chosen.rude <= 1.0, "--rude is a share between 0 and 1."),
        (min(numbers) >= 0.0, "noise and times cannot be negative."),
        (0.1 <= chosen.speed <= 20.0, "--speed lies between 0.1 and 20."),
        (
            not (is_link and (chosen.out or chosen.same or chosen.speed != 1.0)),
            "--out, --speed and --same are for a study's file: a server has its own.",
        ),
        (is_link or chosen.out, "with a study's file, --out says where its export goes."),
    )
    return next((sentence for is_right, sentence in checks if not is_right), None)


def _is_link(study: str) -> bool:
    return "/join/" in study


def _end(sentence: str) -> int:
    print(f"joymap bots: {sentence}", file=sys.stderr)
    return 2
