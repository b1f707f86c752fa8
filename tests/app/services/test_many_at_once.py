"""Nothing doubled, nothing lost, nothing locked, however many send at once and however often."""

from app.storage.database import Database
from app.storage.tables import AuditRow
from tests.app.crowds import answer_from_two_tabs, write_at_once

SENT = 300


def test_answers_sent_one_to_five_times_from_two_tabs_are_each_one_row(database: Database) -> None:
    found = answer_from_two_tabs(database, SENT, people=2, seed=1)
    assert found.wrong == []
    assert found.refused == []
    assert set(found.kept) == found.sent
    assert len(found.kept) == 2 * SENT


def test_two_hundred_writers_at_once_are_all_served(database: Database) -> None:
    waits, wrong = write_at_once(database, 200, 5)
    assert wrong == []
    assert len(waits) == 1000
    with database.read() as db:
        assert db.query(AuditRow).count() == 1000
