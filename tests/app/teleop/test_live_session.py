"""The arm under a false clock: what moves it, and what lets it hold."""

import itertools
from typing import Any

import numpy as np
import pytest

from app.storage.ticks import COLUMNS
from app.teleop.live_session import LiveSession
from app.teleop.recorder import DriveLog
from app.teleop.stick_lease import Connection
from models.checkpoints import load_controller
from models.panda import Q_MAX, Q_MIN
from models.panda_pack import PandaPack
from models.simulation import HandState, Simulation
from models.tasks import get_task
from tests.drivers import unaligned

PAGE, NEWER = Connection("tab"), Connection("newer")

DT_S = 1 / 60
TASK = get_task("plane")


class FakeScene:
    """Counts what it is told to show."""

    viewers = 0

    def __init__(self) -> None:
        self.arms: list[np.ndarray] = []
        self.beads = np.zeros((0, 3))
        self.moves = 0
        self.arrows: np.ndarray | None = None

    def show_arm(self, q: np.ndarray, hand: np.ndarray) -> None:
        self.arms.append(q)

    def show_move(self, end: np.ndarray, hand_path: np.ndarray) -> None:
        self.moves += 1

    def hide_move(self) -> None:
        self.moves = 0

    def show_props(self, cup: HandState | None, beads: np.ndarray) -> None:
        self.beads = beads

    def show_arrows(self, points: np.ndarray) -> None:
        self.arrows = points

    def hide_arrows(self) -> None:
        self.arrows = None

    def close(self) -> None:
        pass


class FakeRecorder:
    """Keeps what would be written."""

    def __init__(self) -> None:
        self.chunks: list[tuple[str, int, np.ndarray]] = []
        self.props: list[np.ndarray] = []
        self.ends: list[tuple[str, str]] = []
        self.outcomes: list[Any] = []

    def keep(
        self, drive_id: str, first_tick: int, rows: list[np.ndarray], props: list[np.ndarray]
    ) -> None:
        self.chunks.append((drive_id, first_tick, np.array(rows)))
        self.props.extend(props)

    def end(self, drive_id: str, why: str, outcome: dict[str, Any] | None) -> None:
        self.ends.append((drive_id, why))
        self.outcomes.append(outcome)

    def rows(self) -> np.ndarray:
        return np.concatenate([rows for _, _, rows in self.chunks])

    def column(self, name: str) -> np.ndarray:
        return self.rows()[:, COLUMNS.index(name)]


class Arm:
    """A session with its clock, its picture and its record."""

    def __init__(self, pack: PandaPack) -> None:
        self.scene, self.recorder, self.now_s = FakeScene(), FakeRecorder(), 100.0
        self.simulation = Simulation(pack)
        self.session = LiveSession(
            "p",
            self.simulation,
            self.scene,  # type: ignore[arg-type]
            TASK,
            silence_s=0.25,
            start=TASK.home_q,
        )

    def drive(self, drive_id: str = "d") -> None:
        log = DriveLog(self.recorder, drive_id, 0, 0.5)  # type: ignore[arg-type]
        self.session.start_drive("no-align", unaligned(load_controller("plane")), log)

    def tick(self, seconds: float, stick: tuple[float, float] | None = None) -> np.ndarray:
        """Let time pass, the stick said anew at each tick; returns how far the hand got."""
        before = self.simulation.hand.position
        for _ in range(round(seconds / DT_S)):
            self.now_s += DT_S
            if stick is not None:
                self.session.move_stick(PAGE, *stick, self.now_s)
            self.session.tick(self.now_s, DT_S)
        way: np.ndarray = self.simulation.hand.position - before
        return way

    def hold(self) -> Any:
        return self.session.status(PAGE, self.now_s).hold


@pytest.fixture
def arm(pack: PandaPack) -> Arm:
    arm = Arm(pack)
    arm.session.take_stick(PAGE)
    arm.drive()
    return arm


def test_the_stick_moves_the_hand_and_letting_go_holds_it(arm: Arm) -> None:
    assert np.linalg.norm(arm.tick(0.5, (0.0, 1.0))[:2]) > 0.03
    assert arm.hold() is None
    arm.tick(0.2, (0.0, 0.0))  # the servos come to rest
    assert np.abs(arm.tick(2.0, (0.0, 0.0))).max() < 1e-4
    assert arm.hold() == "released"


def test_a_drive_that_has_ended_does_not_begin_again(arm: Arm) -> None:
    """Until its end is in the database, asking for it again finds it open there."""
    arm.tick(1.0, (0.0, 1.0))
    arm.session.stop_drive("left")
    written = len(arm.recorder.rows())
    arm.drive("d")
    arm.tick(1.0, (0.0, 1.0))
    assert not arm.session.is_driven
    assert len(arm.recorder.rows()) == written
    arm.drive("another")
    assert arm.session.is_driven


def test_the_arm_holds_a_quarter_of_a_second_after_silence(arm: Arm) -> None:
    arm.tick(0.5, (1.0, 0.0))
    assert np.linalg.norm(arm.tick(0.2)) > 0.01  # not heard of, but not for long
    arm.tick(0.05 + 0.2)  # the rest of the quarter second; the servos come to rest
    assert np.abs(arm.tick(2.0)).max() < 1e-4
    assert arm.hold() == "silent"


def test_what_pushed_the_stick_and_is_not_found_any_more_is_let_go_whoever_goes_on_sending(
    arm: Arm,
) -> None:
    arm.tick(0.5, (1.0, 0.0))
    found_s = arm.now_s
    for _ in range(20):
        arm.session.move_stick(PAGE, 1.0, 0.0, found_s)
        arm.tick(DT_S)
    assert arm.hold() == "silent"
    arm.tick(0.2)
    assert np.abs(arm.tick(0.5)).max() < 1e-4


def test_a_push_that_is_held_still_for_a_minute_keeps_driving(arm: Arm) -> None:
    for _ in range(60):
        arm.tick(1.0, (0.0, 0.05))
        assert arm.hold() in (None, "edge")


def test_a_hidden_page_lets_the_arm_hold_at_once(arm: Arm) -> None:
    arm.tick(0.5, (1.0, 0.0))
    arm.session.release(PAGE)
    arm.tick(0.1)
    assert np.abs(arm.tick(1.0)).max() < 1e-4


def test_only_the_newest_tab_steers(arm: Arm) -> None:
    arm.session.take_stick(NEWER)
    assert not arm.session.has_stick(PAGE)
    assert np.abs(arm.tick(1.0, (1.0, 0.0))).max() < 1e-4
    arm.session.take_stick(PAGE)
    assert np.linalg.norm(arm.tick(0.5, (1.0, 0.0))) > 0.03


def test_a_tab_that_leaves_does_not_take_the_stick_of_another(arm: Arm) -> None:
    arm.session.take_stick(NEWER)
    arm.session.leave(PAGE)
    assert arm.session.has_stick(NEWER)
    arm.session.leave(NEWER)
    assert not arm.session.has_stick(NEWER)


def test_a_page_whose_line_was_lost_comes_back_steering(arm: Arm) -> None:
    arm.tick(0.5, (1.0, 0.0))
    again = Connection("tab", 1)
    arm.session.connect(again)
    arm.session.leave(PAGE)  # of the old line's end the server hears after the new one has begun
    assert arm.session.has_stick(again)
    arm.tick(0.3)
    assert np.abs(arm.tick(0.5, (1.0, 0.0))).max() < 1e-4, "what the old line still says"
    arm.session.move_stick(again, 0.0, 1.0, arm.now_s)
    assert np.linalg.norm(arm.tick(0.1)) > 0.001


def test_a_page_that_comes_back_takes_no_stick_from_another(arm: Arm) -> None:
    arm.session.connect(NEWER)
    arm.session.leave(PAGE)
    arm.session.connect(Connection("tab", 1))
    assert arm.session.has_stick(NEWER)
    arm.session.leave(NEWER)  # its line is lost, too
    back = Connection("tab", 2)
    arm.session.connect(back)
    assert not arm.session.has_stick(back)
    again = Connection("newer", 1)
    arm.session.connect(again)
    assert arm.session.has_stick(again)


def test_an_older_line_of_a_page_takes_nothing_from_its_newer_one(arm: Arm) -> None:
    newest = Connection("tab", 7)
    arm.session.connect(newest)
    arm.session.connect(Connection("tab", 6))
    assert arm.session.has_stick(newest)


def test_taking_the_stick_stops_what_the_other_tab_was_doing(arm: Arm) -> None:
    arm.tick(0.5, (1.0, 0.0))
    arm.session.take_stick(NEWER)
    arm.tick(0.2)
    assert np.abs(arm.tick(0.5)).max() < 1e-4


@pytest.mark.parametrize("stick", [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (0.7, 0.7)])
def test_the_hand_stops_at_the_edge_and_comes_back(arm: Arm, stick: tuple[float, float]) -> None:
    arm.tick(12.0, stick)
    assert arm.hold() == "edge"
    low, high = TASK.workspace
    hand = arm.simulation.hand.position
    assert (hand[:2] > low - 0.05).all()
    assert (hand[:2] < high + 0.05).all()
    assert np.linalg.norm(arm.tick(1.0, (-stick[0], -stick[1]))) > 0.05
    assert arm.hold() is None


def test_who_pushes_along_an_edge_is_not_caught_there(arm: Arm) -> None:
    arm.tick(12.0, (1.0, 0.0))
    edge = arm.simulation.hand.position.copy()
    arm.tick(0.7, (0.5, 0.8))  # out a little, and along
    gone = arm.simulation.hand.position - edge
    assert arm.hold() == "edge"
    assert np.abs(gone[:2]).max() > 0.06
    assert np.abs(gone[:2]).min() < 0.01
    assert abs(gone[2]) < 0.02


def test_joint_limits_are_kept_under_a_wild_stick(arm: Arm, rng: np.random.Generator) -> None:
    for _ in range(60):
        angle = rng.uniform(0, 2 * np.pi)
        arm.tick(0.5, (float(np.cos(angle)), float(np.sin(angle))))
    q = arm.recorder.rows()[:, COLUMNS.index("q_1") : COLUMNS.index("q_7") + 1]
    assert (q > Q_MIN - 0.01).all()
    assert (q < Q_MAX + 0.01).all()
    assert np.isfinite(arm.recorder.rows()).all()


def test_home_brings_the_arm_back_to_where_the_task_begins(arm: Arm) -> None:
    arm.tick(2.0, (0.7, 0.7))
    arm.session.go_home(PAGE)
    arm.tick(0.1, (0.0, 0.0))
    assert arm.hold() == "moving-home"
    arm.tick(3.0, (0.0, 0.0))
    assert np.abs(arm.simulation.q - TASK.home_q).max() < 0.01
    assert arm.hold() == "released"


def test_every_tick_is_recorded_with_what_it_did(arm: Arm) -> None:
    arm.tick(2.0, (0.6, 0.2))
    arm.session.stop_drive("left")
    times = arm.recorder.column("monotonic_s")
    assert len(times) == 120
    assert np.diff(times) == pytest.approx(DT_S)
    assert set(arm.recorder.column("raw_x")) == {0.6}
    assert arm.recorder.column("h_x")[0] < 0.6  # filtered
    assert arm.recorder.column("h_x")[-1] == pytest.approx(0.6, abs=1e-3)
    firsts = [first for _, first, _ in arm.recorder.chunks]
    lengths = [len(rows) for _, _, rows in arm.recorder.chunks]
    assert firsts == np.cumsum([0, *lengths[:-1]]).tolist()
    assert arm.recorder.ends == [("d", "left")]
    hand = arm.recorder.rows()[-1, COLUMNS.index("hand_x") : COLUMNS.index("hand_z") + 1]
    assert hand == pytest.approx(arm.simulation.hand.position)


def test_what_was_recorded_explains_what_the_arm_did(arm: Arm) -> None:
    arm.tick(1.5, (0.3, -0.8))
    arm.session.stop_drive("left")
    rows = arm.recorder.rows()
    controller = load_controller("plane")
    for before, row in itertools.pairwise(rows[20:]):
        q = before[COLUMNS.index("q_1") : COLUMNS.index("q_7") + 1]
        z = row[COLUMNS.index("z_1") : COLUMNS.index("z_2") + 1]
        a = row[COLUMNS.index("a_1") : COLUMNS.index("a_7") + 1]
        assert a == pytest.approx(controller.decode(z, q), abs=1e-9)


def test_the_same_drive_asked_for_twice_is_one_drive(arm: Arm) -> None:
    arm.tick(0.3, (1.0, 0.0))
    arm.drive()
    arm.tick(0.3, (1.0, 0.0))
    arm.session.stop_drive("left")
    assert len(arm.recorder.rows()) == 36
    assert len(arm.recorder.ends) == 1


def test_a_new_drive_begins_where_the_last_one_was(arm: Arm) -> None:
    arm.tick(1.0, (1.0, 0.0))
    arm.tick(0.5, (0.0, 0.0))
    there = arm.simulation.q
    arm.drive("next")
    arm.tick(0.5)
    assert arm.simulation.q == pytest.approx(there, abs=1e-4)


def test_a_move_is_played_from_start_to_end_and_stays_there(pack: PandaPack) -> None:
    arm = Arm(pack)
    path = np.linspace(TASK.home_q, TASK.home_q + 0.1, 11)
    arm.session.show("query", path, np.zeros((11, 3)), arm.now_s)
    assert arm.scene.moves == 1
    arm.tick(0.3)
    assert arm.scene.arms[-1] == pytest.approx(path[0])
    status = arm.session.status(PAGE, arm.now_s)
    assert status.mode == "showing"
    assert status.playback is not None
    assert status.playback.duration_s == pytest.approx(1.0)
    arm.tick(3.0)
    assert arm.scene.arms[-1] == pytest.approx(path[-1])
    assert arm.session.status(PAGE, arm.now_s).mode == "idle"


def test_nothing_is_sent_while_nothing_moves(arm: Arm) -> None:
    arm.tick(1.0, (0.0, 0.0))
    sent = len(arm.scene.arms)
    arm.tick(2.0, (0.0, 0.0))
    assert len(arm.scene.arms) == sent


def test_a_move_is_not_shown_while_someone_drives(arm: Arm) -> None:
    arm.session.show("query", np.zeros((11, 7)), np.zeros((11, 3)), arm.now_s)
    arm.tick(0.5)
    assert arm.scene.moves == 0
    assert np.abs(arm.simulation.q - TASK.home_q).max() < 1e-3
