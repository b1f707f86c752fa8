"""The live sessions: made when a page comes, closed when nobody has looked for a while."""

import asyncio
import logging
import time

import numpy as np

from app.scene.arm_scene import ArmScene
from app.services import flow, queries, stick
from app.services.drives import OpenedDrive
from app.settings import Settings
from app.storage import drives
from app.storage.database import Database
from app.storage.tables import ParticipantRow
from app.storage.ticks import COLUMNS, unpack
from app.teleop.live_session import LiveSession
from app.teleop.loop import ControlLoop
from app.teleop.recorder import DriveLog, Recorder
from models.alignment import Alignment
from models.arm_kinematics import ArmKinematics
from models.checkpoints import load_alignment
from models.controller import LatentController
from models.fitting import AlignmentContext
from models.kinematics import Kinematics
from models.mapping import Mapping
from models.panda_pack import PandaPack
from models.simulation import Simulation
from models.strategies import get_strategy
from models.tasks import get_task

_LOG = logging.getLogger(__name__)
_Q = slice(COLUMNS.index("q_1"), COLUMNS.index("q_7") + 1)


class LiveSessions:
    """Everything that is live. All methods are for the event loop."""

    def __init__(
        self,
        settings: Settings,
        database: Database,
        pack: PandaPack,
        controllers: dict[str, LatentController],
        kinematics: Kinematics,
    ) -> None:
        """Begin empty."""
        self._settings = settings
        self._database = database
        self._pack = pack
        self._controllers = controllers
        self._kinematics = kinematics
        self._arm = ArmKinematics(kinematics, pack)
        self.loop = ControlLoop(settings.teleop_rate_hz)
        self.recorder = Recorder(database)
        self._opening = asyncio.Lock()
        self._following = asyncio.Lock()
        self._unseen_since: dict[str, float] = {}

    def now_s(self) -> float:
        """The arms' own clock, in [s]: the machine's monotonic one, or faster for rehearsals."""
        return time.monotonic() * self._settings.speed

    async def session(self, participant: ParticipantRow) -> LiveSession:
        """The participant's live session at the task they are at, made if there is none."""
        async with self._opening:
            at = await asyncio.to_thread(self._here, participant.id)
            session = self._at_task(participant.id, at.task.task)
            if session is None:
                task = get_task(at.task.task)
                start = await asyncio.to_thread(self._last_pose, participant.id, task.name)
                simulation = await asyncio.to_thread(Simulation, self._pack, task.props)
                session = LiveSession(
                    participant.id,
                    simulation,
                    ArmScene(self._pack, task),
                    task,
                    silence_s=self._settings.silence_s,
                    start=task.home_q if start is None else start,
                    limit_s=at.task.time_limit_s,
                    waits_s=at.protocol.drive_waits_s,
                    auto_grasp=at.task.auto_grasp,
                    arrows=at.protocol.arrows,
                )
                self.loop.sessions[participant.id] = session
                await self.follow_settings(participant.id)
            return session

    def stop_drive(self, participant_id: str) -> None:
        """End an attempt that goes on: the participant goes on to something else."""
        session = self.existing(participant_id)
        if session is not None and session.is_trying:
            session.stop_drive("switched")

    async def follow_step(self, participant_id: str) -> None:
        """Close the participant's session if they are at another task now; pages reconnect."""
        async with self._opening:
            if self.existing(participant_id) is not None:
                at = await asyncio.to_thread(self._here, participant_id)
                self._at_task(participant_id, None if at.has_left else at.task.task)

    def _at_task(self, participant_id: str, task: str | None) -> LiveSession | None:
        """The session if it is at this task; one at another is closed."""
        session = self.existing(participant_id)
        if session is not None and session.task.name != task:
            session.close("switched" if task is not None else "left")
            del self.loop.sessions[participant_id]
            self._unseen_since.pop(participant_id, None)
            return None
        return session

    def all(self) -> list[LiveSession]:
        """Every session there is."""
        return list(self.loop.sessions.values())

    def connected(self) -> set[str]:
        """The ids of those who have a page open."""
        return {session.participant_id for session in self.all() if session.pages}

    def existing(self, participant_id: str) -> LiveSession | None:
        """The participant's live session, if there is one."""
        return self.loop.sessions.get(participant_id)

    async def follow_settings(self, participant_id: str) -> None:
        """Steady the stick as the participant has it set now, if they have a live session."""
        # Read and set by turns: of two changes at once, the one committed last stays.
        async with self._following:
            session = self.existing(participant_id)
            if session is not None:
                session.be_steady(await asyncio.to_thread(self._is_steady, participant_id))

    async def show(self, session: LiveSession, query_id: str) -> None:
        """Play the move of one of the participant's questions."""
        path, hand_path = await asyncio.to_thread(self._read_move, session.participant_id, query_id)
        session.show(query_id, path, hand_path, self.now_s())

    async def start_drive(self, participant: ParticipantRow, opened: OpenedDrive) -> None:
        """Let the person drive."""
        session = await self.session(participant)
        if session.drive_id == opened.id or session.task.name != opened.task:
            return
        controller = self._controllers[opened.task]
        context = AlignmentContext(session.task, self._arm, controller)
        alignment = await asyncio.to_thread(self._alignment, opened, context)
        async with self._opening:
            if session.drive_id == opened.id:
                return
            simulation = session.prepare()
            # Where an attempt begins is searched for; the other arms must not wait for that.
            chance = np.random.default_rng(list(opened.id.encode()))
            arm = ArmKinematics(self._kinematics, self._pack)
            attempt = await asyncio.to_thread(session.task.begin, simulation, arm, chance)
            session.start_drive(
                None if opened.is_blinded else opened.strategy,
                Mapping(controller, alignment),
                DriveLog(self.recorder, opened.id, 0, self._settings.record_chunk_s),
                attempt,
            )
            # Their page may have been away while the robot learned; it is waited for from now on.
            self._unseen_since.pop(participant.id, None)

    async def run(self) -> None:
        """Tick, record, and close what nobody looks at, until cancelled."""
        recording = asyncio.create_task(self.recorder.run())
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self.loop.run(self.now_s, self._settings.speed))
                tasks.create_task(self._close_unseen())
        finally:
            for session in self.loop.sessions.values():
                session.close("server stopped")
            recording.cancel()
            await asyncio.gather(recording, return_exceptions=True)

    async def _close_unseen(self) -> None:
        while True:
            await asyncio.sleep(1.0)
            now = time.monotonic()
            for participant_id, session in tuple(self.loop.sessions.items()):
                if session.pages:
                    self._unseen_since.pop(participant_id, None)
                    continue
                unseen_s = now - self._unseen_since.setdefault(participant_id, now)
                if unseen_s > session.waits_s:
                    session.stop_drive("left")
                if unseen_s > self._settings.session_idle_s and not session.scene.viewers:
                    session.close("left")
                    del self.loop.sessions[participant_id]
                    del self._unseen_since[participant_id]

    def _read_move(self, participant_id: str, query_id: str) -> tuple[np.ndarray, np.ndarray]:
        with self._database.read() as db:
            query = queries.find(db, participant_id, query_id)
            return queries.as_path(query), np.asarray(query.hand_path, dtype=float)

    def _alignment(self, opened: OpenedDrive, context: AlignmentContext) -> Alignment:
        if opened.alignment_file is None:
            return get_strategy(opened.used).method.from_arrays({}, context)
        folder = self._settings.data_dir / "alignments"
        return load_alignment(folder / opened.alignment_file, context)

    def _is_steady(self, participant_id: str) -> bool:
        with self._database.read() as db:
            return stick.settings_of(db.get_one(ParticipantRow, participant_id)).steady

    def _here(self, participant_id: str) -> flow.Here:
        with self._database.read() as db:
            return flow.here(db, db.get_one(ParticipantRow, participant_id))

    def _last_pose(self, participant_id: str, task: str) -> np.ndarray | None:
        """Where the arm was when this participant last drove at the task, ``(7,)`` in [rad]."""
        with self._database.read() as db:
            chunk = drives.last_chunk(db, participant_id, task)
            return None if chunk is None else unpack(chunk.samples)[-1, _Q].copy()
