"""Simulated participants walk a study through a running server's doors, politely and rudely."""

import asyncio
import os
import signal
import subprocess
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from app.analysis.study_export import read_export
from app.bots.crowd import Crowd, send
from app.bots.opinions import Felt, respond
from app.bots.person import Habits, Person
from app.bots.visit import Manners, Visit, _Cut
from app.cli import main
from app.storage.tables import AnswerRow, DriveRow, ResponseRow
from models.kinematics import HandPose
from models.panda_pack import default_folder
from models.preferences import axes, parse_preference
from models.tasks import get_task
from tests.patience import PATIENCE_S
from tests.running_server import children_of, running_server

PROTOCOL = {
    "title": "Rehearsal",
    "tasks": [{"task": "avoid", "labels": 7}],
    "strategies": ["no-align", "all-priors"],
    "practice_s": 0,
    "questionnaires": {"after_each_strategy": ["steering"], "after_each_task": ["preference"]},
}


def test_bots_do_all_that_a_study_asks_and_rude_ones_leave_no_trace(tmp_path: Path) -> None:
    with running_server(tmp_path) as server:
        office, study = server.experimenter(), f"/api/v1/studies/{uuid.uuid4()}"
        content = {"id": study.rsplit("/", 1)[1], "protocol": PROTOCOL}
        office.post("/api/v1/studies", json=content).raise_for_status()
        link = office.post(f"{study}/link").raise_for_status().json()["link"]
        crowd = Crowd(
            participants=3,
            preference="rotated:75",
            parallel=3,
            seed=4,
            double_submit=True,
            reconnect=True,
            two_tabs=True,
            gives_up_s=25.0,
        )
        reports = asyncio.run(send(crowd, link, lambda _reports: None))
        assert [report.state for report in reports] == ["completed"] * 3
        assert sum(report.refusals for report in reports) == 0
        assert office.get(study).json()["participants"]["completed"] == 3
        assert len(server.rows(AnswerRow)) == 3 * 7
        assert len(server.rows(ResponseRow)) == 3 * (2 * 6 + 2)
        drives = server.rows(DriveRow)
        ends = Counter((drive.strategy, drive.end) for drive in drives)
        assert ends["all-priors", "done"] == 3
        assert ends["no-align", "done"] == 0
        best = [row.value for row in server.rows(ResponseRow) if row.item == "best"]
        positions = {
            drive.participant_id: drive.step[-1] for drive in drives if drive.end == "done"
        }
        assert sorted(best) == sorted(positions.values())


def test_a_study_in_a_file_gets_a_server_an_export_and_the_same_steering(tmp_path: Path) -> None:
    study, out = tmp_path / "study.yaml", tmp_path / "study.zip"
    study.write_text(
        "title: A/A\ntasks: [{task: avoid, labels: 5, unlabelled: 200}]\n"
        "strategies: [no-align, all-priors]\npractice_s: 0\n"
    )
    words = ["--study", str(study), "--out", str(out), "--participants", "1", "--seed", "7"]
    assert main(["bots", *words, "--speed", "3", "--same", "all-priors"]) == 0
    export = read_export(out)
    drives = export.tables["drives"]
    assert sorted(drive["strategy"] for drive in drives) == ["all-priors", "no-align"]
    assert len({drive["alignment"] for drive in drives}) == 1
    assert all(drive["is_success"] for drive in drives)
    assert {ticks.drive for ticks in export.ticks(["hand_x"])} == {
        drive["drive"] for drive in drives
    }
    assert sorted(path.name for path in tmp_path.iterdir()) == ["study.yaml", "study.zip"]


def test_secretly_driving_with_no_strategy_is_refused_in_one_line(
    tmp_path: Path, capsys: object
) -> None:
    words = ["--study", "examples/paper-study.yaml", "--out", str(tmp_path / "o.zip")]
    assert main(["bots", *words, "--same", "magic"]) == 2
    heard = capsys.readouterr().err  # type: ignore[attr-defined]
    assert "JOYMAP_SAME_STRATEGY: There is no strategy 'magic'" in heard
    assert heard.count("\n") == 1


def test_a_file_that_is_no_protocol_is_refused_in_one_line(tmp_path: Path, capsys: object) -> None:
    study = tmp_path / "study.yaml"
    study.write_text("title: Bad\ntasks: [{task: fly}]\n")
    assert main(["bots", "--study", str(study), "--out", str(tmp_path / "o.zip")]) == 2
    heard = capsys.readouterr().err  # type: ignore[attr-defined]
    assert "fly" in heard
    assert heard.count("\n") == 1


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_bots_that_are_ended_leave_no_server_and_no_half_export(
    how: signal.Signals, tmp_path: Path
) -> None:
    words = ["--study", "examples/paper-study.yaml", "--out", str(tmp_path / "study.zip")]
    # What a shell starts in the background does not hear Ctrl-C, and neither do its children.
    hearing = ["env", "--default-signal=INT"]
    bots = subprocess.Popen(
        [*hearing, sys.executable, "-m", "app.cli", "bots", *words],
        env=os.environ | {"TMPDIR": str(tmp_path), "JOYMAP_PANDA_DIR": str(default_folder())},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        _until(lambda: any(tmp_path.glob("joymap-bots-*/joymap.db")))
        servers = children_of(bots.pid)
        assert len(servers) == 1
    finally:
        bots.send_signal(how)
        _, heard = bots.communicate(timeout=PATIENCE_S)
    assert heard == "joymap bots: Stopped before it was done.\n"
    assert bots.returncode == 130
    assert not Path(f"/proc/{servers[0]}").exists()
    assert list(tmp_path.iterdir()) == []


def _until(is_so: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < limit_s
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--study", "http://x/join/abc", "--speed", "2"], "a server has its own"),
        (["--study", "nothing.yaml"], "or a file"),
        (["--study", "README.md"], "--out"),
        (["--study", "http://x/p/abc"], "shared link"),
        (["--study", "http://x/join/abc", "--participants", "0"], "at least 1"),
        (["--study", "http://x/join/abc", "--drop-out", "2"], "share"),
        (["--study", "http://x/join/abc", "--preference", "odd"], "odd"),
    ],
)
def test_a_bad_argument_gets_one_line(words: list[str], said: str, capsys: object) -> None:
    assert main(["bots", *words]) == 2
    heard = capsys.readouterr().err  # type: ignore[attr-defined]
    assert said in heard
    assert heard.count("\n") == 1


def test_whoever_adapts_learns_what_the_stick_really_does() -> None:
    """A stick that is turned by 60°: after a while the hand goes where they want."""
    task, turn = get_task("avoid"), np.deg2rad(60.0)
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    last = {}
    for adapts in (0.0, 0.05):
        habits = Habits(motor_noise=0.05, adapts=adapts)
        person = Person(axes(), habits, np.random.default_rng(1))
        place, rng, misses = np.array([0.5, 0.0, 0.3]), np.random.default_rng(2), []
        hands: list[HandPose] = []
        for tick in range(900):
            if tick % 30 == 0:
                wanted = rng.normal(size=2) * 0.1
            hands.append(HandPose(place.copy(), np.eye(3)))
            seen = hands[max(0, tick - 6)]  # a reaction time ago
            h = person.push(task, _always(wanted), seen, tick / 30, 1 / 30)
            change = turned @ h * 0.2 / 30
            place[:2] += change
            misses.append(abs(np.angle(complex(*change) / complex(*wanted))))
        last[adapts] = np.rad2deg(np.mean(misses[-150:]))
    assert last[0.0] == pytest.approx(60.0, abs=8.0)
    assert last[0.05] < 15.0


@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_who_knows_of_the_delay_stops_where_they_want_to(speed: float) -> None:
    """A brisk person and a hand that is as fast as they think, or half as fast."""
    task, delay = get_task("avoid"), 6
    habits = Habits(motor_noise=0.0, reaction_s=delay / 30)
    person = Person(axes(), habits, np.random.default_rng(1))
    place, goal, hands = np.array([0.4, 0.0, 0.3]), np.array([0.55, 0.0]), list[HandPose]()

    def wish(hand: HandPose) -> np.ndarray:
        way: np.ndarray = np.clip(6.0 * (goal - hand.position[:2]), -0.15, 0.15)
        return way

    farthest = 0.0
    for tick in range(300):
        hands.append(HandPose(place.copy(), np.eye(3)))
        h = person.push(task, wish, hands[max(0, tick - delay)], tick / 30, 1 / 30)
        place[:2] += speed * h * 0.2 / 30
        farthest = max(farthest, place[0])
    assert place[:2] == pytest.approx(goal, abs=1e-3)
    assert farthest < goal[0] + 1e-3


def test_a_forecast_that_does_not_come_true_is_not_trusted() -> None:
    """The hand stands still: who believed that it moves would stop short, believing to be there."""
    task, where = get_task("avoid"), HandPose(np.array([0.4, 0.0, 0.3]), np.eye(3))
    person = Person(axes(), Habits(motor_noise=0.0), np.random.default_rng(1))
    asked: list[np.ndarray] = []

    def wish(hand: HandPose) -> np.ndarray:
        asked.append(hand.position.copy())
        return np.array([0.1, 0.0])

    for tick in range(40):
        person.push(task, wish, where, tick / 30, 1 / 30)
    assert asked[10][0] == pytest.approx(0.4 + 0.2 * 0.1, abs=1e-3)
    assert asked[-1] == pytest.approx(where.position)


def _always(wanted: np.ndarray) -> Callable[[HandPose], np.ndarray]:
    return lambda _hand: wanted


class CutOff:
    """A page on which the attempt is no more: the line was gone for too long."""

    async def send(self, **_message: object) -> None:
        pass

    async def keep(self, seen: list[object], clock: Callable[[], float]) -> None:
        while True:
            seen.append((clock(), {"drive_id": None}))
            await asyncio.sleep(0.01)


def test_a_try_that_was_cut_off_is_not_waited_for() -> None:
    person = Person(axes(), Habits(), np.random.default_rng(0))
    visit = Visit("http://x/p/t", person, Manners(), speed=50.0)
    steering = visit._steer(CutOff(), get_task("avoid"), {}, "d", visit._now_s(), np.inf)  # type: ignore[arg-type]
    with pytest.raises(_Cut):
        asyncio.run(asyncio.wait_for(steering, 10.0))


@pytest.mark.parametrize(("goes", "undone"), [(1.0, 0.0), (-1.0, 0.1), (0.0, 0.1)])
def test_who_gets_no_closer_takes_it_back_and_tries_elsewhere(goes: float, undone: float) -> None:
    """The hand follows the stick, goes the other way, or stands still."""
    task = get_task("avoid")
    person = Person(axes(), Habits(motor_noise=0.0), np.random.default_rng(3))
    place, hands, pushes = np.array([0.5, 0.0, 0.3]), list[HandPose](), []
    for tick in range(300):
        hands.append(HandPose(place.copy(), np.eye(3)))
        seen = hands[max(0, tick - 6)]
        pushes.append(person.push(task, _always(np.array([0.1, 0.0])), seen, tick / 30, 1 / 30))
        place[:2] += goes * 0.2 / 30 * pushes[-1]
    turned = np.mean([push @ pushes[0] < -0.5 * (pushes[0] @ pushes[0]) for push in pushes])
    assert turned == undone if undone == 0.0 else turned > undone


def test_the_same_seed_is_the_same_person() -> None:
    crowd, other = Crowd(3, seed=5), Crowd(3, seed=6)
    for index in range(3):
        one, same = crowd.person(index).preference, crowd.person(index).preference
        assert np.array_equal(one.matrix, same.matrix)
        assert not np.array_equal(one.matrix, other.person(index).preference.matrix)


def test_what_is_said_follows_what_was_felt() -> None:
    rng = np.random.default_rng(0)
    scale = {"kind": "scale", "text": "It was easy.", "low": 1, "high": 7, "step": 1}
    effort = scale | {"text": "How much effort?", "low": 0, "high": 100, "step": 5}
    good, bad = Felt(0.02, 0.0), Felt(0.5, 1.0)
    words = {"high_label": "", "low_label": ""}
    assert respond(scale | words, good, [], rng) > respond(scale | words, bad, [], rng)  # type: ignore[operator]
    assert respond(effort | words, good, [], rng) < respond(effort | words, bad, [], rng)  # type: ignore[operator]
    assert respond({"kind": "strategy"}, good, [bad, good], rng) == 2
    assert parse_preference("axes", rng) is not None
