"""A drive or a move, shown again tick by tick: no physics, only what was written down."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from sqlalchemy.orm import Session

from app.errors import JoymapError
from app.scene.arm_scene import ArmScene
from app.schemas.replay import ReplayStatusOut
from app.services import records
from app.services.records import Motion, Move
from app.storage.database import Database
from app.storage.ticks import COLUMNS, HOLDS
from models.panda_pack import PandaPack
from models.simulation import HandState

_AT = {name: index for index, name in enumerate(COLUMNS)}
_Q = slice(_AT["q_1"], _AT["q_7"] + 1)
_HAND = slice(_AT["hand_x"], _AT["hand_z"] + 1)
_STICK = slice(_AT["raw_x"], _AT["raw_y"] + 1)
MOST = 8  # replays at once
Kind = Literal["drives", "moves"]
_READ: dict[Kind, Callable[[Session, str], Motion]] = {
    "drives": records.read,
    "moves": records.read_move,
}


class TooManyReplays(JoymapError):
    """More pictures than the server draws beside the live ones."""

    status_code = 503
    kind = "too-many-replays"

    def __init__(self) -> None:
        """Say what to do."""
        super().__init__(f"{MOST} replays are being shown already; please close one of them.")


class Replay:
    """One page's look at one record. Knows no clock: time comes as an argument."""

    def __init__(self, record: Motion, scene: ArmScene) -> None:
        """Show the first tick, standing still; of a move, its end and its way as well."""
        self._record, self.scene = record, scene
        self._times_s = record.rows[:, 0] - record.rows[0, 0]
        self._at_s, self._last_s = 0.0, 0.0
        self.is_playing, self.speed = False, 1.0
        self.tick = -1
        if isinstance(record, Move):
            scene.show_move(record.end, record.rows[:, _HAND])
        self._show(0)

    def play(self, now_s: float) -> None:
        """Go on from here; from the start, if this is the end."""
        if self.tick == len(self._times_s) - 1:
            self.seek(0)
        self.is_playing, self._last_s = True, now_s

    def pause(self) -> None:
        """Stand still."""
        self.is_playing = False

    def seek(self, tick: int) -> None:
        """Show that tick, or the nearest there is."""
        self._show(min(max(tick, 0), len(self._times_s) - 1))
        self._at_s = float(self._times_s[self.tick])

    def advance(self, now_s: float) -> None:
        """Let time pass up to ``now_s``."""
        if not self.is_playing:
            return
        self._at_s += (now_s - self._last_s) * self.speed
        self._last_s = now_s
        self._show(int(np.searchsorted(self._times_s, self._at_s, side="right")) - 1)
        if self.tick == len(self._times_s) - 1:
            self.is_playing = False

    def status(self) -> ReplayStatusOut:
        """What is shown."""
        row = self._record.rows[self.tick]
        hold = int(row[_AT["hold"]])
        x, y, z = row[_HAND].round(4).tolist()
        return ReplayStatusOut(
            tick=self.tick,
            ticks=len(self._times_s),
            time_s=round(float(self._times_s[self.tick]), 3),
            duration_s=round(float(self._times_s[-1]), 3),
            is_playing=self.is_playing,
            speed=self.speed,
            stick=tuple(row[_STICK].tolist()),
            hand=(x, y, z),
            hold=None if hold == 0 else HOLDS[hold - 1],
            is_touching=bool(row[_AT["touching"]] > 0.0),
        )

    def _show(self, tick: int) -> None:
        if tick == self.tick:
            return
        self.tick = tick
        row, cup = self._record.rows[tick], self._record.cups[tick]
        self.scene.show_arm(row[_Q], row[_HAND])
        if cup.size:
            pose = HandState(cup[:3], cup[3:])
            self.scene.show_props(pose, self._record.beads[tick])


@dataclass
class _View:
    replay: Replay
    users: int = 0


class Replays:
    """The replays that pages look at. All methods are for the event loop."""

    def __init__(self, database: Database, pack: PandaPack) -> None:
        """Begin empty."""
        self._database, self._pack = database, pack
        self._views: dict[tuple[str, str, str], _View] = {}
        self._opening = asyncio.Lock()

    @contextlib.asynccontextmanager
    async def view(self, kind: Kind, motion_id: str, name: str) -> AsyncGenerator[Replay]:
        """The replay that a page knows by a name, for as long as the page is there.

        Raises:
            NoSuchDrive: If there is none.
            NoSuchMove: If there is none.
            NothingRecorded: If it has no ticks.
            TooManyReplays: If too many are shown already.
        """
        key = (kind, motion_id, name)
        async with self._opening:
            if key not in self._views:
                if len(self._views) >= MOST:
                    raise TooManyReplays
                record = await asyncio.to_thread(self._read, kind, motion_id)
                self._views[key] = _View(Replay(record, ArmScene(self._pack, record.task)))
            view = self._views[key]
            view.users += 1
        try:
            yield view.replay
        finally:
            view.users -= 1
            if view.users == 0:
                del self._views[key]
                view.replay.scene.close()

    def _read(self, kind: Kind, motion_id: str) -> Motion:
        with self._database.read() as db:
            return _READ[kind](db, motion_id)
