import uuid
from typing import Any

import pytest

from app.errors import IdReused, WrongStep
from app.schemas.participants import StickSettingsIn
from app.services import flow, stick
from app.services.stick import StickSettings
from app.storage.database import Database
from app.storage.tables import EventRow, ParticipantRow
from tests.app.factories import make_participant


def wanted(**settings: Any) -> StickSettingsIn:
    defaults = {"invert_x": False, "invert_y": False, "one_axis": False, "steady": False}
    return StickSettingsIn(**{"id": uuid.uuid4(), "gain": 1.0, **defaults, **settings})


def test_nobodys_stick_is_changed_until_they_change_it(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db)
        assert participant.stick is None
        assert stick.settings_of(participant) == StickSettings(False, False, 1.0, False, False)


def test_what_was_set_last_counts_and_every_change_is_kept_with_its_time(
    database: Database,
) -> None:
    with database.write() as db:
        participant_id = make_participant(db, step="practice").id
    for settings in ({"gain": 3.0}, {"invert_y": True, "steady": True}):
        with database.write() as db:
            participant = db.get_one(ParticipantRow, participant_id)
            assert stick.change(db, participant, wanted(**settings))
    with database.read() as db:
        participant = db.get_one(ParticipantRow, participant_id)
        assert stick.settings_of(participant) == StickSettings(invert_y=True, steady=True)
        events = db.query(EventRow).order_by(EventRow.at).all()
        assert [event.kind for event in events] == ["stick", "stick"]
        assert [event.detail["gain"] for event in events] == [3.0, 1.0]
        assert events[0].at < events[1].at


def test_a_change_sent_again_does_not_undo_a_later_one(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db, step="driving")
        first = wanted(gain=2.0)
        assert stick.change(db, participant, first)
        assert stick.change(db, participant, wanted(gain=4.0))
        assert not stick.change(db, participant, first)
        assert stick.settings_of(participant).gain == 4.0
        assert db.query(EventRow).count() == 2


def test_an_id_used_for_anything_else_is_refused_and_changes_nothing(database: Database) -> None:
    with database.write() as db:
        participant, other = make_participant(db), make_participant(db, step="practice")
        step_id, change = str(uuid.uuid4()), wanted(gain=2.0)
        flow.advance(db, participant, flow.here(db, participant), step_id, "consent")
        assert stick.change(db, participant, change)
        for who, again in (
            (participant, wanted(id=change.id, gain=3.0)),
            (participant, wanted(id=step_id, gain=3.0)),
            (other, change),
        ):
            with pytest.raises(IdReused):
                stick.change(db, who, again)
        with pytest.raises(IdReused):
            flow.advance(db, participant, flow.here(db, participant), str(change.id), "practice")
        assert stick.settings_of(participant).gain == 2.0
        assert stick.settings_of(other) == StickSettings()


@pytest.mark.parametrize("step", ["practice", "queries", "training", "driving"])
def test_the_stick_can_be_set_at_every_step_after_consent(database: Database, step: str) -> None:
    with database.write() as db:
        participant = make_participant(db, step=step)
        assert stick.change(db, participant, wanted(one_axis=True))
        assert flow.here(db, participant).step.kind == step


def test_nothing_is_kept_of_who_has_not_agreed_yet(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db)
        with pytest.raises(WrongStep, match="first agree to take part"):
            stick.change(db, participant, wanted(steady=True))
        assert participant.stick is None
        assert db.query(EventRow).count() == 0
