"""Enrolment: places, quotas and the design, with people who come, go and come back."""

import threading
import uuid
from datetime import timedelta

import pytest

from app.errors import IdReused, UnknownLink
from app.services import enrolment, flow, protocols
from app.storage import participants, studies
from app.storage.database import Database
from app.storage.tables import StudyRow
from tests.app.crowds import CELLS, PLACES, come_and_leave, imbalance
from tests.app.factories import enrol, make_study, now


def test_people_are_spread_evenly_over_the_orders(database: Database) -> None:
    with database.write() as db:
        study = make_study(db)
        for _ in range(50):
            enrol(db, study)
            assert imbalance(db, study) <= 1


def test_a_study_takes_in_no_more_than_it_wants_and_freed_places_are_given_again(
    database: Database,
) -> None:
    with database.write() as db:
        study = make_study(db, participants=12)
        people = [enrol(db, study) for _ in range(12)]
        with pytest.raises(enrolment.StudyFull):
            enrol(db, study)
        enrolment.leave(db, people[3], "withdrawn")
        enrol(db, study)
        with pytest.raises(enrolment.StudyFull):
            enrol(db, study)
        assert imbalance(db, study) == 0


def test_hundreds_come_and_a_third_leaves_and_the_design_stays_even(database: Database) -> None:
    """Each does all of it in the end or leaves somewhere; whoever leaves is replaced."""
    found = come_and_leave(database, 800, seed=20261124)
    assert 200 < found.left < 300
    assert found.completed == [{cell: PLACES // CELLS for cell in range(CELLS)}]
    assert found.worst <= 1


def test_who_has_driven_keeps_their_order_when_others_leave(database: Database) -> None:
    with database.write() as db:
        study = make_study(db)
        people = [enrol(db, study) for _ in range(12)]
        for person in people:
            person.place = 6
        before = {person.id: person.cell for person in people}
        gone = [person for person in people if person.cell == 0]
        for person in gone:
            enrolment.leave(db, person, "withdrawn")
        assert {person.id: person.cell for person in people} == before
        enrol(db, study)
        enrol(db, study)
        assert imbalance(db, study) == 0


def test_fifty_at_once_get_one_place_each(database: Database) -> None:
    with database.write() as db:
        study_id = make_study(db, participants=50).id
    refused = []

    def come() -> None:
        with database.write() as db:
            try:
                enrol(db, db.get_one(StudyRow, study_id))
            except enrolment.StudyFull:
                refused.append(1)

    threads = [threading.Thread(target=come) for _ in range(60)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as db:
        people = participants.everyone(db)
        assert len(people) == len({person.number for person in people}) == 50
        assert imbalance(db, db.get_one(StudyRow, study_id)) <= 1
    assert len(refused) == 10


def test_a_recruiting_services_person_is_enrolled_once(database: Database) -> None:
    with database.write() as db:
        study, link = make_study(db), enrolment.new_token()
        study.link_hash = enrolment.hash_of(link)
        first_token, second_token = enrolment.new_token(), enrolment.new_token()
        first = enrolment.join(db, link, first_token, "5f3c", "their browser")
        again = enrolment.join(db, link, second_token, "5f3c", "their browser")
        other = enrolment.join(db, link, enrolment.new_token(), "77aa", "another")
        assert first.id == again.id != other.id
        assert enrolment.participant_of(db, second_token).id == first.id
        with pytest.raises(UnknownLink):
            enrolment.participant_of(db, first_token)
        study.state = "closed"
        back = enrolment.join(db, link, enrolment.new_token(), "5f3c", "their browser")
        assert back.id == first.id
        with pytest.raises(enrolment.StudyClosed):
            enrolment.join(db, link, enrolment.new_token(), "new", "another")
        with pytest.raises(UnknownLink):
            enrolment.join(db, "guessed", enrolment.new_token(), None, "another")


def test_the_same_id_is_enrolled_once(database: Database) -> None:
    with database.write() as db:
        study, participant_id = make_study(db), str(uuid.uuid4())
        enrol(db, study, participant_id=participant_id)
        with pytest.raises(IdReused):
            enrol(db, study, participant_id=participant_id)


def test_who_is_silent_too_long_frees_a_place_and_may_come_back(database: Database) -> None:
    with database.write() as db:
        study = make_study(db, abandoned_after_h=24.0)
        silent, done = enrol(db, study), enrol(db, study)
        done.state = "completed"
        assert enrolment.free_abandoned(db, now() + timedelta(hours=23)) == 0
        assert enrolment.free_abandoned(db, now() + timedelta(hours=25)) == 1
        assert (silent.state, done.state) == ("abandoned", "completed")
        silent.place = 5
        enrolment.come_back(db, silent)
        assert silent.state == "active"
        assert flow.here(db, silent).place == 5


def test_a_changed_protocol_is_a_new_version_once_somebody_takes_part(database: Database) -> None:
    with database.write() as db:
        study = make_study(db)
        first = studies.latest(db, study.id)
        assert first is not None
        changed = protocols.of_row(first).model_copy(update={"title": "Before anyone came"})
        assert protocols.keep(db, study, changed).version == 1
        early = enrol(db, study)
        assert first.frozen_at is not None
        later = changed.model_copy(update={"drives": 2})
        assert protocols.keep(db, study, changed).version == 1
        assert protocols.keep(db, study, later).version == 2
        late = enrol(db, study)
        assert flow.here(db, early).protocol.drives == 1
        assert flow.here(db, late).protocol.drives == 2
        assert (flow.here(db, early).version, flow.here(db, late).version) == (1, 2)
