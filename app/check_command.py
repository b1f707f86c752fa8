"""``joymap check``: whether protocol files can be run."""

import argparse
import sys
from pathlib import Path
from typing import Any

from app.settings import Settings


def add_check(commands: Any) -> None:
    """Declare the command."""
    check = commands.add_parser(
        "check",
        help="say whether protocol files can be run, and what is wrong with them",
        description="Read protocol files as the server does, and walk each to its last page.",
    )
    check.add_argument("files", nargs="+", type=Path, metavar="FILE", help="a protocol in YAML")


def run_check(chosen: argparse.Namespace, _settings: Settings) -> int:
    """Check every file; 0 if all can be run, 2 with a line for each fault if not."""
    from app.services import plan, protocols
    from app.services.protocols import BadProtocol

    is_good = True
    for file in chosen.files:
        try:
            protocol = protocols.parse_yaml(file.read_bytes())
        except OSError as error:
            is_good = False
            print(f"{file}: {error.strerror}.", file=sys.stderr)
        except BadProtocol as error:
            is_good = False
            for fault in error.faults:
                print(f"{file}: {fault.sentence}", file=sys.stderr)
        else:
            print(f"{file}: can be run; it has {len(plan.steps_of(protocol, 0))} steps.")
    return 0 if is_good else 2
