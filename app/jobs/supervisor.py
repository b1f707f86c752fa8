"""Keeps the trainings going: claims queued jobs, hands them to worker processes, keeps the outcome.

The database is the truth and this server its only writer; a worker gets a frozen order and writes
files. So a killed worker costs one attempt, a killed server none of the answers, and a job ends
once: an outcome counts only while its attempt is the one that runs.
"""

import asyncio
import contextlib
import json
import logging
from pathlib import Path

from pebble import ProcessPool

from app.jobs import worker
from app.services import training
from app.services.training import TrainingOrder, TrainingOutcome
from app.settings import Settings
from app.storage import jobs
from app.storage.database import Database
from app.worker_pool import new_pool

_LOG = logging.getLogger(__name__)
_POLL_S = 0.05
_TIME_LIMIT_S = 120.0
_RETRY_S = 1.0


class Supervisor:
    """Runs on the event loop; everything slow happens in threads and processes."""

    def __init__(self, database: Database, settings: Settings) -> None:
        """Prepare; ``run`` begins."""
        self._database = database
        self._settings = settings
        self._folder = settings.data_dir / "alignments"
        self._wanted = asyncio.Event()
        self._pool = self._new_pool()

    def wake(self) -> None:
        """There may be a new job. Call it on the event loop, after the commit."""
        self._wanted.set()

    def recover(self) -> None:
        """Before the server opens: queue again what a dead one left running, sweep its files."""
        self._folder.mkdir(parents=True, exist_ok=True)
        with self._database.write() as db:
            training.recover(db)
            kept = jobs.alignment_files(db)
        for path in self._folder.iterdir():
            if path.stem not in kept:
                path.unlink()

    async def run(self) -> None:
        """Serve the queue until cancelled."""
        await asyncio.to_thread(self._start_workers)
        free = asyncio.Semaphore(self._settings.training_workers)
        try:
            async with asyncio.TaskGroup() as tasks:
                while True:
                    await free.acquire()
                    order = await self._next()
                    tasks.create_task(self._carry_out(order, free))
        finally:
            await asyncio.to_thread(self._close)

    async def _next(self) -> TrainingOrder:
        """Wait for a job and claim it."""
        while True:
            try:
                order = await asyncio.to_thread(self._claim)
            except Exception:
                # A full disk, say. The queue is in the database and can wait.
                _LOG.exception("no job could be claimed; trying again")
                await asyncio.sleep(_RETRY_S)
                continue
            if order is not None:
                return order
            await self._wanted.wait()
            self._wanted.clear()

    async def _carry_out(self, order: TrainingOrder, free: asyncio.Semaphore) -> None:
        """Train, and keep what came of it; nothing that goes wrong here stops the next one."""
        progress = order.folder / f"{order.name}.progress"
        try:
            try:
                outcome = await self._train(order, progress)
            except Exception as error:
                # Whatever a worker died of, the answers are safe and the attempt is over.
                _LOG.warning("training %s came to nothing: %r", order.name, error)
                await asyncio.to_thread(self._give_up, order)
            else:
                await asyncio.to_thread(self._finish, order, outcome)
        except Exception:
            # It stays marked as running, and is queued again when the server starts anew.
            _LOG.exception("the end of training %s could not be kept", order.name)
        finally:
            progress.unlink(missing_ok=True)
            free.release()
            self.wake()  # a failed attempt is queued again

    async def _train(self, order: TrainingOrder, progress: Path) -> TrainingOutcome:
        if not self._pool.active:
            # Something beside the workers was killed; what is left of the pool is of no use.
            await asyncio.to_thread(self._close)
            self._pool = self._new_pool()
        # In a thread: it waits for what starts the workers, should that have to start itself.
        done = asyncio.wrap_future(
            await asyncio.to_thread(
                self._pool.schedule, worker.train, args=(order,), timeout=_TIME_LIMIT_S
            )
        )
        seen = 0.0
        while not done.done():
            await asyncio.wait({done}, timeout=_POLL_S)
            seen = await asyncio.to_thread(self._note_progress, order, progress, seen)
        outcome: TrainingOutcome = done.result()
        return outcome

    def _new_pool(self) -> ProcessPool:
        return new_pool(
            self._settings.training_workers,
            worker.__name__,
            worker.prepare,
            str(self._settings.pack_dir),
            self._settings.task,
        )

    def _start_workers(self) -> None:
        # A first, empty task starts the workers, so that nobody waits for their imports.
        for _ in range(self._settings.training_workers):
            self._pool.schedule(worker.stand_by)

    def _close(self) -> None:
        self._pool.stop()  # type: ignore[no-untyped-call]
        self._pool.join()

    def _claim(self) -> TrainingOrder | None:
        with self._database.write() as db:
            return training.claim(db, self._settings, self._folder)

    def _note_progress(self, order: TrainingOrder, path: Path, seen: float) -> float:
        with contextlib.suppress(FileNotFoundError):
            progress = json.loads(path.read_text())
            if progress["fraction"] > seen:
                with self._database.write() as db:
                    training.note_progress(
                        db, order.job_id, order.attempt, progress["fraction"], progress["report"]
                    )
                return float(progress["fraction"])
        return seen

    def _finish(self, order: TrainingOrder, outcome: TrainingOutcome) -> None:
        with self._database.write() as db:
            training.finish(db, order.job_id, order.attempt, outcome)

    def _give_up(self, order: TrainingOrder) -> None:
        with self._database.write() as db:
            training.give_up_attempt(db, order.job_id, order.attempt)
