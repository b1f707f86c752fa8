import uuid

import pytest

from app.errors import IdReused, WrongStep
from app.services import flow
from app.storage.database import Database
from app.storage.tables import EventRow
from tests.app.factories import make_participant


def test_every_step_is_reached_from_the_one_before(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db)
        for leaves, arrives in zip(flow.STEPS, flow.STEPS[1:], strict=False):
            assert participant.step == leaves
            assert flow.advance(db, participant, str(uuid.uuid4()), leaves)
            assert participant.step == arrives


@pytest.mark.parametrize("step", flow.STEPS)
@pytest.mark.parametrize("leaves", flow.STEPS[:-1])
def test_no_step_can_be_skipped_or_taken_twice(
    database: Database, step: flow.Step, leaves: flow.Step
) -> None:
    with database.write() as db:
        participant = make_participant(db, step=step)
        if step == leaves:
            return
        with pytest.raises(WrongStep):
            flow.advance(db, participant, str(uuid.uuid4()), leaves)
        assert participant.step == step


def test_the_same_step_sent_again_changes_nothing(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db)
        event_id = str(uuid.uuid4())
        assert flow.advance(db, participant, event_id, "consent")
        assert not flow.advance(db, participant, event_id, "consent")
        assert participant.step == "practice"
        assert db.query(EventRow).count() == 1


def test_an_id_used_for_one_step_is_refused_for_another(database: Database) -> None:
    with database.write() as db:
        participant, other = make_participant(db), make_participant(db)
        event_id = str(uuid.uuid4())
        flow.advance(db, participant, event_id, "consent")
        with pytest.raises(IdReused):
            flow.advance(db, participant, event_id, "practice")
        with pytest.raises(IdReused):
            flow.advance(db, other, event_id, "consent")
