"""A server of the bots' own: started for a study in a file, asked for its data, and thrown away.

Everything goes through its doors: the experimenter's printed link, the API, the shared link.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

_START_S = 60.0
_STOP_S = 20.0
_EXPORT_S = 3600.0


class OwnServerError(Exception):
    """The server did not start, or refused what it was asked."""


@dataclass(frozen=True)
class OwnStudy:
    """A study on a server of its own.

    Attributes:
        join_link: Its shared link.
        log: What the server has said.
    """

    join_link: str
    log: Path
    _office: httpx.Client
    _address: str

    def export(self, out: Path) -> None:
        """Write the study's export to a zip, which appears when it is whole."""
        part = out.with_name(f"{out.name}.part")
        try:
            with (
                self._office.stream("GET", f"{self._address}/export", timeout=_EXPORT_S) as answer,
                part.open("wb") as file,
            ):
                answer.raise_for_status()
                for block in answer.iter_bytes():
                    file.write(block)
            part.replace(out)
        except httpx.HTTPError as error:
            raise OwnServerError(f"The export did not come: {error}.") from error
        finally:
            part.unlink(missing_ok=True)


@contextlib.contextmanager
def own_study(protocol: str, settings: Mapping[str, str]) -> Generator[OwnStudy]:
    """Start a server with one study, on a free port, in a folder that is gone at the end.

    Args:
        protocol: The study's, as YAML.
        settings: More of the server's settings, by the names of the environment.

    Raises:
        OwnServerError: If it does not start, or does not take the protocol.
    """
    with tempfile.TemporaryDirectory(prefix="joymap-bots-") as folder:
        log = Path(folder) / "server.log"
        environment = {**os.environ, "JOYMAP_DATA_DIR": folder, **settings}
        with log.open("wb") as file:
            process = subprocess.Popen(
                [sys.executable, "-m", "app.cli", "serve", "--port", "0"],
                stdout=file,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # Ctrl+C is for the bots; the server is stopped after them
            )
        try:
            setup = _setup_link(process, log)
            with httpx.Client(base_url=setup.split("/setup/")[0], timeout=30.0) as office:
                yield _make(office, setup, protocol, log)
        finally:
            _stop(process)


def _setup_link(process: "subprocess.Popen[bytes]", log: Path) -> str:
    limit_s = time.monotonic() + _START_S
    while time.monotonic() < limit_s and process.poll() is None:
        found = re.search(r"^  experimenter +(\S+)", log.read_text(), re.MULTILINE)
        if found:
            return found[1]
        time.sleep(0.05)
    raise OwnServerError(f"The server did not start: {log.read_text().strip()}")


def _make(office: httpx.Client, setup: str, protocol: str, log: Path) -> OwnStudy:
    _answer(office.post(setup, json={"name": "bots", "password": uuid.uuid4().hex}))
    study_id = str(uuid.uuid4())
    address = f"/api/v1/studies/{study_id}"
    _answer(office.post("/api/v1/studies", json={"id": study_id, "yaml": protocol}))
    link = _answer(office.post(f"{address}/link"))["link"]
    return OwnStudy(link, log, office, address)


def _answer(response: httpx.Response) -> dict[str, Any]:
    content: dict[str, Any] = response.json() if response.content else {}
    if response.is_error:
        raise OwnServerError(content["error"]["sentence"])
    return content


def _stop(process: "subprocess.Popen[bytes]") -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_STOP_S)
            return
        process.kill()
    process.wait()
