"""Many simulated participants at once, each with an idea of their own."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from urllib.parse import urlsplit

import httpx
import numpy as np

from app.bots.person import Habits, Person
from app.bots.visit import Gone, Manners, Report, Visit
from models.preferences import parse_preference


@dataclass(frozen=True)
class Crowd:
    """Who comes.

    Attributes:
        participants: How many.
        preference: A word for their idea of the stick; ``random`` draws one for each.
        habits: What they have in common.
        seed: Of all their chance; the same seed, the same people.
        parallel: How many at once.
        drop_out: The share that leaves before the end.
        double_submit: Whether they send everything twice.
        reconnect: Whether their connections break now and then.
        two_tabs: Whether a second tab looks on.
        rude_share: The share of them that is rude in these ways.
        gives_up_s: After how long they give an attempt up.
        speed: How much faster than real the server's arms are.
    """

    participants: int
    preference: str = "random"
    habits: Habits = field(default_factory=Habits)
    seed: int = 0
    parallel: int = 4
    drop_out: float = 0.0
    double_submit: bool = False
    reconnect: bool = False
    two_tabs: bool = False
    rude_share: float = 1.0
    gives_up_s: float = 60.0
    speed: float = 1.0

    def person(self, index: int) -> Person:
        """The person of that number."""
        rng = np.random.default_rng([self.seed, index])
        return Person(parse_preference(self.preference, rng), self.habits, rng)

    def manners(self, index: int) -> Manners:
        """How they behave."""
        rng = np.random.default_rng([self.seed, index, 1])
        leaves = rng.random() < self.drop_out
        is_rude = rng.random() < self.rude_share
        return Manners(
            drop_out=float(rng.uniform(0.1, 0.9)) if leaves else None,
            double_submit=self.double_submit and is_rude,
            reconnect=self.reconnect and is_rude,
            two_tabs=self.two_tabs and is_rude,
            gives_up_s=self.gives_up_s,
        )


async def send(crowd: Crowd, join_link: str, note: Callable[[list[Report]], None]) -> list[Report]:
    """Let everyone take part by a study's shared link.

    Args:
        crowd: Who comes.
        join_link: The study's.
        note: Called now and then with what is known of everyone.
    """
    reports = [Report() for _ in range(crowd.participants)]
    room = asyncio.Semaphore(crowd.parallel)
    limits = httpx.Limits(max_connections=None, max_keepalive_connections=crowd.parallel)

    async def take_part(index: int) -> None:
        async with room, httpx.AsyncClient(timeout=30.0, limits=limits) as http:
            try:
                link = await _join(http, join_link, f"bot-{crowd.seed}-{index}")
                person, manners = crowd.person(index), crowd.manners(index)
                await Visit(link, person, manners, reports[index], crowd.speed).run(http)
            except Gone as error:
                reports[index].state = str(error)
            except Exception as error:
                reports[index].state = f"stopped: {error!r}"

    async def keep_noting() -> None:
        while True:
            note(reports)
            await asyncio.sleep(0.5)

    noting = asyncio.create_task(keep_noting())
    await asyncio.gather(*(take_part(index) for index in range(crowd.participants)))
    noting.cancel()
    note(reports)
    return reports


async def _join(http: httpx.AsyncClient, join_link: str, external_id: str) -> str:
    """A place in the study: the participant's own link."""
    for attempt in range(20):
        try:
            await http.get(join_link)  # as a browser does, which is known by it from then on
            made = await http.post(join_link, json={"external_id": external_id})
        except httpx.TransportError:
            await asyncio.sleep(0.2 * (1 + attempt))
            continue
        if made.status_code == 429:
            await asyncio.sleep(1.0)
            continue
        if made.is_error:
            raise Gone(made.json()["error"]["sentence"])
        # By the address that this machine reaches the server at, whatever it calls itself.
        path = urlsplit(made.json()["link"]).path
        server, _, _ = join_link.partition("/join/")
        return f"{server}{path}"
    raise Gone("the study's link does not answer")
