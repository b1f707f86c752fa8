"""A participant in a real Chromium: sees the page, drags the stick, hears what the page hears."""

import json
import re
import time
from typing import Any

from playwright.sync_api import Browser, Page, ViewportSize, WebSocket

from tests.patience import PATIENCE_S
from tests.running_server import RunningServer

LAPTOP: ViewportSize = {"width": 1280, "height": 800}
PHONE: ViewportSize = {"width": 390, "height": 844}

# In the picture's frame: viser's page is not run, and the page around is told that it is there.
_NO_PICTURE = """
if (location.pathname.endsWith('/scene/')) {
  stop()
  parent.postMessage({ source: 'joymap-scene', type: 'connected' }, location.origin)
}
"""


def sign_up(page: Page, server: RunningServer, link: str | None = None) -> None:
    """Make an account by a link, else by the printed one, and arrive on the dashboard."""
    page.goto(link or server.experimenter_link)
    page.get_by_test_id("name").fill("ada")
    page.get_by_test_id("password").fill("correct horse")
    page.get_by_test_id("open-dashboard").click()
    server.owner = "ada"
    page.wait_for_url("**/dashboard")


class Visitor:
    """One browser tab with a participant's link open.

    Without a graphics card the 3-D picture costs more than all else: ``has_picture=False`` leaves
    it out, where it is not looked at.
    """

    def __init__(
        self,
        browser: Browser,
        link: str,
        viewport: Any = None,
        *,
        has_picture: bool = True,
        **context: Any,
    ) -> None:
        self.context = browser.new_context(viewport=viewport or LAPTOP, **context)
        if not has_picture:
            self.context.add_init_script(_NO_PICTURE)
        self.complaints: list[str] = []
        self.steered = 0  # statuses that said the arm was being steered
        self.link = link
        self.page = self.open_tab()

    def open_tab(self) -> Page:
        page = self.context.new_page()
        page.set_default_timeout(1000 * PATIENCE_S)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("websocket", self._listen)
        self.status: dict[str, Any] = {}
        page.goto(self.link)
        return page

    def _listen(self, socket: WebSocket) -> None:
        if "/live" in socket.url:
            socket.on("framereceived", self._hear)

    def _hear(self, frame: Any) -> None:
        message = json.loads(frame)
        if message["type"] == "status":
            self.status = message
            self.steered += message["mode"] == "driving" and message["hold"] in (None, "edge")

    def wait_for_step(self, step: str, limit_s: float = PATIENCE_S) -> None:
        place = f"body[data-step='{step}'][data-ready='true']"
        self.page.locator(place).wait_for(timeout=1000 * limit_s)

    def click(self, name: str) -> None:
        self.page.get_by_test_id(name).click()

    def text(self, name: str) -> str:
        return self.page.get_by_test_id(name).inner_text()

    def begin(self) -> None:
        self.wait_for_step("consent")
        self.click("begin")
        self.wait_for_step("practice")
        self.click("ready")
        self.wait_for_step("queries")

    def question(self) -> int:
        """Which question is on the screen, from 1; 0 when there is none (any more)."""
        shown = self.page.evaluate(
            "document.querySelector('[data-testid=question]')?.innerText ?? ''"
        )
        found = re.search(r"(\d+)", shown)
        return 0 if found is None else int(found[1])

    def press_stick(self, x: float, y: float) -> None:
        """Drag the stick from its middle to ``(x, y)`` and keep it there."""
        box = self.page.get_by_test_id("stick").bounding_box()
        assert box is not None
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        radius = box["width"] / 2
        self.page.mouse.move(*middle)
        self.page.mouse.down()
        self.page.mouse.move(middle[0] + x * radius, middle[1] - y * radius, steps=3)
        # The page reads the stick once a frame; while the picture is drawn that can take a second.
        self.page.evaluate("() => new Promise(requestAnimationFrame)")

    def release_stick(self) -> None:
        self.page.mouse.up()

    def answer(self, x: float, y: float) -> None:
        """Show a stick input for the question on the screen and confirm it."""
        number = self.question()
        self.press_stick(x, y)
        self.release_stick()
        self.click("confirm")
        self.wait(lambda: self.question() != number)

    def step(self) -> str:
        return self.page.locator("body").get_attribute("data-step") or ""

    def wait(self, holds: Any, limit_s: float = PATIENCE_S) -> None:
        deadline = time.monotonic() + limit_s
        while not holds():
            assert time.monotonic() < deadline, "what was waited for did not come"
            self.page.wait_for_timeout(30)

    def close(self) -> None:
        self.context.close()
