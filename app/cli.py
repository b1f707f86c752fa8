"""``joymap``: the commands."""

import argparse
import contextlib
import difflib
import logging
import os
import signal
import socket
import sys
from collections.abc import Generator, Iterable
from typing import Any, NoReturn

from pydantic import ValidationError

from app.bots_command import add_bots, run_bots
from app.check_command import add_check, run_check
from app.errors import JoymapError
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
    settings = _settings(options)
    if not isinstance(settings, Settings):
        return _refuse(settings)
    # One thread for every numeric library, before any of them is loaded: the cores are shared by
    # the control loop and the trainings, or by the workers of a simulation.
    for name in THREAD_COUNTS:
        os.environ.setdefault(name, "1")
    try:
        if chosen.command == "serve":  # which has its own way to end
            return _serve(chosen, settings)
        with _terminated_as_interrupted():
            return _COMMANDS[chosen.command](chosen, settings)
    except (JoymapError, ModelsError) as error:
        return _refuse([str(error)])
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
    from app.server import Server, print_links
    from app.services.protocols import DEMO_SETTINGS, BadProtocol, demo_protocol
    from app.storage.database import DatabaseInUse, migrate
    from models.panda_pack import open_pack
    from models.strategies import get_strategy

    try:
        demo_protocol(settings)
    except BadProtocol as error:
        return _refuse(
            f"{_variable(DEMO_SETTINGS.get(fault.place, fault.place))}: {fault.says}."
            for fault in error.faults
        )
    try:
        if settings.same_strategy is not None:
            get_strategy(settings.same_strategy)
    except ModelsError as error:
        return _refuse([f"{_variable('same_strategy')}: {error}"])
    open_pack(settings.pack_dir)
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
    except DatabaseInUse as error:
        print(error, file=sys.stderr)
        return 1
    return 0 if server.started else 1


def _refuse(sentences: Iterable[str]) -> int:
    """Say what is wrong, a line each; the exit code of a command that did not begin."""
    for sentence in sentences:
        print(sentence, file=sys.stderr)
    return 2


def _variable(setting: str) -> str:
    return f"JOYMAP_{setting.upper()}"


def _settings(options: dict[str, Any]) -> Settings | list[str]:
    """The settings, or what is wrong with them, a sentence each."""
    try:
        return _unknown_variables() or Settings(**options)
    except ValidationError as error:
        from app.services.protocol_faults import of_schema

        return [f"{_variable(fault.place)}: {fault.says}." for fault in of_schema(error, {})]


def _unknown_variables() -> list[str]:
    """What is set in the environment and is no setting, with the one that was perhaps meant."""
    known = [_variable(name) for name in Settings.model_fields]
    given = [name for name in os.environ if name.upper().startswith("JOYMAP_")]
    return [
        f"{name}: there is no such setting" + (f"; did you mean {near[0]}?" if near else ".")
        for name in sorted(given)
        if name.upper() not in known
        for near in [difflib.get_close_matches(name.upper(), known, n=1, cutoff=0.8)]
    ]


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
