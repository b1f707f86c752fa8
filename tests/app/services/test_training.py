from pathlib import Path

import pytest

from app.errors import WrongStep
from app.schemas.protocol import TaskProtocol
from app.services import flow, queries, training
from app.services.training import TrainedAlignment, TrainingOutcome
from app.settings import Settings
from app.storage import jobs, participants
from app.storage.database import Database
from app.storage.tables import AlignmentRow, JobRow
from tests.app.factories import make_answer, make_participant

SETTINGS = Settings()
PLANE = TaskProtocol(task="plane", labels=7)
OUTCOME = TrainingOutcome(
    (TrainedAlignment("all-priors", "file", "sha", "c", {}, "code"),), {"all-priors": {}}, 0.4
)


def queued_job(database: Database) -> str:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=14)
        for query in participants.queries_of(db, participant.id, "plane")[:7]:
            queries.record(db, participant, flow.here(db, participant), make_answer(query))
        questions = queries.asked(db, participant, PLANE)
        return training.enqueue(db, participant, PLANE, questions).id


def state_of(database: Database, job_id: str) -> tuple[str, int, int]:
    with database.read() as db:
        job = db.get_one(JobRow, job_id)
        return job.state, job.attempt, db.query(AlignmentRow).count()


def test_a_claimed_job_hands_over_the_answers(database: Database) -> None:
    queued_job(database)
    with database.write() as db:
        order = training.claim(db, SETTINGS, Path("folder"))
        assert order is not None
        assert order.labels.states.shape == (7, 7)
        assert order.labels.human_inputs.tolist() == [[0.5, -0.5]] * 7
        assert order.labels.next_states[:, 0] == pytest.approx([0.1 * i for i in range(1, 8)])
        assert training.claim(db, SETTINGS, Path("folder")) is None


def test_an_outcome_is_registered_once(database: Database) -> None:
    job_id = queued_job(database)
    with database.write() as db:
        training.claim(db, SETTINGS, Path("folder"))
    for expected in (True, False):
        with database.write() as db:
            assert training.finish(db, job_id, 1, OUTCOME) is expected
    assert state_of(database, job_id) == ("succeeded", 1, 1)


def test_an_attempt_that_no_longer_counts_registers_nothing(database: Database) -> None:
    job_id = queued_job(database)
    with database.write() as db:
        training.claim(db, SETTINGS, Path("folder"))
        training.give_up_attempt(db, job_id, 1)
        training.claim(db, SETTINGS, Path("folder"))
        assert not training.finish(db, job_id, 1, OUTCOME)
    assert state_of(database, job_id) == ("running", 2, 0)


def test_a_job_is_given_up_after_three_attempts_and_can_be_tried_again(
    database: Database,
) -> None:
    job_id = queued_job(database)
    for attempt in range(1, training.ATTEMPTS + 1):
        with database.write() as db:
            training.claim(db, SETTINGS, Path("folder"))
            training.give_up_attempt(db, job_id, attempt)
    assert state_of(database, job_id) == ("failed", 3, 0)
    with database.write() as db:
        participant = participants.everyone(db)[0]
        assert training.status(db, participant, flow.here(db, participant)).error == training.FAILED
        training.retry(db, participant, "plane")
    assert state_of(database, job_id) == ("queued", 0, 0)


def test_a_started_server_queues_again_what_a_dead_one_ran(database: Database) -> None:
    job_id = queued_job(database)
    with database.write() as db:
        training.claim(db, SETTINGS, Path("folder"))
    with database.write() as db:
        training.recover(db)
    assert state_of(database, job_id) == ("queued", 1, 0)


def test_the_same_answers_are_never_queued_twice(database: Database) -> None:
    queued_job(database)
    with database.read() as db:
        participant = participants.everyone(db)[0]
        first = jobs.of_task(db, participant.id, "plane")
        assert first is not None
        again = training.data_hash(participant, queries.asked(db, participant, PLANE))
        assert again == first.data_hash


def test_other_answers_have_another_hash(database: Database) -> None:
    queued_job(database)
    with database.write() as db:
        participant = participants.everyone(db)[0]
        before = training.data_hash(participant, queries.asked(db, participant, PLANE))
        query = participants.queries_of(db, participant.id, "plane")[3]
        queries.record(
            db, participant, flow.here(db, participant), make_answer(query, h=(0.5, -0.500001))
        )
        assert training.data_hash(participant, queries.asked(db, participant, PLANE)) != before


def test_there_is_no_training_before_the_answers(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries")
        with pytest.raises(WrongStep):
            training.status(db, participant, flow.here(db, participant))
        with pytest.raises(WrongStep):
            training.retry(db, participant, "plane")
