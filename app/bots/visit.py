"""One simulated participant's way through a study: HTTP and websockets, as a page uses them.

All that a bot knows of the robot is what the page is told: where the hand is while a move is shown
and while it drives, what the words say, and which step is on the screen.
"""

import asyncio
import contextlib
import json
import time
import uuid
from collections.abc import AsyncGenerator, Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import httpx
import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from app.bots import eyes
from app.bots.opinions import Felt, respond
from app.bots.person import STEP_S, Person
from models.kinematics import HandPose
from models.tasks import Task, get_task

STICK_HZ = 30.0
_PATIENCE_S = 300.0  # with a training, or an attempt that does not end
_TRIES = 60
_CUT_S = 15.0  # without a word of the attempt, and it is no more


class _Cut(Exception):
    """The attempt is over for the server: the line was gone for too long."""


class Gone(Exception):
    """The server did not do what a page needs, however often it was asked."""


@dataclass(frozen=True)
class Manners:
    """How rude a bot is.

    Attributes:
        drop_out: At which share of the steps they leave for good; None: they stay.
        double_submit: Whether everything is sent twice.
        reconnect: Whether the connection breaks now and then.
        two_tabs: Whether a second tab looks on.
        gives_up_s: After how long they give an attempt up.
    """

    drop_out: float | None = None
    double_submit: bool = False
    reconnect: bool = False
    two_tabs: bool = False
    gives_up_s: float = 60.0


@dataclass
class Report:
    """How a visit went.

    Attributes:
        state: "completed", "dropped out", or a sentence on what went wrong.
        step: The key of the last step.
        drives: How many attempts were made.
        driven_s: How long they lasted by the server's clock.
        waited_s: How long they lasted by the bot's.
        refusals: Answers of the server that begin with a 5.
    """

    state: str = "began"
    step: str = ""
    place: float = 0.0
    drives: int = 0
    driven_s: float = 0.0
    waited_s: float = 0.0
    refusals: int = 0


@dataclass
class Visit:
    """A bot in front of its page."""

    link: str
    person: Person
    manners: Manners
    report: Report = field(default_factory=Report)
    speed: float = 1.0  # of the arm's time, which is theirs while they look at it and drive
    _felt: list[Felt] = field(default_factory=list)

    async def run(self, http: httpx.AsyncClient) -> Report:
        """Do everything that is asked, to the last page."""
        self._http = http
        try:
            session = await self._get("session")
            while session["step"] not in ("end", "driving"):
                self.report.step = session["key"]
                self.report.place = session["place"] / (session["place"] + 5)
                if self._leaves(session):
                    self.report.state = "dropped out"
                    return self.report
                session = await self._do(session)
            self.report.step, self.report.place = session["key"], 1.0
            self.report.state = session["state"]
        except Gone as error:
            self.report.state = str(error)
        return self.report

    def _leaves(self, session: dict[str, Any]) -> bool:
        stages = session["way"]
        here = next(index for index, stage in enumerate(stages) if stage["is_here"])
        limit = self.manners.drop_out
        return limit is not None and here >= limit * len(stages)

    async def _do(self, session: dict[str, Any]) -> dict[str, Any]:
        match session["step"]:
            case "consent":
                return await self._post("consent", version=session["consent"]["version"])
            case "practice":
                return await self._post("practice")
            case "queries":
                return await self._answer(session)
            case "training":
                return await self._wait_for_training()
            case "block":
                return await self._drive(session)
            case _:
                return await self._fill_in(session)

    def _now_s(self) -> float:
        return self.speed * time.monotonic()

    # Questions.

    async def _answer(self, session: dict[str, Any]) -> dict[str, Any]:
        task = _task_of(session)
        async with self._page() as page:
            while session["step"] == "queries":
                waiting = [query for query in session["queries"] if query["answer"] is None]
                if not waiting:
                    raise Gone("everything is answered and the questions do not end")
                query_id = waiting[0]["id"]
                began_s = self._now_s()
                before, after, duration_s = await self._watch(page, query_id)
                h = self.person.label(task, before, after, round(duration_s / STEP_S))
                session = await self._post(
                    "answers",
                    query_id=query_id,
                    h=h.tolist(),
                    thinking_time_s=self._now_s() - began_s,
                )
        return session

    async def _watch(self, page: "_Page", query_id: str) -> tuple[HandPose, HandPose, float]:
        """Look at a move: the hand at its beginning and at its end, and how long that takes."""
        for _ in range(_TRIES):
            await page.send(type="show", query_id=query_id)
            before: HandPose | None = None
            limit_s = time.monotonic() + 10.0
            while time.monotonic() < limit_s:
                status = await page.next_status()
                playback = status["playback"]
                if playback is None or playback["query_id"] != query_id:
                    continue
                if playback["fraction"] == 0.0:
                    before = eyes.hand_of(status)
                if playback["fraction"] == 1.0 and before is not None:
                    return before, eyes.hand_of(status), playback["duration_s"]
        raise Gone("the moves are not shown")

    async def _wait_for_training(self) -> dict[str, Any]:
        limit_s = time.monotonic() + _PATIENCE_S
        while time.monotonic() < limit_s:
            training = await self._get("training")
            if training["state"] == "succeeded":
                return await self._post("driving")
            if training["state"] == "failed":
                await self._post("training/retry")
            await asyncio.sleep(0.5)
        raise Gone("the training did not end")

    # Driving.

    async def _drive(self, session: dict[str, Any]) -> dict[str, Any]:
        task, key, props = _task_of(session), session["key"], session["props"]
        self.person.begin()
        if session["block"]["position"] == 1:
            self._felt = []
        failed, made = 0, 0
        while not session["block"]["may_continue"]:
            drive_id = session["block"]["open_drive"] or str(uuid.uuid4())
            await self._post("drives", _id=drive_id)
            try:
                progress = await self._attempt(task, props, drive_id)
            except _Cut:  # as a page does: ask where one is, and begin again
                session = await self._get("session")
                if session["step"] != "block":
                    return session
                continue
            made += 1
            failed += not progress["is_success"]
            # The end is kept a moment after it is told.
            for _ in range(_TRIES):
                session = await self._get("session")
                if session["step"] != "block" or session["block"]["drives_made"] >= made:
                    break
                await asyncio.sleep(0.1)
            if session["step"] != "block":
                return session
        self._felt.append(Felt(self.person.surprise(), failed / max(1, made)))
        return await self._post("block", key=key)

    async def _attempt(self, task: Task, props: eyes.Props, drive_id: str) -> dict[str, Any]:
        """One try, with a break of the connection now and then for those who have such a line."""
        self.person.pause()
        began_s, progress = self._now_s(), None
        breaks = iter(
            self.person.rng.uniform(2.0, 8.0, 5).tolist() if self.manners.reconnect else []
        )
        while progress is None:
            async with self._page() as page:
                break_s = next(breaks, np.inf)
                progress = await self._steer(page, task, props, drive_id, began_s, break_s)
        self.report.drives += 1
        self.report.driven_s += progress["elapsed_s"]
        self.report.waited_s += self._now_s() - began_s
        return progress

    async def _steer(
        self,
        page: "_Page",
        task: Task,
        props: eyes.Props,
        drive_id: str,
        began_s: float,
        break_s: float,
    ) -> dict[str, Any] | None:
        """Steer until the attempt ends, or (None) until the connection breaks."""
        seen: list[tuple[float, dict[str, Any]]] = []
        until_s, last_s, sequence = self._now_s() + break_s, self._now_s(), 0
        until_cut_s = self._now_s() + _CUT_S
        listening = asyncio.create_task(page.keep(seen, self._now_s))
        try:
            while True:
                now_s = self._now_s()
                if now_s > until_s or listening.done():
                    return None
                mine = [status for _, status in seen if status["drive_id"] == drive_id]
                if mine and mine[-1]["progress"]["end"] is not None:
                    ended: dict[str, Any] = mine[-1]["progress"]
                    return ended
                if mine:
                    until_cut_s = now_s + _CUT_S
                elif now_s > until_cut_s:
                    raise _Cut
                if now_s - began_s > self.manners.gives_up_s + _PATIENCE_S:
                    raise Gone("an attempt does not end")
                if now_s - began_s > self.manners.gives_up_s:
                    await page.send(type="give-up")
                old = [
                    status
                    for then_s, status in seen
                    if now_s - then_s >= self.person.habits.reaction_s
                    and status["drive_id"] == drive_id
                ]
                if old:
                    del seen[: max(0, len(seen) - 60)]
                    sight = eyes.Sight.of_status(old[-1], props)
                    await self._push(page, task, sight, sequence, now_s - last_s)
                    last_s, sequence = now_s, sequence + 1
                await asyncio.sleep(1.0 / STICK_HZ / self.speed)
        except ConnectionClosed:
            return None
        finally:
            listening.cancel()

    async def _push(
        self, page: "_Page", task: Task, sight: eyes.Sight, sequence: int, dt_s: float
    ) -> None:
        if eyes.presses(sight):
            await page.send(type="press")
        wish = eyes.wish_from(task.name, sight)
        x, y = self.person.push(task, wish, sight.hand, self._now_s(), dt_s).tolist()
        await page.send(type="stick", seq=sequence, x=x, y=y)

    # Questionnaires.

    async def _fill_in(self, session: dict[str, Any]) -> dict[str, Any]:
        felt = self._felt[-1] if self._felt else Felt(0.5, 0.5)
        now = datetime.now(UTC).isoformat()
        given = [
            {
                "item": item["key"],
                "value": respond(item, felt, self._felt, self.person.rng),
                "answered_at": now,
            }
            for item in session["questions"]["questionnaire"]["items"]
        ]
        return await self._post("questions", key=session["key"], responses=given)

    # The wire.

    @contextlib.asynccontextmanager
    async def _page(self) -> AsyncGenerator["_Page"]:
        address = f"{self.link.replace('http', 'ws', 1)}/live?tab="
        async with contextlib.AsyncExitStack() as stack:
            if self.manners.two_tabs:
                other = await stack.enter_async_context(connect(address + str(uuid.uuid4())))
                dropping = asyncio.create_task(_drop_everything(other))
                stack.callback(dropping.cancel)
            try:
                socket = await stack.enter_async_context(connect(address + str(uuid.uuid4())))
            except (OSError, ConnectionClosed) as error:
                raise Gone("the arm cannot be reached") from error
            yield _Page(socket)

    async def _get(self, path: str) -> dict[str, Any]:
        return await self._ask(lambda: self._http.get(f"{self.link}/api/{path}"))

    async def _post(self, path: str, _id: str | None = None, **body: Any) -> dict[str, Any]:
        content = json.dumps({"id": _id or str(uuid.uuid4())} | body)
        headers = {"Content-Type": "application/json"}

        def send() -> Any:
            return self._http.post(f"{self.link}/api/{path}", content=content, headers=headers)

        found = await self._ask(send)
        if self.manners.double_submit:
            found = await self._ask(send)
        return found

    async def _ask(self, send: Callable[[], Any]) -> dict[str, Any]:
        """Ask until the server answers, as a page does."""
        for attempt in range(_TRIES):
            try:
                response = await send()
            except httpx.TransportError:
                await asyncio.sleep(min(2.0, 0.1 * 2**attempt))
                continue
            self.report.refusals += response.status_code >= 500
            if response.status_code in (429, 502, 503, 504):
                await asyncio.sleep(min(2.0, 0.1 * 2**attempt))
                continue
            if response.status_code == 409:
                # The page was behind what is so: it asks where it is.
                return await self._get("session")
            if response.is_error:
                raise Gone(f"{response.request.url.path.split('/api/')[-1]}: {response.text}")
            found: dict[str, Any] = response.json()
            return found
        raise Gone("the server does not answer")


class _Page:
    """The websocket of the stick."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket

    async def send(self, **message: Any) -> None:
        await self._socket.send(json.dumps(message))

    async def next_status(self) -> dict[str, Any]:
        while True:
            async with asyncio.timeout(10.0):
                message: dict[str, Any] = json.loads(await self._socket.recv())
            if message["type"] == "status":
                return message

    async def keep(
        self, seen: list[tuple[float, dict[str, Any]]], clock: Callable[[], float]
    ) -> None:
        """Remember every status with the time at which it was seen."""
        while True:
            status = await self.next_status()
            seen.append((clock(), status))


async def _drop_everything(socket: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        async for _ in socket:
            pass


def _task_of(session: dict[str, Any]) -> Task:
    """The task that the page is about."""
    return get_task(session["task_name"])
