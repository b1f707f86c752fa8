"""Trouble at every step of a study in a real Chromium: is anything lost, is anything doubled?

Run ``python -m tests.soak.interruptions``; a line for each kind of trouble, and 1 at the end if
any of them lost or doubled something.
"""

import argparse
import sys
import time

from playwright.sync_api import sync_playwright

from tests.browser import interrupted
from tests.browser.find_browser import ARGUMENTS, find


def main() -> int:
    """Walk through a study for each kind of trouble."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--offline-s", type=float, default=60.0)
    chosen = parser.parse_args()
    troubles = {
        "reload": interrupted.reload,
        "back": interrupted.back,
        "two tabs": interrupted.two_tabs,
        "server killed and started": interrupted.restart,
        f"{chosen.offline_s:g} s offline": interrupted.offline(chosen.offline_s),
    }
    failed = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find(), args=list(ARGUMENTS))
        for name, trouble in troubles.items():
            began_s = time.monotonic()
            found = interrupted.walk(browser, trouble)
            try:
                interrupted.assert_nothing_lost_or_doubled(found)
                verdict = "nothing lost, nothing doubled"
            except AssertionError as error:
                verdict, failed = f"WRONG: {error}", 1
            counts = ", ".join(
                f"{len(rows)} {table}s" for table, rows in found.items() if table != "complaints"
            )
            took_s = time.monotonic() - began_s
            print(f"{name} at every step: {verdict} ({counts}; {took_s:.0f} s)", flush=True)
        browser.close()
    return failed


if __name__ == "__main__":
    sys.exit(main())
