"""Browsers of all three engines for the tests: those that are there, else ones that are fetched.

``make test`` runs this before the tests, so that they find them; where one is missing it fails, and
so does the build. Firefox and WebKit are Debian's packages, for Playwright's own Firefox and WebKit
are no browsers that people have.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import sync_playwright

_CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FIREFOXES = ("firefox-esr", "firefox")
# Software rendering; nothing of Chromium's own goes out to the network.
ARGUMENTS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
)


class Engine(NamedTuple):
    """What people's browsers are made of."""

    name: str
    find: Callable[[], str | None]  # the path of the program that the tests start
    packages: tuple[str, ...]  # of Debian and Ubuntu


def find() -> str | None:
    """The path of a Chromium that is there."""
    path = _first(_CHROMIUMS)
    if path is not None:
        return path
    with sync_playwright() as playwright:
        own = playwright.chromium.executable_path
    return own if Path(own).is_file() else None


def find_firefox() -> str | None:
    """The path of a Firefox that is there."""
    return _first(_FIREFOXES)


def find_webkit() -> str | None:
    """The path of WebKitGTK's driver, if there is a screen to draw on as well."""
    return shutil.which("WebKitWebDriver") if shutil.which("Xvfb") else None


def _first(names: tuple[str, ...]) -> str | None:
    return next((path for path in map(shutil.which, names) if path is not None), None)


ENGINES = (
    Engine("Chromium", find, ("chromium",)),
    Engine("Firefox", find_firefox, ("firefox-esr",)),
    Engine("WebKit", find_webkit, ("webkit2gtk-driver", "xvfb")),
)


def install(engine: Engine) -> None:
    """Get a browser of an engine: for Chromium Playwright's, else Debian's."""
    is_root = os.geteuid() == 0
    if engine.name == "Chromium":
        print("── Joymap: no Chromium here; asking Playwright for its own", flush=True)
        command = [sys.executable, "-m", "playwright", "install", "--with-deps", "chromium"]
        if not is_root:
            command.remove("--with-deps")
        subprocess.run(command, check=False)
    if engine.find() is None and is_root and shutil.which("apt-get"):
        print(f"── Joymap: installing Debian's {' and '.join(engine.packages)}", flush=True)
        subprocess.run(["apt-get", "update", "-qq"], check=False)
        command = ["apt-get", "install", "-y", "-qq", "--no-install-recommends"]
        subprocess.run([*command, *engine.packages], check=False)


def main() -> int:
    missing = 0
    for engine in ENGINES:
        if engine.find() is None:
            install(engine)
        path = engine.find()
        if path is None:
            print(
                f"The browser tests need {engine.name}, and it could not be installed. "
                f"On Debian: apt install {' '.join(engine.packages)}",
                file=sys.stderr,
            )
            missing += 1
        else:
            print(f"── Joymap: testing with {path}")
    return min(missing, 1)


if __name__ == "__main__":
    sys.exit(main())
