"""One participant's arm: shows the moves of questions, and is driven.

Nothing here knows of sockets or clocks: messages come in as calls, time as an argument. All calls
are made on the event loop.
"""

from dataclasses import dataclass

import numpy as np

from app.scene.arm_scene import ArmScene
from app.schemas.messages import PlaybackOut, StatusOut
from app.teleop.recorder import HOLDS, DriveLog
from app.teleop.stick_filter import StickFilter
from models.mapping import Mapping
from models.panda import QD_MAX
from models.simulation import Simulation
from models.tasks import Task

SHOW_S_PER_STEP = 0.1  # a move is shown at the speed at which it would be driven
_SHOW_REST_S = 0.6  # the arm stands still before and after a shown move
_HOME_SPEED = 0.8  # [rad/s], of the fastest joint on the way back to the start
# The hand may go this far over the edge of the task's area, in [m].
_EDGE_MARGIN_M = 0.02
_HEIGHT_MARGIN_M = 0.06


@dataclass
class _Show:
    query_id: str
    path: np.ndarray  # (m, 7) [rad]
    began_s: float

    @property
    def duration_s(self) -> float:
        return (len(self.path) - 1) * SHOW_S_PER_STEP

    def at(self, now_s: float) -> tuple[np.ndarray, float]:
        """Joint positions and the fraction shown."""
        fraction = np.clip((now_s - self.began_s - _SHOW_REST_S) / self.duration_s, 0.0, 1.0)
        place = fraction * (len(self.path) - 1)
        before = min(int(place), len(self.path) - 2)
        share = place - before
        return (1 - share) * self.path[before] + share * self.path[before + 1], float(fraction)

    def is_over(self, now_s: float) -> bool:
        return now_s - self.began_s > self.duration_s + 2 * _SHOW_REST_S


@dataclass
class _Drive:
    strategy: str
    mapping: Mapping
    log: DriveLog


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
    ) -> None:
        """Stand at ``start`` ``(7,)`` in [rad]."""
        self.participant_id = participant_id
        self.scene = scene
        self.pages = 0  # live websockets
        self._simulation = simulation
        self.task = task
        self._silence_s = silence_s
        self._filter = StickFilter()
        self._raw = np.zeros(2)
        self._heard_s = -np.inf
        self._holder: str | None = None
        self._show: _Show | None = None
        self._drive: _Drive | None = None
        self._homing = False
        self._hold: str | None = "released"
        self._shown_q = np.full(7, np.nan)
        simulation.reset(start)
        self._picture()

    @property
    def is_driven(self) -> bool:
        """Whether a drive is open."""
        return self._drive is not None

    # What pages say.

    def take_stick(self, tab: str) -> None:
        """This tab holds the stick from now on."""
        if tab != self._holder:
            self._holder = tab
            self.let_go()

    def leave(self, tab: str) -> None:
        """This tab is gone; if it held the stick, the arm holds."""
        if tab == self._holder:
            self._holder = None
            self.let_go()

    def has_stick(self, tab: str) -> bool:
        """Whether this tab's stick counts."""
        return tab == self._holder

    def move_stick(self, tab: str, x: float, y: float, now_s: float) -> None:
        """The stick is at ``(x, y)`` in [-1, 1]², if it is this tab's to say."""
        if tab == self._holder:
            self._raw = np.array([x, y])
            self._heard_s = now_s

    def let_go(self) -> None:
        """The stick is released."""
        self._raw = np.zeros(2)
        self._heard_s = -np.inf

    def go_home(self) -> None:
        """Bring the arm back to where the task begins."""
        if self._drive is not None:
            self._homing = True

    # What services say.

    def show(self, query_id: str, path: np.ndarray, hand_path: np.ndarray, now_s: float) -> None:
        """Play a move ``(m, 7)`` in [rad] from its start, with a ghost at its end."""
        if self._drive is not None:
            return
        if self._show is None or self._show.query_id != query_id:
            self.scene.show_move(path[-1], hand_path)
        self._show = _Show(query_id, path, now_s)

    def start_drive(self, strategy: str, mapping: Mapping, log: DriveLog) -> None:
        """Drive from where the arm is; the same drive twice is one drive."""
        if self._drive is not None:
            if self._drive.log.drive_id == log.drive_id:
                return
            self._drive.log.flush()
        if self._show is not None:
            self._show = None
            self.scene.hide_move()
            self._simulation.reset(self.task.home_q)
        self._homing = False
        self.let_go()
        self._drive = _Drive(strategy, mapping, log)

    def stop_drive(self, why: str) -> None:
        """End the drive, if there is one."""
        if self._drive is not None:
            self._drive.log.end(why)
            self._drive = None
            self.let_go()

    def close(self, why: str) -> None:
        """End everything."""
        self.stop_drive(why)
        self.scene.close()

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
        raw = self._raw
        silent = now_s - self._heard_s > self._silence_s
        h = self._filter.update(np.zeros(2) if silent else raw, dt_s)
        z, a = np.zeros(2), np.zeros(7)
        if self._homing:
            hold: str | None = "moving-home"
            a = self._way_home(dt_s)
        elif not h.any():
            hold = "silent" if silent and raw.any() else "released"
        else:
            hold = None
            s = self._simulation.q
            z = drive.mapping.z(h, s)
            a = drive.mapping.controller.decode(z, s)
            # One factor for all joints, so that the hand keeps its direction.
            a = a / max(1.0, float(np.max(np.abs(a) / QD_MAX)))
            if self._leaves(a):
                hold, a = "edge", np.zeros(7)
        if a.any():
            self._simulation.set_target(self._simulation.target + a * dt_s)
        self._simulation.step(dt_s)
        self._hold = hold
        hand = self._simulation.hand
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
                ]
            )
        )
        self._picture()

    def _way_home(self, dt_s: float) -> np.ndarray:
        way = self.task.home_q - self._simulation.target
        farthest = float(np.max(np.abs(way)))
        if farthest < 1e-3:
            self._homing = False
            return np.zeros(7)
        velocity: np.ndarray = way / max(dt_s, farthest / _HOME_SPEED)
        return velocity

    def _leaves(self, a: np.ndarray) -> bool:
        """Whether ``a`` takes the hand further out of the task's area."""
        low, high = self.task.workspace
        at = self._simulation.hand.position
        way = self._simulation.hand_velocity(a)
        over = (at[:2] > high + _EDGE_MARGIN_M) & (way[:2] > 0)
        under = (at[:2] < low - _EDGE_MARGIN_M) & (way[:2] < 0)
        off = at[2] - self.task.height_m
        return bool(over.any() or under.any() or (abs(off) > _HEIGHT_MARGIN_M and off * way[2] > 0))

    def _picture(self) -> None:
        """Tell the picture, if there is anything to see."""
        q = self._simulation.q
        if not np.abs(q - self._shown_q).max() < 1e-5:
            self._shown_q = q
            self.scene.show_arm(q, self._simulation.hand.position)

    # What pages hear.

    def status(self, tab: str, now_s: float) -> StatusOut:
        """What the arm is doing, for this tab."""
        playback, mode = None, "idle"
        if self._drive is not None:
            mode = "driving"
        elif self._show is not None and not self._show.is_over(now_s):
            mode = "showing"
            playback = PlaybackOut(query_id=self._show.query_id, fraction=self._show.at(now_s)[1])
        x, y, z = (round(float(v), 4) for v in self._simulation.hand.position)
        return StatusOut(
            mode=mode,  # type: ignore[arg-type]
            has_stick=self.has_stick(tab),
            strategy=None if self._drive is None else self._drive.strategy,
            drive_id=None if self._drive is None else self._drive.log.drive_id,
            hold=None if self._drive is None else self._hold,  # type: ignore[arg-type]
            stick=(float(self._raw[0]), float(self._raw[1])),
            hand=(x, y, z),
            playback=playback,
        )
