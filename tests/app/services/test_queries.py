import uuid

import pytest

from app.errors import IdReused, UnknownQuery, WrongStep
from app.schemas.protocol import TaskProtocol
from app.services import flow, queries
from app.storage import participants
from app.storage.database import Database
from app.storage.tables import AnswerRow
from tests.app.factories import make_answer, make_participant

WANTED = 7
PLANE = TaskProtocol(task="plane", labels=WANTED)
DRAWN = WANTED * queries.SPARE_FACTOR


def test_an_answer_sent_again_is_one_row(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        query = participants.queries_of(db, participant.id, "plane")[0]
        answer = make_answer(query)
        assert queries.record(db, participant, flow.here(db, participant), answer)
        assert not queries.record(db, participant, flow.here(db, participant), answer)
        assert db.query(AnswerRow).count() == 1


def test_an_id_with_other_contents_is_refused(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        first, second = participants.queries_of(db, participant.id, "plane")[:2]
        answer = make_answer(first)
        queries.record(db, participant, flow.here(db, participant), answer)
        for changed in (
            make_answer(first, h=(0.4, 0.0), id=answer.id),
            make_answer(second, id=answer.id),
            make_answer(first, h=None, id=answer.id),
        ):
            with pytest.raises(IdReused):
                queries.record(db, participant, flow.here(db, participant), changed)


def test_a_changed_answer_counts_and_the_earlier_one_is_kept(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        query = participants.queries_of(db, participant.id, "plane")[0]
        queries.record(
            db, participant, flow.here(db, participant), make_answer(query, h=(1.0, 0.0))
        )
        queries.record(
            db, participant, flow.here(db, participant), make_answer(query, h=(0.0, 1.0))
        )
        (label,) = queries.labels_of(queries.asked(db, participant, PLANE))
        assert (label[1].h_x, label[1].h_y) == (0.0, 1.0)
        assert db.query(AnswerRow).count() == 2


def test_each_cannot_say_brings_one_more_question(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        rows = participants.queries_of(db, participant.id, "plane")
        assert len(queries.asked(db, participant, PLANE)) == WANTED
        for answered, query in enumerate(rows, start=1):
            queries.record(db, participant, flow.here(db, participant), make_answer(query, h=None))
            shown = len(queries.asked(db, participant, PLANE))
            assert shown == min(WANTED + answered, DRAWN)


def test_training_waits_until_everything_asked_is_answered(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        rows = participants.queries_of(db, participant.id, "plane")
        queries.record(db, participant, flow.here(db, participant), make_answer(rows[0], h=None))
        for query in rows[1:WANTED]:
            queries.record(db, participant, flow.here(db, participant), make_answer(query))
            assert not queries.is_complete(queries.asked(db, participant, PLANE))
        queries.record(db, participant, flow.here(db, participant), make_answer(rows[WANTED]))
        assert queries.is_complete(queries.asked(db, participant, PLANE))


def test_someone_who_can_say_nothing_is_told_what_is_missing(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        rows = participants.queries_of(db, participant.id, "plane")
        for query in rows:
            queries.record(db, participant, flow.here(db, participant), make_answer(query, h=None))
        questions = queries.asked(db, participant, PLANE)
        assert not queries.is_complete(questions)
        assert "at least 5 moves" in (queries.notice(questions) or "")
        for query in rows[:5]:
            queries.record(db, participant, flow.here(db, participant), make_answer(query))
        questions = queries.asked(db, participant, PLANE)
        assert len(queries.labels_of(questions)) == 5
        assert queries.notice(questions) is None


def test_queries_of_others_and_of_nobody_are_refused(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=DRAWN)
        other = make_participant(db, step="queries", moves=DRAWN)
        theirs = participants.queries_of(db, other.id, "plane")[0]
        not_yet_asked = participants.queries_of(db, participant.id, "plane")[WANTED]
        for query_id in (theirs.id, not_yet_asked.id, str(uuid.uuid4())):
            with pytest.raises(UnknownQuery):
                queries.record(
                    db,
                    participant,
                    flow.here(db, participant),
                    make_answer(theirs, query_id=query_id),
                )
        assert db.query(AnswerRow).count() == 0


@pytest.mark.parametrize("step", ["consent", "practice", "training", "driving"])
def test_answers_count_only_while_questions_are_asked(database: Database, step: str) -> None:
    with database.write() as db:
        participant = make_participant(db, step=step, moves=DRAWN)
        query = participants.queries_of(db, participant.id, "plane")[0]
        with pytest.raises(WrongStep):
            queries.record(db, participant, flow.here(db, participant), make_answer(query))
        assert db.query(AnswerRow).count() == 0
