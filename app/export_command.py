"""``joymap export``: a study's data as a zip, from the shell, beside a running server or not."""

import argparse
import sys
from pathlib import Path
from typing import Any

from app.settings import Settings


def add_export(commands: Any) -> None:
    """Declare the command."""
    export = commands.add_parser("export", help="write a study's data as a zip")
    export.add_argument("study", help="its id, as in the address of its page, or its title")
    export.add_argument("--out", type=Path, required=True, help="the zip to write")
    export.add_argument(
        "--without-excluded", action="store_true", help="leave out who was excluded"
    )


def run_export(chosen: argparse.Namespace, settings: Settings) -> int:
    """Write the export; returns the exit code."""
    from rich.progress import Progress
    from sqlalchemy.orm import Session

    from app.errors import JoymapError
    from app.services import exports
    from app.storage import studies
    from app.storage.database import make_engine

    if not settings.database_path.exists():
        print(f"There is no database in {settings.data_dir}; set JOYMAP_DATA_DIR.", file=sys.stderr)
        return 2
    engine = make_engine(settings.database_path)
    scratch = chosen.out.with_name(f"{chosen.out.name}.part")
    try:
        with Session(engine) as db, Progress(transient=True) as progress:
            found = [
                study.id
                for study in studies.everything(db)
                if chosen.study in (study.id, study.title)
            ]
            if len(found) > 1:
                print(f"Several studies are called '{chosen.study}'; use an id.", file=sys.stderr)
                return 2
            bar = progress.add_task("export", total=1.0)
            counts = exports.write(
                db,
                found[0] if found else chosen.study,
                scratch,
                with_excluded=not chosen.without_excluded,
                note=lambda done: progress.update(bar, completed=done),
            )
            scratch.replace(chosen.out)
    except (JoymapError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    finally:
        scratch.unlink(missing_ok=True)
        engine.dispose()
    print(", ".join(f"{count} {table}" for table, count in counts.items()), f"in {chosen.out}")
    return 0
