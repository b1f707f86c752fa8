"""A Chromium for the tests: one that is there, else Playwright's own, else Debian's package.

``make test`` runs this before the tests, so that they find one; without one it fails, and so does
the build.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
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


def find() -> str | None:
    """The path of a Chromium that is there."""
    for name in _NAMES:
        path = shutil.which(name)
        if path is not None:
            return path
    with sync_playwright() as playwright:
        own = playwright.chromium.executable_path
    return own if Path(own).is_file() else None


def install() -> None:
    """Get one: Playwright's, else Debian's."""
    print("── Joymap: no Chromium here; asking Playwright for its own", flush=True)
    command = [sys.executable, "-m", "playwright", "install", "--with-deps", "chromium"]
    if os.geteuid() != 0:
        command.remove("--with-deps")
    subprocess.run(command, check=False)
    if find() is None and os.geteuid() == 0 and shutil.which("apt-get"):
        print("── Joymap: installing Debian's chromium", flush=True)
        subprocess.run(["apt-get", "update", "-qq"], check=False)
        subprocess.run(["apt-get", "install", "-y", "-qq", "chromium"], check=False)


def main() -> int:
    if find() is None:
        install()
    path = find()
    if path is None:
        print(
            "The browser tests need a Chromium, and none could be installed. "
            "On Debian or Ubuntu: apt install chromium",
            file=sys.stderr,
        )
        return 1
    print(f"── Joymap: testing with {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
