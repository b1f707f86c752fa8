"""What is wrong in one engine alone: where a drag ends, and what a gamepad leaves behind."""

from collections.abc import Generator

import pytest

from tests.browser.engines import Tab, chromium_tab, firefox_tab, webkit_tab
from tests.browser.find_browser import find_firefox, find_webkit
from tests.browser.study_visitor import go_to
from tests.running_server import Participant, RunningServer, running_server

# Fewer than there are questions, so that there is always a next one.
FLICKS = ((0.5, 0.0), (-0.9, 0.1), (0.0, -0.5), (0.3, 0.8), (-0.4, -0.4), (0.9, -0.2))
WITHIN = 0.02  # of the pad's radius

PLUG_IN = """
(() => {
  const rest = { pressed: false, touched: false, value: 0 }
  const pad = { id: 'A pad', index: 0, mapping: 'standard', connected: true, axes: [0, 0, 0, 0] }
  pad.buttons = Array.from({ length: 17 }, () => rest)
  window.readings = Infinity // after so many it is gone
  navigator.getGamepads = () => (readings-- > 0 ? [pad, null] : [null, null])
  window.push = (x, y, times = Infinity) => {
    pad.axes = [x, -y, 0, 0]
    readings = times
  }
  window.unplug = () => {
    readings = 0
    dispatchEvent(Object.assign(new Event('gamepaddisconnected'), { gamepad: pad }))
  }
})()
"""
NOTE_FRAMES = """
(() => {
  window.frames_ms = []
  requestAnimationFrame(function note(now_ms) {
    frames_ms.push(now_ms)
    requestAnimationFrame(note)
  })
})()
"""


@pytest.fixture(scope="module", params=["chromium", "firefox", "webkit"])
def tab(request: pytest.FixtureRequest) -> Generator[Tab]:
    match request.param:
        case "chromium":
            opened = chromium_tab(request.getfixturevalue("browser"))
        case "firefox":
            opened = firefox_tab(found(find_firefox()))
        case "webkit":
            opened = webkit_tab(found(find_webkit()))
    with opened as tab:
        yield tab


def found(program: str | None) -> str:
    assert program is not None, "'python -m tests.browser.find_browser' gets what is missing"
    return program


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Generator[RunningServer]:
    with running_server(tmp_path_factory.mktemp("engines"), training_steps=20) as server:
        yield server


def visit(tab: Tab, server: RunningServer, step: str) -> str:
    """Open the page of somebody new who is at a step already; their link."""
    (link,) = server.new_links()
    go_to(link, step)
    tab.goto(link)
    tab.wait(f"document.querySelector('body[data-step={step}][data-ready=true]') !== null")
    return link


def at(name: str) -> str:
    return f"document.querySelector('[data-testid={name}]')"


def flick(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Drag the stick from its middle to about ``(x, y)``, let go at once; just where that was."""
    left, top, side = tab.run(
        f"(box => [box.left, box.top, box.width])({at('stick')}.getBoundingClientRect())"
    )
    radius = side / 2
    middle = left + radius, top + radius
    end = round(middle[0] + x * radius), round(middle[1] - y * radius)
    tab.flick((round(middle[0]), round(middle[1])), end)
    return (end[0] - middle[0]) / radius, (middle[1] - end[1]) / radius


def confirm(tab: Tab) -> None:
    """Confirm what is marked, and see the next question."""
    asked = tab.run(f"{at('question')}.innerText")
    tab.wait(f"!{at('confirm')}.disabled")
    tab.run(f"{at('confirm')}.click()")
    tab.wait(f"{at('question')}.innerText !== '{asked}'")


def stored(link: str) -> list[list[float]]:
    """The answers that the server has."""
    answers = [query["answer"] for query in Participant(link).session()["queries"]]
    return [answer["h"] for answer in answers if answer is not None]


def test_an_answer_is_stored_where_the_stick_was_let_go_at_once(
    tab: Tab, server: RunningServer
) -> None:
    link = visit(tab, server, "queries")
    let_go = []
    for x, y in FLICKS:
        let_go.append(flick(tab, x, y))
        confirm(tab)
    for h, end in zip(stored(link), let_go, strict=True):
        assert h == pytest.approx(end, abs=WITHIN)


def test_in_practice_the_dot_goes_back_when_the_gamepad_goes_away(
    tab: Tab, server: RunningServer
) -> None:
    visit(tab, server, "practice")
    dot = "document.querySelector('.game-dot').cx.baseVal.value"
    tab.run(PLUG_IN)
    tab.run("push(-0.6, 0.7)")
    tab.wait(f"{dot} < -0.5")
    tab.run("unplug()")
    tab.wait(f"{dot} === 0")


def test_in_questions_a_gamepad_that_goes_away_leaves_what_was_marked_before(
    tab: Tab, server: RunningServer
) -> None:
    link = visit(tab, server, "queries")
    let_go = flick(tab, 0.3, -0.5)
    tab.run(PLUG_IN)
    tab.run("push(-0.6, 0.7, 1)")  # gone before it was held long enough to be marked
    tab.wait("readings < 0")
    tab.run(NOTE_FRAMES)
    tab.wait("frames_ms.length > 10 && frames_ms.at(-1) - frames_ms[0] > 500")
    confirm(tab)
    assert stored(link) == [pytest.approx(let_go, abs=WITHIN)]


def test_in_the_drive_the_arm_holds_when_the_gamepad_goes_away(
    tab: Tab, server: RunningServer
) -> None:
    visit(tab, server, "driving")
    hold = f"{at('hold')}.dataset.hold"
    tab.wait(f"{hold} === 'released'")
    tab.run(PLUG_IN)
    tab.run("push(-0.6, 0.7)")
    tab.wait(f"{hold} === 'moving'")
    tab.run("unplug()")
    tab.wait(f"{hold} === 'released'")
    tab.wait(f"{at('stick')}.dataset.state === 'empty'")
