"""No tick asks more of a joint than the arm can do, whatever the stick, the task and the state."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from app.storage.ticks import COLUMNS
from app.teleop.edges import keep_inside
from app.teleop.live_session import LiveSession
from app.teleop.recorder import DriveLog
from models.checkpoints import load_controller
from models.controller import AutoencoderController, LatentController
from models.kinematics import Kinematics
from models.panda import Q_MAX, Q_MIN, QD_MAX
from models.panda_pack import PandaPack
from models.simulation import Simulation
from models.tasks import TASKS, Task, get_task
from tests.app.teleop.test_live_session import PAGE, FakeRecorder, FakeScene
from tests.drivers import unaligned

DT_S = 1 / 60
ASKED = [COLUMNS.index(f"a_{joint}") for joint in range(1, 8)]


def hasty(task: Task) -> LatentController:
    """The task's controller, five times too fast: those we ship keep well within the limits."""
    controller = load_controller(task.name)
    assert isinstance(controller, AutoencoderController)
    return replace(controller, a_scale=5.0 * controller.a_scale)


def states(task: Task, pack: PandaPack, n: int) -> np.ndarray:
    """Joint positions on the task and up to half a radian beside it, ``(2 n, 7)`` in [rad]."""
    rng = np.random.default_rng(31)
    demonstrations = task.demonstrations(Kinematics.from_urdf(pack.urdf), rng, n, 20)
    on = demonstrations.states[:, rng.integers(20)]
    beside = on + rng.uniform(-0.5, 0.5, on.shape)
    inside: np.ndarray = np.clip(np.concatenate([on, beside]), Q_MIN + 0.02, Q_MAX - 0.02)
    return inside


@pytest.mark.parametrize("task_name", TASKS)
def test_joints_are_asked_for_no_more_than_they_can_do(task_name: str, pack: PandaPack) -> None:
    task, rng = get_task(task_name), np.random.default_rng(32)
    controller, simulation = hasty(task), Simulation(pack, task.props)
    loads, slowed = [], 0
    for s in states(task, pack, 30):
        simulation.reset(s)
        z = rng.uniform(-1.5, 1.5, 2)
        _, a, is_at_edge = keep_inside(task, simulation, controller, z, DT_S)
        loads.append(np.max(np.abs(a) / QD_MAX))
        asked = controller.decode(z, simulation.q)
        excess = np.max(np.abs(asked) / QD_MAX)
        if not is_at_edge:
            assert_allclose(a, asked / max(1.0, excess))  # slower, in the same direction
            slowed += excess > 1.0
    assert max(loads) == pytest.approx(1.0)
    assert slowed > 10


@pytest.mark.parametrize("task_name", TASKS)
def test_every_tick_of_a_drive_keeps_to_the_speed_of_the_joints(
    task_name: str, pack: PandaPack
) -> None:
    task, rng = get_task(task_name), np.random.default_rng(33)
    simulation, recorder = Simulation(pack, task.props), FakeRecorder()
    mapping, now_s = unaligned(hasty(task)), 100.0
    for drive, s in enumerate(states(task, pack, 3)):
        session = LiveSession(
            "p",
            simulation,
            FakeScene(),  # type: ignore[arg-type]
            task,
            silence_s=0.25,
            start=s,
        )
        session.take_stick(PAGE)
        log = DriveLog(recorder, str(drive), 0, 0.5)  # type: ignore[arg-type]
        session.start_drive("no-align", mapping, log)
        for tick in range(40):
            if tick % 8 == 0:
                x, y = rng.uniform(-1.0, 1.0, 2)
            now_s += DT_S
            session.move_stick(PAGE, x, y, now_s)
            session.tick(now_s, DT_S)
        session.stop_drive("left")
    asked = np.abs(recorder.rows()[:, ASKED]) / QD_MAX
    assert asked.max() == pytest.approx(1.0)
