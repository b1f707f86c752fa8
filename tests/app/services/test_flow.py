"""Steps: every one is reached from the one before, none is skipped or taken twice."""

import itertools
import uuid

import pytest

from app.errors import IdReused, WrongStep
from app.services import flow, plan, protocols
from app.storage.database import Database
from app.storage.tables import EventRow, ParticipantRow
from tests.app.factories import FREE, SMALL, enrol, make_participant, make_study

FREE_STEPS: tuple[plan.Kind, ...] = ("consent", "practice", "queries", "training", "driving")


def kind_of(db: object, participant: ParticipantRow) -> str:
    return flow.here(db, participant).step.kind  # type: ignore[arg-type]


def test_a_studys_steps_in_order() -> None:
    steps = plan.steps_of(protocols.parse(SMALL), 0)
    order = plan.order_of(protocols.parse(SMALL), 0)
    one = ["block/avoid/{0}", "questions/avoid/{0}/steering"]
    assert [step.key for step in steps] == [
        "consent",
        "practice",
        "queries/avoid",
        "training/avoid",
        *(key.format(position) for position in (1, 2, 3) for key in one),
        "questions/avoid/after/preference",
        "queries/pour-cup",
        "training/pour-cup",
        *(key.format(n).replace("avoid", "pour-cup") for n in (1, 2, 3) for key in one),
        "questions/pour-cup/after/preference",
        "end",
    ]
    driven = [step.strategies for step in steps if step.kind == "block"]
    assert driven == [(strategy,) for strategy in order] * 2


def test_without_practice_there_is_no_practice() -> None:
    steps = plan.steps_of(protocols.parse(SMALL | {"practice_s": 0.0}), 0)
    assert "practice" not in [step.key for step in steps]


def test_who_tries_it_out_drives_without_an_end() -> None:
    steps = plan.steps_of(protocols.parse(FREE), 0)
    assert tuple(step.kind for step in steps) == FREE_STEPS
    assert steps[-1].strategies == protocols.DEMO_STRATEGIES


def test_every_step_is_reached_from_the_one_before(database: Database) -> None:
    with database.write() as db:
        participant = enrol(db, make_study(db))
        steps = flow.here(db, participant).steps
        for leaves, arrives in itertools.pairwise(steps):
            assert flow.here(db, participant).step == leaves
            assert flow.advance(
                db,
                participant,
                flow.here(db, participant),
                str(uuid.uuid4()),
                leaves.kind,
                leaves.key,
            )
            assert flow.here(db, participant).step == arrives
            assert participant.state == ("completed" if arrives.kind == "end" else "active")
        with pytest.raises(WrongStep):
            flow.advance(db, participant, flow.here(db, participant), str(uuid.uuid4()), "end")


@pytest.mark.parametrize("step", FREE_STEPS)
@pytest.mark.parametrize("leaves", FREE_STEPS[:-1])
def test_no_step_can_be_skipped_or_taken_twice(
    database: Database, step: plan.Kind, leaves: plan.Kind
) -> None:
    with database.write() as db:
        participant = make_participant(db, step=step)
        if step == leaves:
            return
        with pytest.raises(WrongStep):
            flow.advance(db, participant, flow.here(db, participant), str(uuid.uuid4()), leaves)
        assert kind_of(db, participant) == step


def test_of_two_steps_of_a_kind_only_the_right_one_can_be_left(database: Database) -> None:
    with database.write() as db:
        participant = enrol(db, make_study(db))
        participant.place = 4
        assert flow.here(db, participant).step.key == "block/avoid/1"
        for wrong in ("block/avoid/2", "block/pour-cup/1", "consent"):
            with pytest.raises(WrongStep):
                flow.advance(
                    db, participant, flow.here(db, participant), str(uuid.uuid4()), "block", wrong
                )
        assert flow.advance(
            db, participant, flow.here(db, participant), str(uuid.uuid4()), "block", "block/avoid/1"
        )


def test_the_same_step_sent_again_changes_nothing(database: Database) -> None:
    with database.write() as db:
        participant = make_participant(db)
        event_id = str(uuid.uuid4())
        assert flow.advance(db, participant, flow.here(db, participant), event_id, "consent")
        assert not flow.advance(db, participant, flow.here(db, participant), event_id, "consent")
        assert kind_of(db, participant) == "practice"
        assert db.query(EventRow).count() == 1


def test_an_id_used_for_one_step_is_refused_for_another(database: Database) -> None:
    with database.write() as db:
        participant, other = make_participant(db), make_participant(db)
        event_id = str(uuid.uuid4())
        flow.advance(db, participant, flow.here(db, participant), event_id, "consent")
        with pytest.raises(IdReused):
            flow.advance(db, participant, flow.here(db, participant), event_id, "practice")
        with pytest.raises(IdReused):
            flow.advance(db, other, flow.here(db, other), event_id, "consent")
