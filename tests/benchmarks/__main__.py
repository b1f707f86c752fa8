"""``make bench``: how long people wait, and what the fast training saves. Prints; asserts nothing.

Everything is measured in this one run, on this machine, through the doors a page uses.
"""

import asyncio
import itertools
import json
import os
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.progress import track
from rich.table import Table
from websockets.asyncio.client import connect

from tests.benchmarks import learning, sessions, studies, write_lock
from tests.running_server import Participant, running_server

PARTICIPANTS = 7
STICKS = 200
# Nobody is done with seven questions in the first seconds of a server, in which the workers load
# their libraries.
WORKERS_START_S = 10.0


def main() -> None:
    torch.set_num_threads(1)
    console = Console()
    table = Table(title="Joymap, measured now", title_justify="left")
    for column in ("what", "median", "worst", "aim"):
        table.add_column(column, justify="left" if column == "what" else "right")
    with tempfile.TemporaryDirectory() as folder, running_server(Path(folder)) as server:
        waits, driver = model_waits(server.participant_links(PARTICIPANTS))
        table.add_row(
            "last answer → models that can drive",
            f"{np.median(waits):.2f} s",
            f"{max(waits):.2f} s",
            "≤ 2 s",
        )
        latencies_ms = 1000 * np.array(asyncio.run(pose_latencies(driver)))
        p99 = np.quantile(latencies_ms, 0.99)
        table.add_row(
            f"stick message → pose message ({STICKS} of them), p99 for worst",
            f"{np.median(latencies_ms):.1f} ms",
            f"{p99:.1f} ms",
            "≤ 30 ms",
        )
    for row in itertools.chain(studies.rows(), write_lock.rows(), sessions.rows(), learning.rows()):
        table.add_row(*row)
    console.print(table)
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    console.print(f"{os.cpu_count()} cores; load average {load}")


def model_waits(links: list[str]) -> tuple[list[float], Participant]:
    """How long from sending the last answer until the training says that it is done, in [s]."""
    waits = []
    time.sleep(WORKERS_START_S)
    for link in track(links, description="participants"):
        participant = Participant(link)
        queries = participant.begin()["queries"]
        for index, query in enumerate(queries):
            began_s = time.monotonic()
            participant.answer(query["id"], [np.cos(index) * 0.8, np.sin(index) * 0.8])
        participant.wait_for_training()
        waits.append(time.monotonic() - began_s)
    participant.post("driving").raise_for_status()
    participant.post("drives", strategy="all-priors").raise_for_status()
    return waits, participant


async def pose_latencies(driver: Participant) -> list[float]:
    """From a stick message, the arm at rest, to the first pose message it causes, in [s]."""
    address = driver.link.replace("http", "ws", 1)
    rng = np.random.default_rng(1)
    found: list[float] = []
    async with (
        connect(f"{address}/scene", subprotocols=["viser-v1.1.1"], max_size=None) as scene,  # type: ignore[list-item]
        connect(f"{address}/live?tab=bench") as stick,
    ):

        async def push(x: float, y: float) -> None:
            await stick.send(json.dumps({"type": "stick", "seq": 1, "x": x, "y": y}))

        async def drop_statuses() -> None:
            async for _ in stick:
                pass

        dropping = asyncio.create_task(drop_statuses())
        for number in track(range(STICKS), description="sticks"):
            await push(0.0, 0.0)
            # At rest nothing is sent, so the next pose is the answer to the next stick.
            while True:
                try:
                    await asyncio.wait_for(scene.recv(), 0.15)
                except TimeoutError:
                    break
            await asyncio.sleep(rng.uniform(0.0, 0.02))
            angle = 2.4 * number  # round and round, so that the hand stays over the table
            began_s = time.monotonic()
            await push(np.cos(angle), np.sin(angle))
            await scene.recv()
            found.append(time.monotonic() - began_s)
        dropping.cancel()
    return found


if __name__ == "__main__":
    main()
