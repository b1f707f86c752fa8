"""One participant's arm: shows the moves of questions, and is driven.

Nothing here knows of sockets or clocks: messages come in as calls, time as an argument. All calls
are made on the event loop.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from app import texts
from app.scene.arm_scene import ArmScene
from app.schemas.messages import PlaybackOut, ProgressOut, StatusOut
from app.storage.ticks import HOLDS
from app.teleop import feed_forward
from app.teleop.edges import keep_inside
from app.teleop.recorder import DriveLog
from app.teleop.show import Show
from app.teleop.stick_filter import StickFilter
from app.teleop.stick_lease import Connection, StickLease
from models.mapping import Mapping
from models.simulation import Simulation
from models.tasks import Task
from models.tasks.attempt import Attempt, FreeDrive, Progress

_HOME_SPEED = 0.8  # [rad/s], of the fastest joint on the way back to the start
_SEEN_M = 1e-4  # what moves less is not drawn anew
_ARROWS_EVERY_S = 0.1


Arrows = Literal["off", "on", "switch"]  # switch: off at first, and the person's choice


@dataclass
class _Drive:
    strategy: str | None  # None: the person must not hear its name
    mapping: Mapping
    log: DriveLog
    attempt: Attempt
    progress: Progress
    elapsed_s: float = 0.0
    arrows_s: float = 0.0  # for how long the arrows were seen
    end: str | None = None

    def outcome(self) -> dict[str, Any] | None:
        """What the task says of it, for the record."""
        if not self.attempt.has_goal:
            return None
        return {
            "fraction": self.progress.fraction,
            "counts": self.progress.counts,
            "is_success": self.progress.is_success,
            "elapsed_s": round(self.elapsed_s, 4),
            "arrows_s": round(self.arrows_s, 4),
        }


class LiveSession:
    """A participant's arm, its picture, and whoever holds its stick."""

    def __init__(
        self,
        participant_id: str,
        simulation: Simulation,
        scene: ArmScene,
        task: Task,
        *,
        silence_s: float,
        start: np.ndarray,
        limit_s: float | None = None,
        waits_s: float = 5.0,
        auto_grasp: bool = False,
        arrows: Arrows = "off",
    ) -> None:
        """Stand at ``start`` ``(7,)`` in [rad]."""
        self.participant_id = participant_id
        self.scene = scene
        self.pages = 0  # live websockets
        self._simulation = simulation
        self.task = task
        self._stick = StickLease(silence_s)
        self._limit_s = limit_s
        self.waits_s = waits_s  # for a lost connection
        self.is_closed = False
        self._auto_grasp = auto_grasp
        self._may_switch_arrows = arrows == "switch"
        self._has_arrows = arrows == "on"
        self._arrows_age_s = 0.0
        self._filter = StickFilter()
        self._show: Show | None = None
        self._drive: _Drive | None = None
        self._homing = False
        self._last_drive_id: str | None = None
        self._is_preparing = False
        self._hold: str | None = "released"
        self._shown_q = np.full(7, np.nan)
        self._shown_props = np.full(self._props().shape, np.nan)
        simulation.reset(start)
        self._picture()

    @property
    def is_driven(self) -> bool:
        """Whether a drive is open."""
        return self._drive is not None

    @property
    def is_trying(self) -> bool:
        """Whether an attempt goes on."""
        return self._drive is not None and self._drive.end is None

    @property
    def drive_id(self) -> str | None:
        """The drive that is open, or was the last to end: it does not begin again."""
        return self._last_drive_id

    # What pages say.

    def connect(self, page: Connection) -> None:
        """A page is there; as a rule it takes the stick."""
        self.pages += 1
        self._stick.connect(page)

    def take_stick(self, page: Connection) -> None:
        """This page holds the stick from now on."""
        self._stick.take(page)

    def leave(self, page: Connection) -> None:
        """This page is gone; if it held the stick, the arm holds."""
        self.pages -= 1
        self._stick.leave(page)

    def has_stick(self, page: Connection) -> bool:
        """Whether this page's stick counts."""
        return self._stick.is_held_by(page)

    def move_stick(self, page: Connection, x: float, y: float, found_s: float) -> None:
        """The stick was found at ``(x, y)`` in [-1, 1]² at ``found_s``, if it is theirs to say."""
        self._stick.move(page, x, y, found_s)

    def release(self, page: Connection) -> None:
        """This page lets go of the stick, if it holds it."""
        if self.has_stick(page):
            self._stick.let_go()

    def go_home(self, page: Connection) -> None:
        """Bring the arm back to where the task begins, if this page may and no attempt goes on."""
        drive = self._drive
        if self.has_stick(page) and drive is not None and not drive.attempt.has_goal:
            self._homing = True

    def press(self, page: Connection) -> str | None:
        """The button; a sentence if there is nothing to do with it."""
        if not self.has_stick(page):
            return "You are steering in another tab."
        if self._drive is None or self._drive.end is not None:
            return "There is nothing to grasp now: no drive is going on."
        reason = self._drive.attempt.press()
        return None if reason is None else texts.NO_GRASP[reason]

    def show_arrows(self, page: Connection, is_on: bool) -> None:
        """Show or hide where each stick direction would lead, where that is the person's choice."""
        if self.has_stick(page) and self._may_switch_arrows:
            self._has_arrows = is_on
            self._arrows_age_s = 0.0

    def give_up(self, page: Connection) -> None:
        """End the attempt as it is, if it is this page's to say."""
        if self.has_stick(page) and self._drive is not None:
            self._end(self._drive, "given up")

    # What services say.

    def show(self, query_id: str, path: np.ndarray, hand_path: np.ndarray, now_s: float) -> None:
        """Play a move ``(m, 7)`` in [rad] from its start, with a ghost at its end."""
        if self._drive is not None or self._is_preparing:
            return
        if self._show is None or self._show.query_id != query_id:
            self.scene.show_move(path[-1], hand_path)
        self._show = Show(query_id, path, now_s)

    def prepare(self) -> Simulation:
        """End whatever goes on; the simulation stands still until a drive starts."""
        self.stop_drive("switched")
        self._is_preparing = True
        if self._show is not None:
            self._show = None
            self.scene.hide_move()
            self._simulation.reset(self.task.home_q)
        return self._simulation

    def start_drive(
        self, strategy: str | None, mapping: Mapping, log: DriveLog, attempt: Attempt | None = None
    ) -> None:
        """Begin an attempt, for which the simulation stands ready; the same twice is one."""
        if self.drive_id == log.drive_id:
            return
        self.prepare()
        self._is_preparing = False
        self._homing = False
        self._stick.let_go()
        attempt = attempt or FreeDrive(self._simulation)
        self._drive = _Drive(strategy, mapping, log, attempt, attempt.progress)
        self._last_drive_id = log.drive_id

    def stop_drive(self, why: str) -> None:
        """End the drive, if there is one."""
        if self._drive is not None:
            self._end(self._drive, why)
            self._drive = None
            self._stick.let_go()

    def close(self, why: str) -> None:
        """End everything."""
        self.is_closed = True
        self.stop_drive(why)
        self.scene.close()

    def be_steady(self, is_on: bool) -> None:
        """Take tremor out of the stick from now on, or leave it in."""
        self._filter.is_steady = is_on

    # Time.

    def tick(self, now_s: float, dt_s: float) -> None:
        """Let one tick pass that ends at ``now_s``."""
        if self._drive is not None:
            self._tick_drive(self._drive, now_s, dt_s)
        elif self._show is not None:
            q, _ = self._show.at(now_s)
            self._simulation.reset(q)
            self._picture()

    def _tick_drive(self, drive: _Drive, now_s: float, dt_s: float) -> None:
        if drive.end is not None:
            # The arm holds; what falls still falls.
            self._simulation.step(dt_s)
            self._hold = "over"
            self._picture()
            return
        if self._auto_grasp and drive.attempt.can_grasp:
            drive.attempt.press()
        raw = self._stick.raw
        silent = self._stick.is_silent(now_s)
        h = self._filter.update(np.zeros(2) if silent else raw, dt_s)
        z, a = np.zeros(2), np.zeros(7)
        by_itself = drive.attempt.way
        if by_itself is not None:
            hold: str | None = "by-itself"
            a = self._way_to(by_itself, dt_s)
        elif self._homing:
            hold = "moving-home"
            a = self._way_to(self.task.home_q, dt_s)
            self._homing = bool(a.any())
        elif not h.any():
            hold = "silent" if silent and raw.any() else "released"
        else:
            hold = None
            s = self._simulation.q
            z = drive.mapping.z(h, s)
            controller = drive.mapping.controller
            z, a, is_at_edge = keep_inside(self.task, self._simulation, controller, z, dt_s)
            hold = "edge" if is_at_edge else None
        if a.any():
            self._simulation.set_target(self._simulation.target + a * dt_s)
        self._simulation.step(dt_s)
        drive.attempt.watch(dt_s)
        drive.elapsed_s += dt_s
        self._hold = hold
        hand = self._simulation.hand
        props = self._props()
        drive.log.add(
            np.concatenate(
                [
                    [now_s],
                    raw,
                    h,
                    z,
                    a,
                    self._simulation.q,
                    hand.position,
                    hand.wxyz,
                    [0 if hold is None else 1 + HOLDS.index(hold)],
                    [float(self._simulation.is_touching)],
                ]
            ),
            props,
        )
        self._picture(props)
        self._point(drive, dt_s)
        drive.progress = drive.attempt.progress
        if drive.progress.is_done:
            self._end(drive, "done")
        elif self._is_late(drive):
            self._end(drive, "time limit")

    def _is_late(self, drive: _Drive) -> bool:
        if not drive.attempt.has_goal or self._limit_s is None:
            return False
        return drive.elapsed_s >= self._limit_s

    def _end(self, drive: _Drive, why: str) -> None:
        if drive.end is None:
            drive.end = why
            self.scene.hide_arrows()
            drive.log.end(why, drive.outcome())

    def _way_to(self, q: np.ndarray, dt_s: float) -> np.ndarray:
        """Joint velocities towards ``q``; zero once the target is there."""
        way = q - self._simulation.target
        farthest = float(np.max(np.abs(way)))
        if farthest < 1e-3:
            return np.zeros(7)
        velocity: np.ndarray = way / max(dt_s, farthest / _HOME_SPEED)
        return velocity

    def _props(self) -> np.ndarray:
        """The cup's pose and the beads' positions, in one row."""
        cup = self._simulation.cup
        parts = [] if cup is None else [cup.position, cup.wxyz]
        return np.concatenate([*parts, self._simulation.bead_positions.ravel(), []])

    def _picture(self, props: np.ndarray | None = None) -> None:
        """Tell the picture, if there is anything to see."""
        q = self._simulation.q
        if not np.abs(q - self._shown_q).max() < 1e-5:
            self._shown_q = q
            self.scene.show_arm(q, self._simulation.hand.position)
        props = self._props() if props is None else props
        if props.size and not np.abs(props - self._shown_props).max() < _SEEN_M:
            self._shown_props = props
            self.scene.show_props(self._simulation.cup, self._simulation.bead_positions)

    def _point(self, drive: _Drive, dt_s: float) -> None:
        """Keep the arrows at the hand, while the person steers."""
        is_seen = self._has_arrows and drive.attempt.way is None
        drive.arrows_s += dt_s * is_seen
        self._arrows_age_s -= dt_s
        if self._arrows_age_s > 0.0:
            return
        self._arrows_age_s = _ARROWS_EVERY_S
        if is_seen:
            self.scene.show_arrows(feed_forward.arrows(drive.mapping, self._simulation))
        else:
            self.scene.hide_arrows()

    # What pages hear.

    def status(self, page: Connection | None, now_s: float) -> StatusOut:
        """What the arm is doing, for this page, or for one that only watches."""
        playback, mode = None, "idle"
        if self._drive is not None:
            mode = "driving"
        elif self._show is not None and not self._show.is_over(now_s):
            mode = "showing"
            playback = PlaybackOut(
                query_id=self._show.query_id,
                fraction=self._show.at(now_s)[1],
                duration_s=self._show.duration_s,
            )
        progress = None if self._drive is None else self._progress(self._drive)
        hand = self._simulation.hand
        return StatusOut(
            mode=mode,  # type: ignore[arg-type]
            has_stick=page is not None and self.has_stick(page),
            strategy=None if self._drive is None else self._drive.strategy,
            drive_id=None if self._drive is None else self._drive.log.drive_id,
            hold=None if self._drive is None else self._hold,  # type: ignore[arg-type]
            stick=(float(self._stick.raw[0]), float(self._stick.raw[1])),
            hand=tuple(round(v, 4) for v in hand.position.tolist()),
            hand_wxyz=tuple(round(v, 4) for v in hand.wxyz.tolist()),
            playback=playback,
            progress=progress,
            arrows=self._has_arrows,
        )

    def _progress(self, drive: _Drive) -> ProgressOut | None:
        if not drive.attempt.has_goal:
            return None
        progress, words = drive.progress, texts.of_task(self.task.name)
        return ProgressOut(
            title=words.title,
            fraction=round(progress.fraction, 3),
            phase=progress.phase,
            says=words.phases[progress.phase],
            counts=progress.counts,
            elapsed_s=round(drive.elapsed_s, 1),
            limit_s=self._limit_s,
            can_grasp=drive.attempt.can_grasp,
            end=drive.end,  # type: ignore[arg-type]
            is_success=progress.is_success,
        )
