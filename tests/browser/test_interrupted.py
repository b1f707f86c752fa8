"""Whatever happens to the page at any step: nothing lost, nothing doubled.

The other troubles, with a network gone for a minute and a server killed at every step:
``python -m tests.soak.interruptions``.
"""

from playwright.sync_api import Browser

from tests.browser import interrupted


def test_going_back_at_every_step_loses_and_doubles_nothing(browser: Browser) -> None:
    found = interrupted.walk(browser, interrupted.back)
    interrupted.assert_nothing_lost_or_doubled(found)
