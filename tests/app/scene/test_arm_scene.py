"""The picture: it shows the arm where it is, to whoever looks, however late they come."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.scene.arm_scene import ArmScene
from app.scene.page import scene_page
from app.scene.robot_view import RobotView, _links
from app.scene.server import SceneServer
from models.panda import LINK_NAMES, Q_HOME, Q_MAX, Q_MIN
from models.panda_pack import PandaPack
from models.tasks import get_task
from models.world import compiled


class FakePage:
    """A page that looks until it is told to leave."""

    def __init__(self) -> None:
        self.received: list[bytes] = []
        self.leaving = asyncio.Event()

    async def send_bytes(self, data: bytes) -> None:
        self.received.append(data)

    async def receive(self) -> dict[str, Any]:
        await self.leaving.wait()
        return {"type": "websocket.disconnect"}


def run(scenario: Callable[[], Awaitable[None]]) -> None:
    asyncio.run(scenario())  # type: ignore[arg-type]


def test_the_picture_of_the_arm_is_where_the_physics_has_it(
    pack: PandaPack, rng: np.random.Generator
) -> None:
    async def scenario() -> None:
        server = SceneServer()
        view = RobotView(server.viser.scene, pack)
        mj_model = compiled(pack)
        mj_data = mujoco.MjData(mj_model)
        place = {link.name: link for link in _links(pack)}
        for q in rng.uniform(Q_MIN, Q_MAX, (30, 7)):
            view.update(q)
            mj_data.qpos[:7] = q
            mujoco.mj_kinematics(mj_model, mj_data)
            at, turned = np.zeros(3), Rotation.identity()
            for name, joint in zip(LINK_NAMES[1:8], view._joints, strict=True):
                at = at + turned.apply(place[name].position)
                turned = turned * Rotation.from_quat(joint.handle.wxyz, scalar_first=True)
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
