"""One page in Chromium, Firefox or WebKit, used alike: go somewhere, drag, ask what is there.

Chromium is Playwright's. Firefox speaks WebDriver BiDi by itself, and WebKitGTK has a driver that
speaks WebDriver: two standards of the W3C, of which a page and a mouse need little
(docs/decisions/0009-three-engines.md). No picture is drawn in any of them.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import httpx
from playwright.sync_api import Browser, Page
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from tests.patience import PATIENCE_S

HALF_WAY_MS = 100
# What Firefox asks the network for by itself goes nowhere; addresses of this machine need no proxy.
_FIREFOX: tuple[tuple[str, Any], ...] = (
    ("network.proxy.type", 1),
    ("network.proxy.http", "127.0.0.1"),
    ("network.proxy.http_port", 9),
    ("network.proxy.ssl", "127.0.0.1"),
    ("network.proxy.ssl_port", 9),
    ("webgl.disabled", True),
)

Point = tuple[int, int]  # in the page, in pixels


class Tab(ABC):
    """The one tab of a browser."""

    @abstractmethod
    def goto(self, url: str) -> None:
        """Open a page."""

    @abstractmethod
    def run(self, expression: str) -> Any:
        """The value of a JavaScript expression in the page, as JSON has it."""

    @abstractmethod
    def flick(self, start: Point, end: Point) -> None:
        """Drag with the mouse, the last half of the way at one go, and let go at once."""

    def wait(self, expression: str, limit_s: float = PATIENCE_S) -> Any:
        """Wait until an expression holds; its value then."""
        deadline = time.monotonic() + limit_s
        while not (value := self.run(expression)):
            assert time.monotonic() < deadline, f"{expression} did not come to hold"
            time.sleep(0.03)
        return value


class ChromiumTab(Tab):
    """Chromium by way of Playwright."""

    def __init__(self, page: Page) -> None:
        self._page = page
        page.route("**/scene/**", lambda route: route.abort())

    def goto(self, url: str) -> None:
        self._page.goto(url)

    def run(self, expression: str) -> Any:
        return self._page.evaluate(expression)

    def flick(self, start: Point, end: Point) -> None:
        self._page.mouse.move(*start)
        self._page.mouse.down()
        self._page.mouse.move(*_between(start, end), steps=5)
        self._page.mouse.move(*end)
        self._page.mouse.up()


class FirefoxTab(Tab):
    """Firefox by WebDriver BiDi: commands over a websocket, answered one by one."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self._sent = 0
        self._send("session.new", capabilities={})
        self._page = self._send("browsingContext.create", type="tab")["context"]
        self._send("browsingContext.activate", context=self._page)

    def _send(self, method: str, **parameters: Any) -> Any:
        self._sent += 1
        command = {"id": self._sent, "method": method, "params": parameters}
        self._line.send(json.dumps(command))
        answer: dict[str, Any] = {}
        while answer.get("id") != self._sent:  # between them it may tell of events
            answer = json.loads(self._line.recv(timeout=PATIENCE_S))
        assert answer["type"] == "success", answer
        return answer["result"]

    def goto(self, url: str) -> None:
        self._send("browsingContext.navigate", context=self._page, url=url, wait="interactive")

    def run(self, expression: str) -> Any:
        answer = self._send(
            "script.evaluate",
            expression=f"JSON.stringify({expression}) ?? 'null'",
            target={"context": self._page},
            awaitPromise=False,
        )
        assert answer["type"] == "success", answer
        return json.loads(answer["result"]["value"])

    def flick(self, start: Point, end: Point) -> None:
        self._send("input.performActions", context=self._page, actions=_mouse(start, end))


class WebKitTab(Tab):
    """WebKitGTK's MiniBrowser by WebDriver: commands over HTTP, to the driver that starts it."""

    def __init__(self, http: httpx.Client) -> None:
        self._http = http
        self._session = ""
        options = {"args": ["--automation", "--features=!WebGL"]}
        wanted = {"pageLoadStrategy": "eager", "webkitgtk:browserOptions": options}
        made = self._send("", capabilities={"alwaysMatch": wanted})
        self._session = f"/{made['sessionId']}"
        self._send("/window/rect", x=0, y=0, width=1280, height=850)

    def _send(self, command: str, **parameters: Any) -> Any:
        response = self._http.post(f"/session{self._session}{command}", json=parameters)
        assert response.is_success, response.text
        return response.json()["value"]

    def goto(self, url: str) -> None:
        self._send("/url", url=url)

    def run(self, expression: str) -> Any:
        return self._send("/execute/sync", script=f"return ({expression})", args=[])

    def flick(self, start: Point, end: Point) -> None:
        self._send("/actions", actions=_mouse(start, end))


def _mouse(start: Point, end: Point) -> list[dict[str, Any]]:
    """A flick as both protocols say it."""
    move = {"type": "pointerMove", "origin": "viewport"}
    steps: list[dict[str, Any]] = [
        move | _at(start),
        {"type": "pointerDown", "button": 0},
        move | _at(_between(start, end)) | {"duration": HALF_WAY_MS},
        move | _at(end),
        {"type": "pointerUp", "button": 0},
    ]
    return [{"type": "pointer", "id": "mouse", "actions": steps}]


def _at(point: Point) -> dict[str, int]:
    return {"x": point[0], "y": point[1], "duration": 0}


def _between(start: Point, end: Point) -> Point:
    return (start[0] + end[0]) // 2, (start[1] + end[1]) // 2


@contextlib.contextmanager
def chromium_tab(browser: Browser) -> Generator[Tab]:
    with browser.new_page() as page:
        yield ChromiumTab(page)


@contextlib.contextmanager
def firefox_tab(program: str) -> Generator[Tab]:
    lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in _FIREFOX)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        (Path(folder) / "user.js").write_text("\n".join(lines))
        command = [program, "--headless", "--no-remote", "--profile", folder]
        with _running([*command, "--remote-debugging-port=0"], HOME=folder):
            said = Path(folder) / "WebDriverBiDiServer.json"
            server = _once_there(lambda: json.loads(said.read_text()))
            address = f"ws://{server['ws_host']}:{server['ws_port']}/session"
            with connect(address, proxy=None) as line:
                yield FirefoxTab(line)


@contextlib.contextmanager
def webkit_tab(program: str) -> Generator[Tab]:
    screen = ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x900x24", "-nolisten", "tcp"]
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        _running(screen, stdout=subprocess.PIPE) as xvfb,
    ):
        display = xvfb.stdout.readline().decode().strip() if xvfb.stdout else ""
        assert display, "Xvfb did not start"
        port = _free_port()
        command = [program, "--host=127.0.0.1", f"--port={port}"]
        with (
            _running(command, DISPLAY=f":{display}", HOME=folder, LANG="en_US.UTF-8"),
            httpx.Client(
                base_url=f"http://127.0.0.1:{port}", timeout=PATIENCE_S, trust_env=False
            ) as http,
        ):
            _once_there(lambda: http.get("/status").raise_for_status())
            yield WebKitTab(http)


@contextlib.contextmanager
def _running(
    command: list[str], stdout: int = subprocess.DEVNULL, **environment: str
) -> Generator[subprocess.Popen[bytes]]:
    """A program, ended with all that it has started."""
    process = subprocess.Popen(
        command,
        stdout=stdout,
        stderr=subprocess.DEVNULL,
        env=os.environ | environment,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=10)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _once_there(read: Callable[[], Any]) -> Any:
    """What can be read once a program has come up."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return read()
        except (OSError, ValueError, httpx.HTTPError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
