"""``joymap``: the commands."""

import argparse
import contextlib
import logging
import os
import signal
import socket
import sys
from collections.abc import Generator
from typing import NoReturn

from pydantic import ValidationError

from app.bots_command import add_bots, run_bots
from app.check_command import add_check, run_check
from app.export_command import add_export, run_export
from app.figures_command import add_figures, run_figures, run_study_page
from app.power_command import add_power, run_power
from app.settings import Settings
from app.simulate_command import THREAD_COUNTS, add_simulate, run_page, run_simulate
from models.errors import ModelsError


class _OneLineParser(argparse.ArgumentParser):
    """Says in one line what is wrong, without the usage that hides it."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; '{self.prog} --help' shows what is allowed.\n")


def main(arguments: list[str] | None = None) -> int:
    """Run a command; returns its exit code."""
    parser = _OneLineParser(
        prog="joymap", description="Learn how each person wants to steer a robot arm."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    serve = commands.add_parser("serve", help="start the server and print its links")
    serve.add_argument("--host", help="address to listen on (JOYMAP_HOST)")
    serve.add_argument("--port", type=int, help="port to listen on (JOYMAP_PORT)")
    commands.add_parser("migrate", help="bring the database to the newest schema")
    add_check(commands)
    add_simulate(commands)
    add_export(commands)
    add_bots(commands)
    add_figures(commands)
    add_power(commands)
    chosen = parser.parse_args(arguments)
    options = {
        name: value
        for name in ("host", "port")
        if (value := getattr(chosen, name, None)) is not None
    }
    try:
        settings = Settings(**options)
    except ValidationError as error:
        first = error.errors()[0]
        print(f"JOYMAP_{'_'.join(map(str, first['loc'])).upper()}: {first['msg']}", file=sys.stderr)
        return 2
    # One thread for every numeric library, before any of them is loaded: the cores are shared by
    # the control loop and the trainings, or by the workers of a simulation.
    for name in THREAD_COUNTS:
        os.environ.setdefault(name, "1")
    if chosen.command == "serve":  # which has its own way to end
        return _serve(chosen, settings)
    try:
        with _terminated_as_interrupted():
            return _COMMANDS[chosen.command](chosen, settings)
    except KeyboardInterrupt:
        print(f"joymap {chosen.command}: Stopped before it was done.", file=sys.stderr)
        return 130  # what a shell expects of a command that Ctrl-C ended


@contextlib.contextmanager
def _terminated_as_interrupted() -> Generator[None]:
    """However a command is asked to end, it ends what it began: servers, workers, half files."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _migrate(_chosen: argparse.Namespace, settings: Settings) -> int:
    from app.storage.database import migrate

    migrate(settings.database_path)
    return 0


def _serve(_chosen: argparse.Namespace, settings: Settings) -> int:
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    logging.getLogger("alembic").setLevel(logging.WARNING)

    from app.main import create_app
    from app.schemas.protocol import NO_ALIGN
    from app.server import Server, print_links
    from app.storage.database import DatabaseInUse, migrate
    from models.strategies import get_strategy
    from models.tasks import get_task

    name = "JOYMAP_TASK"
    try:
        get_task(settings.task)
        name = "JOYMAP_SAME_STRATEGY"
        get_strategy(settings.same_strategy or NO_ALIGN)
    except ModelsError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    try:
        listener = _listen(settings)
    except OSError as error:
        print(
            f"Cannot listen on {settings.host}:{settings.port} ({error.strerror}); "
            "choose another with --port or JOYMAP_PORT.",
            file=sys.stderr,
        )
        return 1
    settings = settings.model_copy(update={"port": listener.getsockname()[1]})
    try:
        migrate(settings.database_path)
        server = Server(create_app(settings), settings, on_ready=print_links)
        server.run(sockets=[listener])
    except (DatabaseInUse, ModelsError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0 if server.started else 1


def _listen(settings: Settings) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # With its protocol named, or asyncio leaves Nagle's algorithm on, and each answer that is sent
    # in two parts waits 40 ms for the other side's acknowledgement.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((settings.host, settings.port))
    return listener


_COMMANDS = {
    "migrate": _migrate,
    "check": run_check,
    "simulate": run_simulate,
    "simulate-page": run_page,
    "export": run_export,
    "bots": run_bots,
    "power": run_power,
    "figures": run_figures,
    "study-page": run_study_page,
}

if __name__ == "__main__":
    sys.exit(main())
