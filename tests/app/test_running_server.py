"""The server as a process: its websockets, its trainings, and what survives ``kill -9``."""

import contextlib
import itertools
import json
import math
import os
import signal
import time
import uuid
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from app.storage.database import make_engine
from app.storage.tables import AlignmentRow, AnswerRow, DriveRow, JobRow, SampleChunkRow
from app.storage.ticks import COLUMNS, unpack
from tests.patience import PATIENCE_S
from tests.running_server import Participant, RunningServer, running_server

VISER = Subprotocol("viser-v1.1.1")


@pytest.fixture(scope="module")
def data_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("server")


@pytest.fixture(scope="module")
def server(data_dir: Path) -> Generator[RunningServer]:
    with running_server(data_dir) as server:
        yield server


@pytest.fixture(scope="module")
def driver(server: RunningServer) -> Participant:
    """A participant whose training is done."""
    participant = Participant(server.participant_link)
    answer_all(participant)
    assert participant.wait_for_training()["state"] == "succeeded"
    participant.post("driving").raise_for_status()
    return participant


def answer_all(participant: Participant) -> None:
    for index, query in enumerate(participant.begin()["queries"]):
        angle = 0.9 * index
        h = [0.7 * float(np.cos(angle)), 0.7 * float(np.sin(angle))]
        participant.answer(query["id"], h).raise_for_status()


def live(participant: Participant, tab: str | None = None, **options: Any) -> ClientConnection:
    address = participant.link.replace("http", "ws", 1)
    return connect(f"{address}/live?tab={tab or uuid.uuid4()}", **options)


def hear(socket: Connection, kind: str, limit_s: float = PATIENCE_S, **wanted: Any) -> Any:
    """The next message of a kind with these contents."""
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        message = json.loads(socket.recv(timeout=deadline - time.monotonic()))
        if message["type"] == kind and all(message[key] == wanted[key] for key in wanted):
            return message
    raise AssertionError(f"nothing of {kind} {wanted} was heard")


def now(socket: Connection) -> Any:
    """What the arm is doing now: the first status after all that was said before."""
    with contextlib.suppress(TimeoutError):
        while True:
            socket.recv(timeout=0)
    return hear(socket, "status")


def steer(socket: Connection, x: float, y: float, seconds: float) -> None:
    for seq in range(round(seconds * 30)):
        socket.send(json.dumps({"type": "stick", "seq": seq, "x": x, "y": y}))
        time.sleep(1 / 30)


def rows(data_dir: Path, table: Any) -> list[Any]:
    """What the database holds, read beside the server."""
    engine = make_engine(data_dir / "joymap.db")
    with Session(engine) as db:
        found = list(db.scalars(select(table)))
    engine.dispose()
    return found


def test_driving_moves_the_hand_and_every_tick_is_kept(driver: Participant, data_dir: Path) -> None:
    drive_id = driver.post("drives", strategy="all-priors").json()["id"]
    with live(driver) as socket:
        before = hear(socket, "status", mode="driving")["hand"]
        steer(socket, 0.0, 0.9, 1.5)
        after = now(socket)["hand"]
        assert np.linalg.norm(np.subtract(after, before)) > 0.05
        steer(socket, 0.0, 0.0, 0.3)
        assert now(socket)["hold"] == "released"
        time.sleep(1.0)
        chunks = [chunk for chunk in rows(data_dir, SampleChunkRow) if chunk.drive_id == drive_id]
    samples = np.concatenate([unpack(chunk.samples) for chunk in chunks])
    times = samples[:, 0]
    # However late the machine is, time is left out and never caught up with by a leap.
    assert np.diff(times).min() > 1 / 60 - 0.004
    assert samples[:, COLUMNS.index("raw_y")].max() == 0.9
    assert sum(chunk.ticks for chunk in chunks) == len(samples)


def test_the_newest_tab_holds_the_stick_and_the_older_can_take_it_back(
    driver: Participant,
) -> None:
    driver.post("drives", strategy="no-align")
    with live(driver, "old") as old:
        hear(old, "status", has_stick=True)
        with live(driver, "new") as new:
            hear(new, "status", has_stick=True)
            hear(old, "status", has_stick=False)
            at = now(old)["hand"]
            steer(old, 1.0, 0.0, 0.5)
            assert now(new)["hand"] == pytest.approx(at, abs=2e-3)
            old.send('{"type": "take"}')
            hear(old, "status", has_stick=True)
            hear(new, "status", has_stick=False)


@pytest.mark.parametrize(
    "message",
    [
        '{"type": "stick", "seq": 1, "x": NaN, "y": 0}',
        '{"type": "stick", "seq": 1, "x": Infinity, "y": 0}',
        '{"type": "stick", "seq": 1, "x": 1e999, "y": 0}',
        '{"type": "stick", "seq": 1, "x": 1.2, "y": 0}',
        '{"type": "stick", "seq": 1, "x": "0.5", "y": [0]}',
        '{"type": "stick"}',
        '{"type": "fly"}',
        "[]",
        "null",
        "{",
        "",
        "[" * 5000,
    ],
)
def test_a_message_that_makes_no_sense_gets_a_sentence_and_moves_nothing(
    driver: Participant, message: str
) -> None:
    driver.post("drives", strategy="no-align")
    with live(driver) as socket:
        at = hear(socket, "status", mode="driving")["hand"]
        socket.send(message)
        assert hear(socket, "error")["sentence"].endswith(".")
        time.sleep(0.3)
        assert now(socket)["hand"] == pytest.approx(at, abs=1e-3)


def test_a_binary_frame_closes_nothing_but_is_refused(driver: Participant) -> None:
    with live(driver) as socket:
        socket.send(b"\x00\xff\x00")
        assert hear(socket, "error")["sentence"].endswith(".")


def test_a_page_that_floods_the_server_does_not_stop_anyone(driver: Participant) -> None:
    drive_id = driver.post("drives", strategy="no-align").json()["id"]
    flood = [json.dumps({"type": "stick", "seq": 1, "x": 1.0, "y": 0.0}), '{"type": "fly"}']
    with live(driver) as first, live(driver) as socket:
        hear(socket, "status", has_stick=True, drive_id=drive_id)
        at = now(socket)["hand"]
        for n in range(3000):
            first.send(flood[n % 2])  # of a page that does not hold the stick
        steer(socket, 0.0, -0.5, 0.4)
        down = now(socket)["hand"]
        steer(socket, 0.0, 0.5, 0.4)
        assert max(math.dist(at, down), math.dist(down, now(socket)["hand"])) > 0.005
        for _ in range(1500):
            assert "not understood" in hear(first, "error")["sentence"]


def test_a_message_too_long_ends_the_connection_and_not_the_server(driver: Participant) -> None:
    with pytest.raises(ConnectionClosed), live(driver) as socket:
        socket.send("x" * (1 << 20))
        for _ in range(200):
            socket.recv(timeout=PATIENCE_S)
    assert driver.session()["step"] == "driving"


@pytest.mark.parametrize("path", ["live?tab=t", "scene"])
def test_a_websocket_from_another_site_is_refused(driver: Participant, path: str) -> None:
    address = driver.link.replace("http", "ws", 1)
    with pytest.raises(InvalidStatus, match="403"):
        connect(f"{address}/{path}", origin=Origin("http://evil.example"), subprotocols=[VISER])
    own = "/".join(driver.link.split("/")[:3])
    with connect(f"{address}/{path}", origin=Origin(own), subprotocols=[VISER]):
        pass


@pytest.mark.parametrize("path", ["live?tab=t", "scene"])
def test_a_websocket_with_an_unknown_link_is_refused(server: RunningServer, path: str) -> None:
    address = server.base_url.replace("http", "ws", 1)
    with pytest.raises(InvalidStatus, match=r"403|404"):
        connect(f"{address}/p/nobody/{path}", subprotocols=[VISER])


def test_a_scene_page_of_another_version_is_sent_away(driver: Participant) -> None:
    address = driver.link.replace("http", "ws", 1)
    with pytest.raises(InvalidStatus):
        connect(f"{address}/scene", subprotocols=[Subprotocol("viser-v0.0.1")])


def test_the_stick_says_nothing_before_the_training(server: RunningServer) -> None:
    (link,) = server.new_links()
    early = Participant(link)
    early.begin()
    with live(early) as socket:
        at = hear(socket, "status", mode="idle")["hand"]
        socket.send('{"type": "stick", "seq": 1, "x": 1, "y": 0}')
        assert "after the training" in hear(socket, "error")["sentence"]
        assert now(socket)["hand"] == at
        socket.send(json.dumps({"type": "show", "query_id": str(uuid.uuid4())}))
        assert "not one of yours" in hear(socket, "error")["sentence"]


def test_what_a_scene_page_sends_is_dropped(driver: Participant, server: RunningServer) -> None:
    address = driver.link.replace("http", "ws", 1)
    with connect(f"{address}/scene", subprotocols=[VISER], max_size=None) as scene:
        assert len(scene.recv(timeout=PATIENCE_S)) > 1000
        for junk in (b"", b"\xff" * 100, "text"):
            scene.send(junk)
        time.sleep(0.3)
        driver.post("drives", strategy="no-align")
        with live(driver) as socket:
            # Where earlier drives have left the arm at an edge, one of the two moves it.
            steer(socket, 0.0, -0.5, 0.5)
            steer(socket, 0.0, 0.5, 0.5)
        assert scene.recv(timeout=PATIENCE_S)
    assert "Traceback" not in server.log()


@pytest.mark.parametrize("kills", [5, pytest.param(20, marks=pytest.mark.soak)])
def test_no_acknowledged_answer_is_lost_or_doubled_by_kills(kills: int, tmp_path: Path) -> None:
    data_dir = tmp_path / "data"
    server = RunningServer(data_dir)
    port, link = server.port, server.participant_link
    participant = Participant(link)
    queries = [query["id"] for query in participant.begin()["queries"]]
    acknowledged: dict[str, tuple[str, list[float]]] = {}
    sent = itertools.count()
    try:
        for kill in range(kills):
            # Answers pass in a row, the last of them cut off by the kill, at another moment each.
            for query_id in queries[kill % 3 : kill % 3 + 3]:
                n = next(sent)
                h = [round(np.cos(n) * 0.9, 6), round(np.sin(n) * 0.9, 6)]
                answer_id = str(uuid.uuid4())
                participant.answer(query_id, h, id=answer_id).raise_for_status()
                acknowledged[answer_id] = (query_id, h)
            cut_off = str(uuid.uuid4())
            with contextlib.suppress(Exception):
                participant.http.timeout = (0.0005 * (kill + 1)) or None
                participant.answer(queries[6], [0.0, 0.0], id=cut_off) if kill % 2 else None
            server.kill()
            participant.http.close()
            server = RunningServer(data_dir, port=port)
            participant = Participant(link)
            session = participant.session()
            assert session["step"] in ("queries", "training")
            if session["step"] == "training":
                break
            for answer_id, (query_id, h) in list(acknowledged.items())[-3:]:
                again = participant.answer(query_id, h, id=answer_id)
                assert again.status_code == 200, again.text
        kept = {row.id: row for row in rows(data_dir, AnswerRow)}
    finally:
        server.stop()
    assert kill == kills - 1
    for answer_id, (query_id, h) in acknowledged.items():
        assert (kept[answer_id].query_id, [kept[answer_id].h_x, kept[answer_id].h_y]) == (
            query_id,
            h,
        )
    assert len(kept) - len(acknowledged) <= kills // 2  # committed but cut off before the reply
    assert len({row.sequence for row in kept.values()}) == len(kept)


def test_a_page_that_was_away_before_a_drive_is_waited_for(tmp_path: Path) -> None:
    with running_server(tmp_path, training_steps=20, drive_waits_s=1.5) as server:
        participant = Participant(server.participant_link)
        with live(participant):
            answer_all(participant)
        participant.wait_for_training()
        participant.post("driving").raise_for_status()
        time.sleep(3.0)  # nobody looks, for longer than a page is waited for
        participant.post("drives", strategy="no-align").raise_for_status()
        time.sleep(1.2)  # whoever is away is looked for once a second
        with live(participant) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["drive_id"] is not None
            steer(page, 0.0, 0.5, 0.3)
        (drive,) = rows(tmp_path, DriveRow)
        assert drive.end is None


def wait_for_state(data_dir: Path, state: str, limit_s: float = PATIENCE_S) -> Any:
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        (job,) = rows(data_dir, JobRow)
        if job.state == state:
            return job
        time.sleep(0.01)
    raise AssertionError(f"the job is {job.state}, not {state}")


def test_a_training_survives_its_killed_worker_and_ends_once(tmp_path: Path) -> None:
    with running_server(tmp_path / "data", training_steps=8_000) as server:
        participant = Participant(server.participant_link)
        answer_all(participant)
        wait_for_state(tmp_path / "data", "running")
        time.sleep(0.3)
        for pid in server.children():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        status = participant.wait_for_training(120)
        assert status["state"] == "succeeded"
        assert status["attempt"] == 2
    alignments = rows(tmp_path / "data", AlignmentRow)
    assert sorted(row.strategy for row in alignments) == ["all-priors", "no-priors", "task-space"]
    assert len(list((tmp_path / "data" / "alignments").glob("*.safetensors"))) == 3


def test_a_training_survives_a_killed_server_and_ends_once(tmp_path: Path) -> None:
    data_dir = tmp_path / "data"
    # Three trainings of a minute: no worker would be gone in 20 s for having ended its work.
    server = RunningServer(data_dir, training_steps=60_000)
    participant = Participant(server.participant_link)
    answer_all(participant)
    wait_for_state(data_dir, "running")
    children = server.children()
    assert children
    server.kill()
    deadline = time.monotonic() + 20
    while any(map(is_running, children)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(is_running, children))  # workers die with it
    assert participant_cannot_drive_yet(data_dir)
    with running_server(data_dir, port=server.port, training_steps=20):
        again = Participant(participant.link)
        assert again.wait_for_training()["state"] == "succeeded"
        (job,) = rows(data_dir, JobRow)
        assert job.attempt == 2
        assert len(rows(data_dir, AlignmentRow)) == 3


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def participant_cannot_drive_yet(data_dir: Path) -> bool:
    """No alignment is registered, whatever files a worker had begun."""
    return rows(data_dir, AlignmentRow) == []


def test_a_drive_cut_off_by_a_kill_keeps_its_samples_and_is_marked(tmp_path: Path) -> None:
    data_dir = tmp_path / "data"
    server = RunningServer(data_dir)
    participant = Participant(server.participant_link)
    answer_all(participant)
    participant.wait_for_training()
    participant.post("driving")
    participant.post("drives", strategy="all-priors")
    with live(participant) as socket:
        steer(socket, 0.9, 0.0, 2.0)
        at = now(socket)["hand"]
        server.kill()
    kept = sum(chunk.ticks for chunk in rows(data_dir, SampleChunkRow))
    assert kept >= 60  # of about 120: all but the last chunk or so
    with running_server(data_dir, port=server.port):
        (drive,) = rows(data_dir, DriveRow)
        assert drive.end == "server stopped"
        again = Participant(participant.link)
        assert again.session()["step"] == "driving"
        with live(again) as socket:
            # The arm stands where the samples left it, not where it began.
            stands = hear(socket, "status")["hand"]
            assert np.linalg.norm(np.subtract(stands, at)) < 0.13
            assert np.linalg.norm(np.subtract(stands, [0.5, 0.0, 0.25])) > 0.02
