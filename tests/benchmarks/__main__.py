"""``make bench``: how long people wait, and what the fast training saves. Prints; asserts nothing.

Everything is measured in this one run, on this machine, through the doors a page uses.
"""

import asyncio
import json
import os
import tempfile
import time
import uuid
from pathlib import Path

import httpx
import numpy as np
import torch
from rich.console import Console
from rich.progress import track
from rich.table import Table
from websockets.asyncio.client import connect

from models.alignment import STRATEGIES
from models.checkpoints import load_controller
from models.kinematics import Kinematics
from models.panda_pack import default_folder, open_pack
from models.preferences import rotated
from models.queries import choose_queries, sample_pool
from models.reference_training import fit_reference
from models.simulated_human import SimulatedHuman, sensitivity
from models.tasks import get_task
from models.training import Labels, TrainingSettings, fit_alignment
from tests.running_server import Participant, running_server

PARTICIPANTS = 7
STICKS = 200
# Nobody is done with seven questions in the first seconds of a server, in which the workers load
# their libraries.
WORKERS_START_S = 10.0
FITS = 7
REFERENCE_STEPS = 8  # of the straightforward version; its time grows with its steps


def main() -> None:
    torch.set_num_threads(1)
    console = Console()
    table = Table(title="Joymap, measured now", title_justify="left")
    for column in ("what", "median", "worst", "aim"):
        table.add_column(column, justify="left" if column == "what" else "right")
    with tempfile.TemporaryDirectory() as folder, running_server(Path(folder)) as server:
        waits, driver = model_waits(server.participant_link, server.experimenter_link)
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
    for strategy in ("no-priors", "all-priors"):
        fast, slow = training_times(strategy)
        table.add_row(f"training {strategy}", f"{np.median(fast):.2f} s", f"{max(fast):.2f} s", "")
        table.add_row(f"training {strategy}, straightforward", f"{slow:.1f} s", "", "")
        table.add_row(
            f"training {strategy}, ratio", f"{slow / np.median(fast):.0f} ×", "", "≥ 20 ×"
        )
    console.print(table)
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    console.print(f"{os.cpu_count()} cores; load average {load}")


def model_waits(first_link: str, experimenter_link: str) -> tuple[list[float], Participant]:
    """How long from sending the last answer until the training says that it is done, in [s]."""
    experimenter = httpx.Client(
        base_url=first_link.split("/p/", maxsplit=1)[0], follow_redirects=True
    )
    experimenter.post(experimenter_link).raise_for_status()
    waits = []
    participant = Participant(first_link)
    time.sleep(WORKERS_START_S)
    for number in track(range(PARTICIPANTS), description="participants"):
        if number:
            made = experimenter.post("/api/participants", json={"id": str(uuid.uuid4())})
            participant = Participant(made.json()["link"])
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


def training_times(strategy: str) -> tuple[list[float], float]:
    """Fast fits, and one straightforward fit worked out from its first steps, in [s]."""
    task, controller = get_task("plane"), load_controller("plane")
    kinematics = Kinematics.from_urdf(open_pack(default_folder()).urdf)
    rng = np.random.default_rng(1)
    pool = sample_pool(task, controller, kinematics, 1000, rng)
    chosen = choose_queries(pool, 10, rng, min_travel_m=0.005)
    person = SimulatedHuman(task, rotated(40.0), sensitivity(task, kinematics, pool))
    s, next_s = pool.states[chosen], pool.next_states[chosen]
    labels = Labels(s, person.label(kinematics.hand_pose(s), kinematics.hand_pose(next_s)), next_s)
    settings = TrainingSettings()
    fast = []
    for seed in track(range(FITS), description=f"fits of {strategy}"):
        began_s = time.perf_counter()
        fit_alignment(strategy, controller, kinematics, task, labels, pool, settings, seed)
        fast.append(time.perf_counter() - began_s)
    few = TrainingSettings(steps=REFERENCE_STEPS)
    for _ in range(2):  # the first time warms up
        began_s = time.perf_counter()
        fit_reference(STRATEGIES[strategy], controller, kinematics, task, labels, pool, few, 1)
    slow = (time.perf_counter() - began_s) / REFERENCE_STEPS * settings.steps
    return fast, slow


if __name__ == "__main__":
    main()
