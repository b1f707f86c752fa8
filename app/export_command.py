"""``joymap export``: a study's data as a zip or a folder, beside a running server or not."""

import argparse
import shutil
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.settings import Settings

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from app.services.export_package import Package

_STDOUT = "-"


def add_export(commands: Any) -> None:
    """Declare the command."""
    export = commands.add_parser("export", help="write a study's data as a zip or a folder")
    export.add_argument("study", help="its id, as in the address of its page, or its title")
    export.add_argument("--out", required=True, help="the zip or folder to write; - for stdout")
    export.add_argument("--format", choices=("zip", "folder"), default="zip")
    export.add_argument(
        "--lerobot",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="the drives as a LeRobot dataset as well (the default)",
    )
    export.add_argument(
        "--without-excluded", action="store_true", help="leave out who was excluded"
    )


def run_export(chosen: argparse.Namespace, settings: Settings) -> int:
    """Write the export; returns the exit code."""
    from rich.console import Console
    from rich.progress import Progress
    from sqlalchemy.orm import Session

    from app.errors import JoymapError
    from app.services import exports
    from app.storage import condition
    from app.storage.database import make_engine

    condition.require_newest(settings.database_path)
    engine = make_engine(settings.database_path)
    console = Console(stderr=True)
    bars = Progress(transient=True, console=console, disable=not console.is_terminal)
    try:
        with Session(engine) as db, bars, _package(chosen) as package:
            bar = bars.add_task("export", total=1.0)
            counts = exports.write(
                db,
                _find(db, chosen.study),
                package,
                with_excluded=not chosen.without_excluded,
                with_lerobot=chosen.lerobot,
                ticks_per_s=settings.teleop_rate_hz,
                note=lambda done: bars.update(bar, completed=done),
            )
    except (JoymapError, OSError, _Unclear) as error:
        print(error, file=sys.stderr)
        return 2
    finally:
        engine.dispose()
    if chosen.out != _STDOUT:
        print(", ".join(f"{count} {table}" for table, count in counts.items()), f"in {chosen.out}")
    return 0


class _Unclear(Exception):
    """What was asked for is not one thing."""


def _find(db: "Session", wanted: str) -> str:
    """The id of the study with this id or title; what is neither is left to be refused."""
    from app.storage import studies

    everything = studies.everything(db)
    if any(study.id == wanted for study in everything):
        return wanted
    found = [study.id for study in everything if study.title == wanted]
    if len(found) > 1:
        raise _Unclear(f"Several studies are called '{wanted}'; use an id.")
    return found[0] if found else wanted


@contextmanager
def _package(chosen: argparse.Namespace) -> "Generator[Package]":
    """What to write to; a file or folder appears when it is whole, or not at all."""
    from app.services.export_package import Folder, Zip

    if chosen.out == _STDOUT:
        if chosen.format == "folder":
            raise _Unclear("A folder cannot be written to stdout; give it a name.")
        yield Zip(sys.stdout.buffer)
        sys.stdout.buffer.flush()
        return
    out = Path(chosen.out)
    part = out.with_name(f"{out.name}.part")
    if chosen.format == "folder" and out.exists():
        raise FileExistsError(f"There is something at {out} already; choose another name.")
    if out.is_dir():
        raise IsADirectoryError(f"{out} is a folder; add --format folder, or name a file.")
    try:
        if chosen.format == "folder":
            yield Folder(part)
        else:
            with part.open("wb") as file:
                yield Zip(file)
        part.replace(out)
    finally:
        if part.is_dir():
            shutil.rmtree(part)
        part.unlink(missing_ok=True)
