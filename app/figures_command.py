"""``joymap figures`` and ``joymap study-page``: from exports to pictures, tables and words."""

import argparse
import sys
from pathlib import Path
from typing import Any

from app.settings import Settings


def add_figures(commands: Any) -> None:
    """Declare the command."""
    figures = commands.add_parser("figures", help="draw a study's figures from its export")
    figures.add_argument("export", type=Path, help="the zip or folder that an export is")
    figures.add_argument("--out", type=Path, required=True, metavar="DIR", help="for the files")
    figures.add_argument(
        "--about",
        metavar="STRATEGY",
        help="compare the others with this one only: the hypothesis was about it",
    )
    page = commands.add_parser("study-page", help="write the page about the simulated user study")
    for name, what in (
        ("--first", "the export of the first people"),
        ("--held-out", "of people nobody had seen"),
        ("--same", "of a study in which every strategy was the same"),
    ):
        page.add_argument(name, type=Path, required=True, metavar="EXPORT", help=what)
    page.add_argument("--out", type=Path, required=True, metavar="FILE", help="the page")


def run_study_page(chosen: argparse.Namespace, _settings: Settings) -> int:
    """Write the page and its pictures; returns the exit code."""
    from app.analysis.study_export import NotAnExport, read_export
    from app.analysis.study_page import Studies, write_study_page

    try:
        studies = Studies(*map(read_export, (chosen.first, chosen.held_out, chosen.same)))
        write_study_page(studies, chosen.out, chosen.out.parent / "images")
    except NotAnExport as error:
        return _end(error.sentence)
    except OSError as error:
        return _end(f"{error.filename or chosen.out}: {error.strerror}.")
    print(f"Wrote {chosen.out}.")
    return 0


def run_figures(chosen: argparse.Namespace, _settings: Settings) -> int:
    """Draw them; returns the exit code."""
    from rich.console import Console
    from rich.progress import Progress

    from app.analysis.study_export import NotAnExport, read_export
    from app.analysis.study_report import write_report
    from models.strategies import STRATEGIES

    if chosen.about is not None and chosen.about not in STRATEGIES:
        return _end(f"there is no strategy '{chosen.about}'; choose from {', '.join(STRATEGIES)}.")
    console = Console(stderr=True)
    try:
        export = read_export(chosen.export)
        with Progress(transient=True, console=console, disable=not console.is_terminal) as bars:
            bar = bars.add_task("figures", total=1.0)
            report = write_report(
                export,
                chosen.out,
                chosen.about,
                note=lambda done: bars.update(bar, completed=done),
            )
    except NotAnExport as error:
        return _end(error.sentence)
    except OSError as error:
        return _end(f"{error.filename or chosen.out}: {error.strerror}.")
    for sentence in report.findings:
        print(sentence)
    print(f"{len(report.files)} files in {chosen.out}; report.md shows them together.")
    return 0


def _end(sentence: str) -> int:
    print(f"joymap: {sentence}", file=sys.stderr)
    return 2
