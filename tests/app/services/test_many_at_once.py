"""Nothing doubled, nothing lost, nothing locked, however many send at once and however often."""

import random
import threading
import uuid
from typing import Any

from app.errors import IdReused
from app.schemas.participants import AnswerIn
from app.services import queries
from app.storage import participants
from app.storage.database import Database
from app.storage.tables import AnswerRow, AuditRow, ParticipantRow
from tests.app.factories import make_answer, make_participant, now

QUESTIONS = 14
SENT = 1000


def in_threads(count: int, work: Any) -> list[BaseException]:
    """Let so many threads do it at once; what went wrong."""
    wrong: list[BaseException] = []
    start = threading.Barrier(count)

    def run(index: int) -> None:
        start.wait()
        try:
            work(index)
        except BaseException as error:
            wrong.append(error)

    threads = [threading.Thread(target=run, args=(index,)) for index in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return wrong


def test_answers_sent_one_to_five_times_from_two_tabs_are_each_one_row(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="queries", moves=QUESTIONS)
        shown = participants.queries_of(db, participant.id, "plane")[:7]
        answers = [make_answer(random.choice(shown)) for _ in range(SENT)]
        participant_id = participant.id
    sent = [answer for answer in answers for _ in range(random.Random(1).randint(1, 5))]
    refused = []

    def tab(index: int) -> None:
        mine = list(sent)
        random.Random(index).shuffle(mine)
        for answer in mine:
            send(answer)

    def send(answer: AnswerIn) -> None:
        with database.write() as db:
            try:
                queries.record(db, db.get_one(ParticipantRow, participant_id), answer)
            except IdReused:
                refused.append(answer)

    assert in_threads(2, tab) == []
    assert refused == []
    with database.read() as db:
        kept = {row.id for row in db.query(AnswerRow)}
    assert kept == {str(answer.id) for answer in answers}
    assert len(kept) == SENT


def test_two_hundred_writers_at_once_are_all_served(database: Database) -> None:
    def write(index: int) -> None:
        for _ in range(5):
            with database.write() as db:
                detail = {"by": index}
                db.add(AuditRow(at=now(), action="test", subject=str(uuid.uuid4()), detail=detail))

    assert in_threads(200, write) == []
    with database.read() as db:
        assert db.query(AuditRow).count() == 1000
