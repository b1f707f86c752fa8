"""A drive that was made through a running server, measured and replayed from its record."""

import contextlib
import json
import time
import uuid
from collections.abc import Generator
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from app.storage.tables import DriveRow, QueryRow, SampleChunkRow
from app.storage.ticks import COLUMNS, unpack
from tests.patience import PATIENCE_S
from tests.running_server import Participant, RunningServer, running_server

VISER = Subprotocol("viser-v1.1.1")

TICKS = 90  # at least, of the drive


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Generator[RunningServer]:
    with running_server(
        tmp_path_factory.mktemp("data"), task="pour-cup", training_steps=20
    ) as server:
        yield server


@pytest.fixture(scope="module")
def rows(server: RunningServer) -> np.ndarray:
    """Two seconds of driving, and then giving up."""
    participant = Participant(server.participant_link)
    for query in participant.begin()["queries"]:
        participant.answer(query["id"], [0.3, 0.4]).raise_for_status()
    participant.wait_for_training()
    participant.post("driving").raise_for_status()
    participant.post("drives", strategy="no-align").raise_for_status()
    address = participant.link.replace("http", "ws", 1)
    with connect(f"{address}/live?tab=t") as socket:
        for seq in range(60):
            stick = {"type": "stick", "seq": seq, "x": 0.4, "y": 0.6 if seq < 30 else -0.6}
            socket.send(json.dumps(stick))
            time.sleep(1 / 30)
        socket.send('{"type": "give-up"}')
        time.sleep(1.0)
    rows = np.concatenate([unpack(chunk.samples) for chunk in server.rows(SampleChunkRow)])
    assert len(rows) > TICKS
    return rows


@pytest.fixture(scope="module")
def experimenter(server: RunningServer) -> httpx.Client:
    return server.experimenter()


@pytest.fixture
def drive_id(server: RunningServer, rows: np.ndarray) -> str:
    assert len(rows)
    return str(server.rows(DriveRow)[0].id)


def open_socket(experimenter: httpx.Client, path: str, **options: Any) -> ClientConnection:
    address = str(experimenter.base_url).replace("http", "ws", 1).rstrip("/")
    cookies = "; ".join(f"{name}={value}" for name, value in experimenter.cookies.items())
    return connect(f"{address}/{path}", additional_headers={"Cookie": cookies}, **options)


def hear(socket: Connection, **wanted: Any) -> dict[str, Any]:
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        message: dict[str, Any] = json.loads(socket.recv(timeout=PATIENCE_S))
        if all(message.get(name) == value for name, value in wanted.items()):
            return message
    raise AssertionError(f"nothing of {wanted} was heard")


def test_the_measures_are_those_of_the_record(
    experimenter: httpx.Client, server: RunningServer, rows: np.ndarray, drive_id: str
) -> None:
    participant_id = server.rows(DriveRow)[0].participant_id
    listed = experimenter.get(f"/api/v1/participants/{participant_id}/drives").json()
    assert listed["label"] == "P-1"
    (line,) = listed["drives"]
    assert (line["id"], line["end"], line["ticks"]) == (drive_id, "given up", len(rows))
    measures = line["measures"]
    hand = rows[:, COLUMNS.index("hand_x") : COLUMNS.index("hand_z") + 1]
    way = np.linalg.norm(np.diff(hand, axis=0), axis=1).sum()
    assert measures["path_length_m"] == pytest.approx(way)
    assert measures["completion_time_s"] == pytest.approx(rows[-1, 0] - rows[0, 0], abs=0.05)
    assert (measures["spills"], measures["touches"]) == (measures["counts"]["spilt"], None)
    found = experimenter.get(f"/api/v1/drives/{drive_id}").json()
    assert found["measures"] == measures
    assert np.allclose(found["path"][0], hand[0], atol=1e-4)
    assert np.sum(found["stick_map"]) == pytest.approx(1.0, abs=0.01)


def test_every_tick_can_be_seen_again(
    experimenter: httpx.Client, rows: np.ndarray, drive_id: str
) -> None:
    path = f"drives/{drive_id}/{uuid.uuid4()}"
    with (
        open_socket(experimenter, f"{path}/scene", subprotocols=[VISER], max_size=None) as scene,
        open_socket(experimenter, f"{path}/control") as socket,
    ):
        assert len(scene.recv(timeout=PATIENCE_S)) > 1000
        first = hear(socket, tick=0)
        assert (first["ticks"], first["is_playing"]) == (len(rows), False)
        for tick in (1, 40, len(rows) - 1):
            socket.send(json.dumps({"type": "seek", "tick": tick}))
            shown = hear(socket, tick=tick)
            hand = rows[tick, COLUMNS.index("hand_x") : COLUMNS.index("hand_z") + 1]
            assert np.allclose(shown["hand"], hand, atol=1e-4)
            assert shown["time_s"] == pytest.approx(rows[tick, 0] - rows[0, 0], abs=1e-3)
            assert scene.recv(timeout=PATIENCE_S)
        socket.send('{"type": "speed", "speed": 4.0}')
        socket.send('{"type": "play"}')
        hear(socket, is_playing=True)
        end = hear(socket, is_playing=False, tick=len(rows) - 1)
        assert end["speed"] == 4.0


@pytest.mark.parametrize(
    "message", ["", "{", '{"type": "fly"}', '{"type": "seek", "tick": -1}', '{"type": "speed"}']
)
def test_a_message_that_makes_no_sense_gets_a_sentence(
    experimenter: httpx.Client, drive_id: str, message: str
) -> None:
    with open_socket(experimenter, f"drives/{drive_id}/v/control") as socket:
        hear(socket, tick=0)
        socket.send(message)
        assert hear(socket, type="error")["sentence"] == "This message was not understood."


@pytest.mark.parametrize(
    "path",
    ["api/v1/drives/none", "api/v1/participants/none/drives", "drives/none", "participants/none"],
)
def test_what_there_is_not_is_not_found(experimenter: httpx.Client, path: str) -> None:
    response = experimenter.get(f"/{path}")
    assert response.status_code == 404
    assert "There is no such" in response.text


def test_records_are_closed_to_others(server: RunningServer, drive_id: str) -> None:
    participant_id = server.rows(DriveRow)[0].participant_id
    for path in (
        f"api/v1/participants/{participant_id}/drives",
        f"api/v1/drives/{drive_id}",
        f"participants/{participant_id}",
        f"drives/{drive_id}",
        f"drives/{drive_id}/v/scene/",
    ):
        assert httpx.get(f"{server.base_url}/{path}").status_code == 401
    address = server.base_url.replace("http", "ws", 1)
    for end in ("control", "scene"):
        with pytest.raises(InvalidStatus, match="401"):
            connect(f"{address}/drives/{drive_id}/v/{end}", subprotocols=[VISER])


def test_only_so_many_are_replayed_at_once(experimenter: httpx.Client, drive_id: str) -> None:
    with contextlib.ExitStack() as open_ones:
        for view in range(8):
            open_ones.enter_context(open_socket(experimenter, f"drives/{drive_id}/{view}/control"))
        with pytest.raises(InvalidStatus, match="503"):
            open_socket(experimenter, f"drives/{drive_id}/one-more/control")
    time.sleep(0.3)
    with open_socket(experimenter, f"drives/{drive_id}/again/control") as socket:
        hear(socket, tick=0)


def test_the_move_of_an_answer_is_played_with_the_stick_that_was_given(
    server: RunningServer, rows: np.ndarray, experimenter: httpx.Client
) -> None:
    assert len(rows)
    query = next(row for row in server.rows(QueryRow) if row.position == 1)
    facts = experimenter.get(f"/api/v1/moves/{query.id}").raise_for_status().json()
    assert facts["h"] == [0.3, 0.4]
    assert facts["path"] == query.hand_path
    assert experimenter.get(f"/moves/{query.id}").status_code == 200
    with open_socket(experimenter, f"moves/{query.id}/view/control") as socket:
        first = hear(socket, tick=0)
        assert first["ticks"] == 61  # ten steps of 0.1 s, sixty ticks a second
        assert first["stick"] == [0.3, 0.4]
        assert first["hand"] == pytest.approx(query.hand_path[0], abs=1e-4)
        socket.send('{"type": "play"}')
        last = hear(socket, tick=60, is_playing=False)
        assert last["hand"] == pytest.approx(query.hand_path[-1], abs=1e-4)


def test_a_move_of_nobody_is_refused(experimenter: httpx.Client) -> None:
    for path in ("/api/v1/moves/none", "/moves/none"):
        assert experimenter.get(path).status_code == 404
    with pytest.raises(InvalidStatus), open_socket(experimenter, "moves/none/view/control"):
        pass
