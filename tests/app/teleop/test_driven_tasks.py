"""The user study's tasks under a false clock: who steers by a learned alignment gets them done."""

from functools import cache

import numpy as np
import pytest

from app import texts
from app.bots.eyes import Sight, presses
from app.schemas.props import PropsOut
from app.storage.ticks import COLUMNS, HOLDS
from app.teleop.live_session import LiveSession
from app.teleop.recorder import DriveLog
from models.checkpoints import load_controller
from models.fitting import Labels
from models.kinematics import Kinematics
from models.mapping import Mapping
from models.panda import Q_MAX, Q_MIN
from models.panda_pack import PandaPack
from models.preferences import parse_preference
from models.queries import sample_pool
from models.simulated_human import SimulatedHuman, sensitivity
from models.simulation import Simulation
from models.task_space import fit_task_space, survey
from models.tasks import get_task
from models.tasks.avoid import AvoidPhase
from tests.app.teleop.test_live_session import NEWER, PAGE, FakeRecorder, FakeScene
from tests.drivers import stick

DT_S = 1 / 60
TASKS = ("avoid", "pour-cup", "fetch-and-pour")


class Lab:
    """A task, somebody who steers, and what was learned of them from exact answers."""

    def __init__(self, task: str, pack: PandaPack) -> None:
        self.task, self.controller = get_task(task), load_controller(task)
        self.kinematics = Kinematics.from_urdf(pack.urdf)
        pool = sample_pool(
            self.task, self.controller, self.kinematics, 400, np.random.default_rng(9)
        )
        preference = parse_preference("mirrored+rotated:70", np.random.default_rng(9))
        kappa = sensitivity(self.task, self.kinematics, pool)
        self.person = SimulatedHuman(self.task, preference, kappa)
        before, after = (self.kinematics.hand_pose(q) for q in (pool.states, pool.next_states))
        h = self.person.answer(self.task.dof_change(before, after), before)
        rows = np.flatnonzero(np.linalg.norm(h, axis=-1) <= 1.0)[:30]
        labels = Labels(pool.states[rows], h[rows], pool.next_states[rows])
        seen = survey(self.task, self.kinematics, pool)
        alignment = fit_task_space(self.controller, self.kinematics, self.task, labels, seen)
        self.learned = Mapping(self.controller, alignment)
        # What was learned of somebody who means the opposite.
        opposite = fit_task_space(
            self.controller,
            self.kinematics,
            self.task,
            Labels(labels.states, -labels.human_inputs, labels.next_states),
            seen,
        )
        self.opposite = Mapping(self.controller, opposite)


@cache
def lab_of(task: str, pack: PandaPack) -> Lab:
    return Lab(task, pack)


class Drive:
    """A session in which an attempt has begun."""

    def __init__(
        self, lab: Lab, pack: PandaPack, mapping: Mapping, seed: int = 0, **settings: object
    ) -> None:
        self.lab, self.scene, self.recorder, self.now_s = lab, FakeScene(), FakeRecorder(), 50.0
        self.session = LiveSession(
            "p",
            Simulation(pack, lab.task.props),
            self.scene,  # type: ignore[arg-type]
            lab.task,
            silence_s=0.25,
            start=lab.task.home_q,
            **settings,  # type: ignore[arg-type]
        )
        self.session.take_stick(PAGE)
        simulation = self.session.prepare()
        self.attempt = lab.task.begin(simulation, lab.kinematics, np.random.default_rng(seed))
        log = DriveLog(self.recorder, "d", 0, 0.5)  # type: ignore[arg-type]
        self.session.start_drive("task-space", mapping, log, self.attempt)
        self.props = PropsOut.model_validate(lab.task.props).model_dump(mode="json")

    @property
    def progress(self):
        return self.session.status(PAGE, self.now_s).progress

    def tick(self, h: np.ndarray) -> None:
        self.now_s += DT_S
        self.session.move_stick(PAGE, float(h[0]), float(h[1]), self.now_s)
        self.session.tick(self.now_s, DT_S)

    def steer(self, limit_s: float) -> None:
        """Let the person steer until it is over."""
        for _ in range(round(limit_s / DT_S)):
            if self.progress.end is not None:
                return
            self.follow()

    def follow(self) -> None:
        """Let the person steer for a tick by what a page is told."""
        status = self.session.status(PAGE, self.now_s).model_dump(mode="json")
        sight = Sight.of_status(status, self.props)
        if presses(sight):
            self.session.press(PAGE)
        self.tick(stick(self.lab.person, sight))


@pytest.mark.parametrize("task", TASKS)
def test_who_is_understood_gets_the_task_done(task: str, pack: PandaPack) -> None:
    drive = Drive(lab_of(task, pack), pack, lab_of(task, pack).learned, seed=11)
    drive.steer(40.0)
    assert drive.progress.end == "done"
    assert drive.progress.is_success
    assert drive.recorder.ends == [("d", "done")]
    (outcome,) = drive.recorder.outcomes
    assert outcome["is_success"]
    assert outcome["elapsed_s"] == pytest.approx(len(drive.recorder.rows()) * DT_S, abs=1e-4)
    if task == "avoid":
        assert outcome["counts"] == {"degrees": 720, "touches": 0}
    else:
        assert outcome["counts"].pop("spilt") <= 2
        assert min(outcome["counts"].values()) >= 14


def test_a_page_is_told_the_phase_and_the_same_in_words(pack: PandaPack) -> None:
    drive = Drive(lab_of("avoid", pack), pack, lab_of("avoid", pack).learned)
    assert drive.progress.title == "Go round"
    assert drive.progress.phase == AvoidPhase.CLOCKWISE
    assert drive.progress.says == "Go once round the post, clockwise."
    drive.attempt._turned_deg[0] = 360.0  # type: ignore[attr-defined]
    drive.tick(np.zeros(2))
    assert drive.progress.phase == AvoidPhase.COUNTER_CLOCKWISE
    assert drive.progress.says == "Now once round counter-clockwise."


@pytest.mark.parametrize("task", TASKS)
def test_who_cannot_read_gets_the_task_done_too(
    task: str, pack: PandaPack, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = texts.TASKS[task]
    gibberish = texts.TaskTexts("Xyzzy", dict.fromkeys(words.phases, "Xyzzy."), "Xyzzy")
    monkeypatch.setattr(texts, "TASKS", {task: gibberish})
    drive = Drive(lab_of(task, pack), pack, lab_of(task, pack).learned, seed=11)
    drive.steer(40.0)
    assert drive.progress.says == "Xyzzy."
    assert drive.progress.is_success


@pytest.mark.parametrize("task", TASKS)
def test_who_is_not_understood_does_not(task: str, pack: PandaPack) -> None:
    drive = Drive(lab_of(task, pack), pack, lab_of(task, pack).opposite, seed=11)
    drive.steer(10.0)
    assert drive.progress.fraction < 0.2
    assert not drive.progress.is_success


@pytest.mark.parametrize("task", TASKS)
def test_every_tick_says_where_the_props_were(task: str, pack: PandaPack) -> None:
    drive = Drive(lab_of(task, pack), pack, lab_of(task, pack).learned)
    for _ in range(60):
        drive.tick(np.zeros(2))
    drive.session.stop_drive("left")
    props = np.array(drive.recorder.props)
    assert props.shape == (60, 0 if task == "avoid" else 7 + 3 * 20)


def test_the_hand_takes_the_cup_by_itself_once_it_is_told_to(pack: PandaPack) -> None:
    drive = Drive(lab_of("fetch-and-pour", pack), pack, lab_of("fetch-and-pour", pack).learned)
    assert "nothing to grasp here" in (drive.session.press(PAGE) or "")
    for _ in range(round(15 / DT_S)):
        drive.follow()
        if drive.attempt.simulation.is_holding:
            break
    assert drive.session.press(PAGE) == "The cup is in the hand already."
    drive.session.stop_drive("left")
    holds = drive.recorder.column("hold")
    assert np.any(holds == 1 + HOLDS.index("by-itself"))
    height = drive.recorder.rows()[:, COLUMNS.index("hand_z")]
    assert height.min() < 0.09


def test_with_auto_grasp_nobody_has_to_press(pack: PandaPack) -> None:
    lab = lab_of("fetch-and-pour", pack)
    drive = Drive(lab, pack, lab.learned, auto_grasp=True)
    way = lambda: drive.attempt.over - drive.attempt.simulation.hand.position[:2]  # type: ignore[attr-defined]  # noqa: E731
    for _ in range(round(15 / DT_S)):
        wish = 0.1 * np.clip(3.0 * way(), -0.15, 0.15)
        drive.tick(np.clip(lab.person.answer(wish), -1.0, 1.0))
        if drive.attempt.simulation.is_holding:
            return
    raise AssertionError("The hand never took the cup.")


def test_there_is_a_time_limit_where_one_is_set(pack: PandaPack) -> None:
    lab = lab_of("avoid", pack)
    drive = Drive(lab, pack, lab.learned, limit_s=1.0)
    for _ in range(90):
        drive.tick(np.zeros(2))
    assert (drive.progress.end, drive.progress.is_success) == ("time limit", False)
    assert drive.recorder.ends == [("d", "time limit")]
    assert len(drive.recorder.rows()) == 60
    assert drive.session.status(PAGE, drive.now_s).hold == "over"


def test_giving_up_ends_the_drive_and_is_for_whoever_holds_the_stick(pack: PandaPack) -> None:
    lab = lab_of("avoid", pack)
    drive = Drive(lab, pack, lab.learned)
    drive.tick(np.zeros(2))
    drive.session.give_up(NEWER)
    assert drive.progress.end is None
    drive.session.give_up(PAGE)
    assert drive.progress.end == "given up"
    drive.session.give_up(PAGE)
    assert drive.recorder.ends == [("d", "given up")]
    assert "no drive is going on" in (drive.session.press(PAGE) or "")


def test_there_is_nothing_to_grasp_where_there_is_nothing(pack: PandaPack) -> None:
    lab = lab_of("avoid", pack)
    drive = Drive(lab, pack, lab.learned)
    assert drive.session.press(PAGE) == "There is nothing to grasp in this task."
    assert drive.session.press(NEWER) == "You are steering in another tab."


@pytest.mark.parametrize("task", TASKS)
def test_a_random_stick_breaks_nothing(task: str, pack: PandaPack) -> None:
    lab = lab_of(task, pack)
    drive, rng = Drive(lab, pack, lab.learned), np.random.default_rng(4)
    for _ in range(5):
        h = rng.normal(size=2)
        for _ in range(60):
            drive.tick(h / np.linalg.norm(h))
    drive.session.stop_drive("left")
    rows = drive.recorder.rows()
    q = rows[:, COLUMNS.index("q_1") : COLUMNS.index("q_7") + 1]
    assert np.isfinite(rows).all()
    assert np.all((q > Q_MIN - 0.01) & (q < Q_MAX + 0.01))
    assert rows[:, COLUMNS.index("hand_z")].min() > 0.05
