"""Tasks of the user study, labelled and driven through a running server as a page would.

Of many people and many starts, ``make soak`` tells.
"""

import asyncio
import json
import time
from pathlib import Path

import pytest
from websockets.sync.client import connect

from app.storage.tables import SampleChunkRow
from models.experiment import PAPER_LABELS
from tests.page import Page, person_of
from tests.running_server import Participant, running_server

TASKS = ["fetch-and-pour", pytest.param("pour-cup", marks=pytest.mark.soak)]


@pytest.mark.parametrize("task", TASKS)  # test_bots.py goes round
def test_who_has_answered_as_many_questions_as_the_paper_asks_gets_it_done(
    task: str, tmp_path: Path
) -> None:
    person = person_of(task, "mirrored+rotated:110", seed=5, noise=0.1)
    with running_server(tmp_path, task=task, labels_wanted=PAPER_LABELS[task]) as server:
        page = Page(server, Participant(server.participant_link), person, seed=5)
        page.label()
        # The robot's own mapping first: what moves the arm otherwise is not what was learned.
        lost = asyncio.run(page.drive("no-align", limit_s=6.0))
        assert not lost["is_success"]
        outcome = asyncio.run(page.drive("all-priors", limit_s=60.0))
        assert outcome["is_success"], outcome
        assert page.statuses > 5 * outcome["elapsed_s"]
        stick_of_a_finished_drive_moves_nothing(page)
        assert "Traceback" not in server.log()


def stick_of_a_finished_drive_moves_nothing(page: Page) -> None:
    time.sleep(1.0)
    ticks = sum(chunk.ticks for chunk in page.server.rows(SampleChunkRow))
    address = page.participant.link.replace("http", "ws", 1)
    with connect(f"{address}/live?tab=late") as socket:
        before = json.loads(socket.recv())
        for seq in range(30):
            socket.send(json.dumps({"type": "stick", "seq": seq, "x": 0.0, "y": 1.0}))
            time.sleep(1 / 30)
        socket.send('{"type": "press"}')
        message = json.loads(socket.recv())
        while message["type"] != "error":
            assert message["hold"] == "over"
            assert message["hand"] == pytest.approx(before["hand"], abs=2e-3)
            message = json.loads(socket.recv())
    assert "no drive is going on" in message["sentence"]
    time.sleep(0.8)
    assert sum(chunk.ticks for chunk in page.server.rows(SampleChunkRow)) == ticks
