"""The picture: it shows the arm where it is, to whoever looks, however late they come."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Any

import msgspec
import mujoco
import numpy as np
import pytest
import zstandard
from scipy.spatial.transform import Rotation

from app.scene.arm_scene import ArmScene
from app.scene.cameras import CAMERAS, camera_of
from app.scene.page import scene_page
from app.scene.robot_view import RobotView, _links
from app.scene.server import SceneServer
from models.panda import LINK_NAMES, Q_HOME, Q_MAX, Q_MIN
from models.panda_pack import PandaPack
from models.tasks import TASKS, get_task
from models.world import compiled


class FakePage:
    """A page that looks until it is told to leave."""

    def __init__(self) -> None:
        self.received: list[bytes] = []
        self.leaving = asyncio.Event()
        self.may_read = asyncio.Event()
        self.may_read.set()

    async def send_bytes(self, data: bytes) -> None:
        await self.may_read.wait()
        self.received.append(data)

    async def receive(self) -> dict[str, Any]:
        await self.leaving.wait()
        return {"type": "websocket.disconnect"}


def run(scenario: Callable[[], Awaitable[None]]) -> None:
    asyncio.run(scenario())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("task", "position"), [("avoid", (-0.32, -0.70, 1.60)), ("pour-cup", (0.12, 1.05, 0.85))]
)
def test_a_task_is_looked_at_from_where_it_is_seen_well(
    task: str, position: tuple[float, ...], pack: PandaPack
) -> None:
    async def scenario() -> None:
        camera = ArmScene(pack, get_task(task))._server.viser.initial_camera
        assert tuple(camera.position) == position
        assert tuple(camera.look_at) == camera_of(task).look_at

    run(scenario)


def test_cameras_are_of_tasks() -> None:
    assert set(CAMERAS) <= set(TASKS)


def test_the_picture_of_the_arm_is_where_the_physics_has_it(
    pack: PandaPack, rng: np.random.Generator
) -> None:
    async def scenario() -> None:
        server = SceneServer()
        view = RobotView(server.viser.scene, server.poses, pack)
        mj_model = compiled(pack)
        mj_data = mujoco.MjData(mj_model)
        place = {link.name: link for link in _links(pack)}
        for q in rng.uniform(Q_MIN, Q_MAX, (30, 7)):
            view.update(q)
            server.flush()
            mj_data.qpos[:7] = q
            mujoco.mj_kinematics(mj_model, mj_data)
            at, turned = np.zeros(3), Rotation.identity()
            for name, joint in zip(LINK_NAMES[1:8], view._joints, strict=True):
                at = at + turned.apply(place[name].position)
                wxyz = server.poses.newest["SetOrientationMessage", joint.handle.name]
                turned = turned * Rotation.from_quat(wxyz, scalar_first=True)
            body = mj_model.body("panda_link7").id
            assert at == pytest.approx(mj_data.xpos[body], abs=1e-4)
            found = Rotation.from_quat(mj_data.xquat[body], scalar_first=True)
            assert (found.inv() * turned).magnitude() < 1e-3
        server.close()

    run(scenario)


def test_whoever_comes_late_sees_the_arm_as_it_is_now(pack: PandaPack) -> None:
    async def scenario() -> None:
        scene = ArmScene(pack, get_task("plane"))
        first, late = FakePage(), FakePage()
        looking = [asyncio.create_task(scene.serve(first))]
        await asyncio.sleep(0.2)
        whole = sum(map(len, first.received))
        assert whole > 300_000  # the meshes
        count = len(first.received)
        scene.show_arm(Q_HOME + 0.1, np.zeros(3))
        await asyncio.sleep(0.1)
        assert len(first.received) > count
        assert scene.viewers == 1
        looking.append(asyncio.create_task(scene.serve(late)))
        await asyncio.sleep(0.2)
        assert sum(map(len, late.received)) > 0.9 * whole
        assert scene.viewers == 2
        first.leaving.set()
        late.leaving.set()
        await asyncio.gather(*looking)
        assert scene.viewers == 0
        scene.close()

    run(scenario)


def test_a_pose_is_sent_without_waiting_for_visers_window(pack: PandaPack) -> None:
    async def scenario() -> None:
        scene, page = ArmScene(pack, get_task("plane")), FakePage()
        looking = asyncio.create_task(scene.serve(page))
        await asyncio.sleep(0.3)
        for step in range(5):
            count = len(page.received)
            scene.show_arm(Q_HOME + 0.01 * (step + 1), np.zeros(3))
            for _ in range(5):  # turns of the event loop, and no time to speak of
                await asyncio.sleep(0)
            await asyncio.sleep(0.002)
            assert len(page.received) > count
            await asyncio.sleep(0.05)
        page.leaving.set()
        await looking
        scene.close()

    run(scenario)


def test_a_pose_is_on_the_wire_as_viser_would_write_it(pack: PandaPack) -> None:
    async def scenario() -> None:
        server = SceneServer()
        frame = server.viser.scene.add_frame("/frame")
        beads = server.viser.scene.add_batched_meshes_simple(
            "/beads",
            vertices=np.eye(3, dtype=np.float32),
            faces=np.array([[0, 1, 2]], dtype=np.uint32),
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (5, 1)),
            batched_positions=np.zeros((5, 3)),
        )
        page = FakePage()
        looking = asyncio.create_task(server.serve(page))
        await asyncio.sleep(0.2)
        page.received.clear()
        frame.position = (0.1, 0.2, 0.3)
        frame.wxyz = (0.0, 1.0, 0.0, 0.0)
        beads.batched_positions = np.arange(15, dtype=np.float32).reshape(5, 3)
        server.viser.flush()
        await asyncio.sleep(0.2)
        (theirs,) = page.received
        page.received.clear()
        server.poses.put(frame, np.array([0.1, 0.2, 0.3]))
        server.poses.turn(frame, np.array([0.0, 1.0, 0.0, 0.0]))
        server.poses.scatter(beads, np.arange(15.0).reshape(5, 3))
        server.flush()
        await asyncio.sleep(0.1)
        (ours,) = page.received
        assert _read(ours) == _read(theirs)
        page.leaving.set()
        await looking
        server.close()

    run(scenario)


def _read(data: bytes) -> tuple[list[Any], bytes]:
    """What a message on viser's wire says, without its time, and its arrays."""
    packed_end = 16 + int.from_bytes(data[8:16], "little")
    inner = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16:packed_end]))
    lengths = inner["binaryBufferLengths"]
    arrays = data[-(-packed_end // 8) * 8 :] if lengths else b""
    assert len(arrays) == sum(lengths)
    return sorted(inner["messages"], key=lambda each: str(each["type"])), arrays


def test_who_reads_slowly_hears_of_the_newest_place_only(pack: PandaPack) -> None:
    async def scenario() -> None:
        scene, page = ArmScene(pack, get_task("plane")), FakePage()
        looking = asyncio.create_task(scene.serve(page))
        await asyncio.sleep(0.3)
        page.may_read.clear()
        before = len(page.received)
        for step in range(50):
            scene.show_arm(Q_HOME + 0.01 * (step + 1), np.array([step, 0.0, 0.0]))
            await asyncio.sleep(0)
        page.may_read.set()
        await asyncio.sleep(0.1)
        assert len(page.received) - before == 2  # the one it was reading, and the newest
        messages, _ = _read(page.received[-1])
        assert [49.0, 0.0, 0.0] in [message.get("position") for message in messages]
        page.leaving.set()
        await looking
        scene.close()

    run(scenario)


def test_a_scene_opens_no_port_and_starts_no_thread(pack: PandaPack) -> None:
    async def scenario() -> None:
        before = threading.active_count()
        scenes = [ArmScene(pack, get_task("plane")) for _ in range(5)]
        assert threading.active_count() == before
        for scene in scenes:
            scene.close()

    run(scenario)


def test_the_page_keeps_nothing_but_the_canvas_and_gives_keys_away() -> None:
    page = scene_page()
    added = page[page.index("#root :not(canvas)") : page.index("</head>")]
    assert "display: none !important" in added
    assert "stopImmediatePropagation" in added
    assert "document.hasFocus = () => true" in added
