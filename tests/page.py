"""A participant's page without a browser: a simulated person labels moves and drives.

Everything goes through the running server's doors, as a page's would. Only what the person sees of
a question, the move itself, is read beside the server: a page gets it as a picture.
"""

import asyncio
import itertools
import json
import uuid
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from app.bots.eyes import Sight, presses
from app.storage.tables import AlignmentRow, QueryRow
from models.alignment import Alignment
from models.checkpoints import load_controller, save_alignment
from models.controller import LatentController
from models.fitting import FitProblem, Labels
from models.kinematics import Kinematics
from models.panda_pack import default_folder, open_pack
from models.preferences import parse_preference
from models.queries import QueryPool, sample_pool
from models.simulated_human import SimulatedHuman, sensitivity
from models.strategies import get_strategy
from models.tasks import Task, get_task
from tests.drivers import stick
from tests.running_server import Participant, RunningServer

STICK_HZ = 30.0


@dataclass(frozen=True)
class Lab:
    """A task and its moves."""

    task: Task
    controller: LatentController
    kinematics: Kinematics
    pool: QueryPool


@cache
def lab_of(task_name: str) -> Lab:
    """The shipped controller's, with a pool that no participant has."""
    task, controller = get_task(task_name), load_controller(task_name)
    kinematics = Kinematics.from_urdf(open_pack(default_folder()).urdf)
    pool = sample_pool(task, controller, kinematics, 1000, np.random.default_rng(77))
    return Lab(task, controller, kinematics, pool)


def person_of(task_name: str, preference: str, seed: int, noise: float) -> SimulatedHuman:
    """Somebody with an idea of their own, the same for the same seed."""
    lab = lab_of(task_name)
    return SimulatedHuman(
        lab.task,
        parse_preference(preference, np.random.default_rng(seed)),
        sensitivity(lab.task, lab.kinematics, lab.pool),
        noise,
    )


@dataclass(eq=False)
class Page:
    """One participant's, and who sits in front of it."""

    server: RunningServer
    participant: Participant
    person: SimulatedHuman
    seed: int
    statuses: int = field(default=0, init=False)

    def label(self) -> None:
        """Consent, practise, answer every question, and wait for the training."""
        lab, rng = lab_of(self.person.task.name), np.random.default_rng(self.seed)
        asked = [query["id"] for query in self.participant.begin()["queries"]]
        shown = {row.id: row for row in self.server.rows(QueryRow)}
        for query_id in asked:
            before, after = (
                lab.kinematics.hand_pose(np.array(q))
                for q in (shown[query_id].s, shown[query_id].next_s)
            )
            h = self.person.label(before, after, rng)
            self.participant.answer(query_id, h.tolist()).raise_for_status()
        assert self.participant.wait_for_training(180.0)["state"] == "succeeded"
        self.participant.post("driving").raise_for_status()

    def put(self, alignment: Alignment, strategy: str) -> None:
        """Put an alignment, learned elsewhere, where that strategy's was."""
        own = {query.id: query.participant_id for query in self.server.rows(QueryRow)}
        mine = own[self.participant.session()["queries"][0]["id"]]
        (row,) = (
            row
            for row in self.server.rows(AlignmentRow)
            if row.participant_id == mine and row.strategy == strategy
        )
        save_alignment(
            Path(self.server.data_dir) / "alignments" / row.file,
            alignment,
            strategy=strategy,
            seed=0,
            data_hash="learned elsewhere",
            settings={},
        )

    async def drive(self, strategy: str, limit_s: float) -> dict[str, Any]:
        """Make one attempt; what the page was told of it last."""
        opened = await asyncio.to_thread(self.participant.post, "drives", strategy=strategy)
        drive_id = opened.raise_for_status().json()["id"]
        self._props = (await asyncio.to_thread(self.participant.session))["props"]
        address = self.participant.link.replace("http", "ws", 1)
        async with connect(f"{address}/live?tab={uuid.uuid4()}") as socket:
            steering: asyncio.Task[None] | None = None
            try:
                async with asyncio.timeout(limit_s):
                    async for text in socket:
                        status = json.loads(text)
                        if status["type"] != "status" or status["drive_id"] != drive_id:
                            continue
                        self._seen = status
                        self.statuses += 1
                        if status["progress"]["end"] is not None:
                            break
                        steering = steering or asyncio.create_task(self._steer(socket))
            except TimeoutError:
                await socket.send(json.dumps({"type": "give-up"}))
            finally:
                if steering is not None:
                    steering.cancel()
        outcome: dict[str, Any] = self._seen["progress"]
        return outcome

    async def wander(self, strategy: str) -> None:
        """Push the stick round and round, in a task that has no end."""
        opened = await asyncio.to_thread(self.participant.post, "drives", strategy=strategy)
        opened.raise_for_status()
        address = self.participant.link.replace("http", "ws", 1)
        async with connect(f"{address}/live?tab={uuid.uuid4()}") as socket:
            for seq in itertools.count():
                angle = seq / STICK_HZ
                x, y = 0.5 * np.cos(angle), 0.5 * np.sin(angle)
                await socket.send(json.dumps({"type": "stick", "seq": seq, "x": x, "y": y}))
                await asyncio.sleep(1.0 / STICK_HZ)

    async def _steer(self, socket: ClientConnection) -> None:
        """Push the stick by what was seen last."""
        seq = 0
        while True:
            sight = Sight.of_status(self._seen, self._props)
            if presses(sight):
                await socket.send(json.dumps({"type": "press"}))
            x, y = stick(self.person, sight).tolist()
            await socket.send(json.dumps({"type": "stick", "seq": seq, "x": x, "y": y}))
            seq += 1
            await asyncio.sleep(1.0 / STICK_HZ)


def ideal(person: SimulatedHuman) -> Alignment:
    """The alignment learned from what the person would answer for every move of the pool."""
    lab = lab_of(person.task.name)
    before = lab.kinematics.hand_pose(lab.pool.states)
    after = lab.kinematics.hand_pose(lab.pool.next_states)
    h = person.answer(person.task.dof_change(before, after), before)
    rows = np.flatnonzero(np.linalg.norm(h, axis=-1) <= 1.0)
    labels = Labels(lab.pool.states[rows], h[rows], lab.pool.next_states[rows])
    problem = FitProblem(lab.task, lab.kinematics, lab.controller, labels, lab.pool)
    return get_strategy("ideal-align").method.fit(problem, 1).alignment
