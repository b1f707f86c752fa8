"""The supervisor with a pool that does what the test says: no worker, no server."""

import asyncio
import json
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from pebble import ProcessExpired
from sqlalchemy.orm import undefer

from app.jobs import worker
from app.jobs.supervisor import Supervisor
from app.schemas.protocol import TaskProtocol
from app.services import flow, queries, training
from app.services.training import TrainedAlignment, TrainingOrder, TrainingOutcome
from app.settings import Settings
from app.storage import jobs, participants
from app.storage.database import Database
from app.storage.tables import JobRow
from tests.app.factories import make_answer, make_participant

PLANE = TaskProtocol(task="plane", labels=7)
PATIENCE_S = 60.0
Work = Callable[[TrainingOrder], TrainingOutcome | Future[TrainingOutcome]]


def outcome_of(order: TrainingOrder) -> TrainingOutcome:
    name = f"{order.name}-all-priors"
    trained = TrainedAlignment("all-priors", name, "sha", "c", {}, "code")
    return TrainingOutcome((trained,), {"all-priors": {"curve": []}}, 0.4)


class FakePool:
    """Runs an order at once, as ``work`` says; a future that it gives ends the training later."""

    def __init__(self, work: Work, orders: list[TrainingOrder]) -> None:
        self._work = work
        self._orders = orders
        self.active = True
        self.is_stopped = False

    def schedule(
        self, function: Any, args: tuple[Any, ...] = (), timeout: float | None = None
    ) -> Future[TrainingOutcome]:
        future: Future[Any] = Future()
        if function is worker.stand_by:
            future.set_result(None)
            return future
        (order,) = args
        self._orders.append(order)
        try:
            done = self._work(order)
        except Exception as error:
            future.set_exception(error)
            return future
        if isinstance(done, Future):
            return done
        future.set_result(done)
        return future

    def stop(self) -> None:
        self.is_stopped = True

    def join(self) -> None:
        pass


class Office:
    """A supervisor, its database and its pool."""

    def __init__(self, database: Database, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.database = database
        self.settings = Settings(data_dir=folder, training_workers=1)
        self._monkeypatch = monkeypatch

    def queue(self) -> str:
        with self.database.write() as db:
            participant = make_participant(db, step="queries", moves=14)
            for query in participants.queries_of(db, participant.id, "plane")[:7]:
                queries.record(db, participant, flow.here(db, participant), make_answer(query))
            asked = queries.asked(db, participant, PLANE)
            return training.enqueue(db, participant, PLANE, asked).id

    def job(self, job_id: str) -> JobRow:
        with self.database.read() as db:
            job = db.get_one(JobRow, job_id, options=[undefer(JobRow.report)])
            db.expunge(job)
            return job

    def is_over(self, job_id: str) -> bool:
        return self.job(job_id).state in ("succeeded", "failed")

    def files(self) -> set[str]:
        with self.database.read() as db:
            return jobs.alignment_files(db)

    def supervise(self, work: Work, until: Callable[[], bool]) -> list[TrainingOrder]:
        """Let it run until something holds; the orders that it gave meanwhile."""
        self.pools: list[FakePool] = []
        orders: list[TrainingOrder] = []

        def new_pool(*_: object) -> FakePool:
            self.pools.append(FakePool(work, orders))
            return self.pools[-1]

        self._monkeypatch.setattr("app.jobs.supervisor.new_pool", new_pool)
        supervisor = Supervisor(self.database, self.settings)
        supervisor.recover()

        async def run() -> None:
            running = asyncio.create_task(supervisor.run())
            async with asyncio.timeout(PATIENCE_S):
                while not until():
                    await asyncio.sleep(0.01)
            running.cancel()
            with pytest.raises(asyncio.CancelledError):
                await running

        asyncio.run(run())
        assert all(pool.is_stopped for pool in self.pools)
        return orders


@pytest.fixture
def office(database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Office:
    return Office(database, tmp_path, monkeypatch)


def test_a_queued_training_is_claimed_carried_out_and_registered(office: Office) -> None:
    job_id = office.queue()
    (order,) = office.supervise(outcome_of, lambda: office.is_over(job_id))
    assert (order.job_id, order.attempt, len(order.labels)) == (job_id, 1, 7)
    assert order.folder == office.settings.data_dir / "alignments"
    job = office.job(job_id)
    assert (job.state, job.attempt, job.fraction, job.training_s) == ("succeeded", 1, 1.0, 0.4)
    assert job.report == {"all-priors": {"curve": []}}
    assert office.files() == {f"{job_id}-1-all-priors"}


def test_trainings_are_carried_out_in_the_order_of_the_queue(office: Office) -> None:
    queued = [office.queue() for _ in range(3)]
    orders = office.supervise(outcome_of, lambda: office.is_over(queued[-1]))
    assert [order.job_id for order in orders] == queued


def test_no_more_trainings_go_on_at_a_time_than_there_are_workers(office: Office) -> None:
    office.settings = office.settings.model_copy(update={"training_workers": 2})
    queued = [office.queue() for _ in range(3)]
    going_on: dict[str, Future[TrainingOutcome]] = {}

    def work(order: TrainingOrder) -> Future[TrainingOutcome]:
        going_on[order.job_id] = Future()
        return going_on[order.job_id]

    looks = 0

    def until() -> bool:
        nonlocal looks
        looks += 1
        return len(going_on) > 1 and looks > 20

    orders = office.supervise(work, until)
    assert [order.job_id for order in orders] == queued[:2]
    assert [office.job(job_id).state for job_id in queued] == ["running", "running", "queued"]


def test_the_outcome_of_an_attempt_that_no_longer_counts_is_not_registered(office: Office) -> None:
    job_id = office.queue()

    def work(order: TrainingOrder) -> TrainingOutcome:
        if order.attempt == 1:
            with office.database.write() as db:
                training.give_up_attempt(db, job_id, 1)
        return outcome_of(order)

    orders = office.supervise(work, lambda: office.is_over(job_id))
    assert [order.attempt for order in orders] == [1, 2]
    assert office.files() == {f"{job_id}-2-all-priors"}


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_dies_costs_one_attempt(office: Office, workers: int) -> None:
    office.settings = office.settings.model_copy(update={"training_workers": workers})
    job_id = office.queue()
    first: Future[TrainingOutcome] = Future()
    looks = 0

    def work(order: TrainingOrder) -> TrainingOutcome | Future[TrainingOutcome]:
        return first if order.attempt == 1 else outcome_of(order)

    def until() -> bool:
        nonlocal looks
        looks += 1
        if looks == 20:  # by now everybody waits
            first.set_exception(ProcessExpired("Abnormal termination"))
        return office.is_over(job_id)

    orders = office.supervise(work, until)
    assert [order.attempt for order in orders] == [1, 2]
    assert office.job(job_id).state == "succeeded"
    assert office.files() == {f"{job_id}-2-all-priors"}


def test_a_training_that_never_ends_well_fails_with_a_sentence(office: Office) -> None:
    first, second = office.queue(), office.queue()

    def work(order: TrainingOrder) -> TrainingOutcome:
        if order.job_id == first:
            raise ValueError("no such number")
        return outcome_of(order)

    orders = office.supervise(work, lambda: office.is_over(first) and office.is_over(second))
    assert sorted(order.attempt for order in orders if order.job_id == first) == [1, 2, 3]
    job = office.job(first)
    assert (job.state, job.attempt) == ("failed", training.ATTEMPTS)
    assert job.error == "The training did not finish. Your answers are safe; please try again."
    assert office.job(second).state == "succeeded"
    assert office.files() == {f"{second}-1-all-priors"}


def test_a_pool_that_broke_is_replaced(office: Office) -> None:
    job_id = office.queue()

    def work(order: TrainingOrder) -> TrainingOutcome:
        if order.attempt == 1:
            office.pools[-1].active = False
            raise RuntimeError("the pool is broken")
        return outcome_of(order)

    office.supervise(work, lambda: office.is_over(job_id))
    assert len(office.pools) == 2
    assert office.job(job_id).state == "succeeded"


def test_what_a_worker_writes_of_its_progress_is_kept(office: Office) -> None:
    job_id = office.queue()
    done: Future[TrainingOutcome] = Future()

    def progress_of(order: TrainingOrder) -> Path:
        return order.folder / f"{order.name}.progress"

    seen: list[TrainingOrder] = []

    def write(fraction: float) -> None:
        report = {"all-priors": {"curve": [[1, fraction]], "fields": []}}
        scratch = progress_of(seen[0]).with_suffix(".part")
        scratch.write_text(json.dumps({"fraction": fraction, "report": report}))
        scratch.replace(progress_of(seen[0]))

    def work(order: TrainingOrder) -> Future[TrainingOutcome]:
        seen.append(order)
        write(0.25)
        return done

    noted: list[tuple[str, float, Any]] = []

    def until() -> bool:
        job = office.job(job_id)
        if job.fraction and (not noted or job.fraction != noted[-1][1]):
            noted.append((job.state, job.fraction, job.report))
            if job.fraction == 0.25:
                write(0.75)
            elif job.fraction == 0.75:
                done.set_result(outcome_of(seen[0]))
        return job.state in ("succeeded", "failed")  # as it was noted, not as it is by now

    office.supervise(work, until)
    assert [(state, fraction) for state, fraction, _ in noted] == [
        ("running", 0.25),
        ("running", 0.75),
        ("succeeded", 1.0),
    ]
    assert noted[1][2] == {"all-priors": {"curve": [[1, 0.75]], "fields": []}}
    assert not progress_of(seen[0]).exists()


def test_a_database_that_is_busy_holds_up_a_claim_and_loses_none(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    job_id = office.queue()
    claim, failures = training.claim, iter([True, True, False])

    def fails_twice(*given: Any) -> TrainingOrder | None:
        if next(failures, False):
            raise OSError("the disk is full")
        return claim(*given)

    monkeypatch.setattr(training, "claim", fails_twice)
    monkeypatch.setattr("app.jobs.supervisor._RETRY_S", 0.0)
    office.supervise(outcome_of, lambda: office.is_over(job_id))
    assert office.job(job_id).state == "succeeded"


def test_an_end_that_could_not_be_kept_does_not_stop_the_next_training(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = office.queue(), office.queue()
    finish = training.finish

    def fails_for_the_first(db: Any, job_id: str, *given: Any) -> bool:
        if job_id == first:
            raise OSError("the disk is full")
        return finish(db, job_id, *given)

    monkeypatch.setattr(training, "finish", fails_for_the_first)
    office.supervise(outcome_of, lambda: office.is_over(second))
    assert office.job(first).state == "running"  # and queued again by the next start
    assert office.job(second).state == "succeeded"


def test_a_start_queues_again_what_ran_and_sweeps_what_is_not_registered(
    office: Office, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished, cut_off = office.queue(), office.queue()
    folder = office.settings.data_dir / "alignments"
    with office.database.write() as db:
        order = training.claim(db, office.settings, folder)
        assert order is not None
        training.finish(db, finished, 1, outcome_of(order))
        training.claim(db, office.settings, folder)
    folder.mkdir()
    kept = {f"{finished}-1-all-priors.{ending}" for ending in ("safetensors", "json")}
    swept = {f"{cut_off}-1-all-priors.safetensors", f"{cut_off}-1.progress", f"{cut_off}-1.part"}
    for name in kept | swept:
        (folder / name).touch()
    monkeypatch.setattr("app.jobs.supervisor.new_pool", lambda *_: None)
    Supervisor(office.database, office.settings).recover()
    assert {path.name for path in folder.iterdir()} == kept
    assert (office.job(finished).state, office.job(cut_off).state) == ("succeeded", "queued")
