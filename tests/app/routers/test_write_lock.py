"""Nothing that takes long is worked out while nobody else can write, and nothing stale is kept."""

import inspect
import sys
import threading
import uuid
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import wraps
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session

from app.services import enrolment, flow, overview, queries, studies, training
from app.storage import participants
from app.storage.database import Database
from app.storage.tables import DriveRow, EventRow, JobRow, ParticipantRow, QueryRow
from models.kinematics import Kinematics
from models.strategies import get_strategy
from models.tasks import get_task
from tests.app.factories import SMALL, make_study, now
from tests.app.routers.conftest import database_of

LABELS = 5
DRAWN = LABELS * queries.SPARE_FACTOR


def tasks(**changes: Any) -> list[dict[str, Any]]:
    return [
        {"task": name, "labels": LABELS, "unlabelled": 160} | changes
        for name in ("avoid", "pour-cup")
    ]


class Person:
    """A participant of a study of their own."""

    def __init__(self, office: TestClient, place: int = 0, **protocol: Any) -> None:
        self.office, self.token, self.id = office, enrolment.new_token(), str(uuid.uuid4())
        with database_of(office).write() as db:
            study = make_study(db, **{"tasks": tasks(), "questionnaires": {}} | protocol)
            enrolment.enrol(db, study, self.token, participant_id=self.id, origin="link")
            self._row(db).place = place

    def _row(self, db: Session) -> ParticipantRow:
        return db.get_one(ParticipantRow, self.id)

    def session(self) -> dict[str, Any]:
        found: dict[str, Any] = self.office.get(f"/p/{self.token}/api/session").json()
        return found

    def post(self, path: str, **body: Any) -> Any:
        sent = {"id": str(uuid.uuid4())} | body
        return self.office.post(f"/p/{self.token}/api/{path}", json=sent)

    def agree(self, **body: Any) -> Any:
        return self.post("consent", version=self.session()["consent"]["version"], **body)

    def answer(self, query_id: str, h: tuple[float, float]) -> Any:
        return self.post("answers", query_id=query_id, h=h, thinking_time_s=1.0)

    def drive(self) -> None:
        """The one attempt of the block they are at is made."""
        with database_of(self.office).write() as db:
            step = flow.here(db, self._row(db)).step
            db.add(
                DriveRow(
                    id=str(uuid.uuid4()),
                    participant_id=self.id,
                    task=step.task,
                    step=step.key,
                    strategy=step.strategies[0],
                    alignment_id=None,
                    boot="b",
                    started_at=now(),
                    started_monotonic_s=0.0,
                    ended_at=now(),
                    end="given up",
                    outcome=None,
                )
            )

    def count(self, table: Any) -> int:
        with database_of(self.office).read() as db:
            return int(db.query(table).filter(table.participant_id == self.id).count())


class Numerics:
    """What of the learning core was called, with the write lock held and with it free."""

    def __init__(self) -> None:
        self.locked: list[str] = []
        self.free: list[str] = []
        self._thread = threading.local()

    def watched(self, write: Any) -> Any:
        @contextmanager
        def watched_write(database: Database) -> Generator[Session]:
            with write(database) as db:
                self._thread.writes = True
                try:
                    yield db
                finally:
                    self._thread.writes = False

        return watched_write

    def noted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def noted_function(*args: Any, **options: Any) -> Any:
            called = self.locked if getattr(self._thread, "writes", False) else self.free
            called.append(function.__name__)
            return function(*args, **options)

        return noted_function


@pytest.fixture
def numerics(office: TestClient, monkeypatch: pytest.MonkeyPatch) -> Numerics:
    """Watches over every function that the app has of the learning core."""
    del office  # all of the app is imported by now
    found = Numerics()
    monkeypatch.setattr(Database, "write", found.watched(Database.write))
    monkeypatch.setattr(Kinematics, "hand_pose", found.noted(Kinematics.hand_pose))
    for name, module in list(sys.modules.items()):
        for key, thing in list(vars(module).items()) if name.startswith("app.") else []:
            is_core = inspect.isfunction(thing) and thing.__module__.startswith("models.")
            if is_core and thing not in (get_task, get_strategy):  # which look a name up
                monkeypatch.setattr(module, key, found.noted(thing))
    return found


def by_consent(office: TestClient, **protocol: Any) -> tuple[Person, Any]:
    person = Person(office, practice_s=0.0, **protocol)
    return person, person.agree()


def by_practice(office: TestClient, **protocol: Any) -> tuple[Person, Any]:
    person = Person(office, **protocol)
    person.agree()
    return person, person.post("practice")


def by_a_block(office: TestClient, **protocol: Any) -> tuple[Person, Any]:
    person = Person(office, place=6, **protocol)
    person.drive()
    key = person.session()["key"]
    assert key == "block/avoid/3"
    return person, person.post("block", key=key)


def by_a_questionnaire(office: TestClient, **protocol: Any) -> tuple[Person, Any]:
    asked = {"questionnaires": {"after_each_task": ["comments"]}}
    person = Person(office, place=7, **asked, **protocol)
    session = person.session()
    items = session["questions"]["questionnaire"]["items"]
    given = [
        {"item": item["key"], "value": None, "answered_at": "2026-11-24T01:00:00Z"}
        for item in items
    ]
    return person, person.post("questions", key=session["key"], responses=given)


@pytest.mark.parametrize("wanted", ["random", "designed"])
@pytest.mark.parametrize("come", [by_consent, by_practice, by_a_block, by_a_questionnaire])
def test_questions_are_drawn_while_others_can_write(
    office: TestClient, numerics: Numerics, come: Any, wanted: str
) -> None:
    person, arrived = come(office, tasks=tasks(questions=wanted))
    assert arrived.status_code == 200, arrived.text
    assert arrived.json()["step"] == "queries"
    assert len(arrived.json()["queries"]) == LABELS
    assert arrived.json() == person.session()
    assert person.count(QueryRow) == DRAWN
    assert {"sample_pool", "make_query", "hand_pose"} <= set(numerics.free)
    assert numerics.locked == []


def test_answers_are_judged_while_others_can_write(office: TestClient, numerics: Numerics) -> None:
    designed = tasks(questions="designed", labels=8, enough_error=10.0)
    person, arrived = by_practice(office, tasks=designed)
    asked = [query["id"] for query in arrived.json()["queries"]]
    for index, query_id in enumerate(asked[:LABELS]):
        assert numerics.free.count("understand_labels") == 0
        answered = person.answer(query_id, (0.5, 0.1 * index))
        assert answered.status_code == 201
    assert answered.json()["step"] == "training"
    assert answered.json() == person.session()
    assert numerics.free.count("understand_labels") == 1
    assert numerics.locked == []


def test_what_is_refused_is_refused_before_anything_is_drawn(
    office: TestClient, numerics: Numerics
) -> None:
    person = Person(office, place=6)
    assert person.post("block", key="block/avoid/3").status_code == 409
    assert Person(office).post("practice").status_code == 409
    assert "sample_pool" not in numerics.free + numerics.locked


def test_what_experimenters_are_told_is_put_together_while_others_can_write(
    office: TestClient, numerics: Numerics, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (overview, studies):
        monkeypatch.setattr(module, "whole", numerics.noted(module.whole))
    person, study = f"/api/v1/participants/{Person(office).id}", str(uuid.uuid4())
    made = {"id": study, "protocol": SMALL}
    path = f"/api/v1/studies/{study}"
    asked = [
        office.post(f"{person}/exclude", json={"reason": "Was only trying."}),
        office.post(f"{person}/include"),
        office.post(f"{person}/notes", json={"id": str(uuid.uuid4()), "text": "Was late."}),
        office.post(f"{person}/revoke"),
        office.post("/api/v1/studies", json=made),
        office.put(f"{path}/protocol", json={"protocol": SMALL | {"drives": 2}}),
        office.post(f"{path}/state", json={"state": "closed"}),
    ]
    assert all(answered.is_success for answered in asked), [each.text for each in asked]
    assert numerics.free.count("whole") == len(asked)
    assert numerics.locked == []
    assert asked[0].json()["excluded"] == "Was only trying."
    assert asked[-1].json()["state"] == "closed"


def at_once(*calls: Callable[[], Any]) -> list[Any]:
    """Call all of these from threads of their own; what each gives, in this order."""
    found: dict[int, Any] = {}
    threads = [
        threading.Thread(target=lambda at=index, do=call: found.__setitem__(at, do()))
        for index, call in enumerate(calls)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    return [found[index] for index in range(len(calls))]


@pytest.mark.parametrize("same", [True, False])
def test_of_two_who_agree_at_once_one_set_of_questions_is_kept(
    office: TestClient, monkeypatch: pytest.MonkeyPatch, same: bool
) -> None:
    draw, advance = queries.draw, flow.advance
    first_draws, second_wants = threading.Event(), threading.Event()

    def draw_when_both_want_it(*args: Any) -> list[QueryRow]:
        first_draws.set()
        assert second_wants.wait(30.0)
        return draw(*args)

    def note_second(*args: Any, **options: Any) -> Any:
        if first_draws.is_set():
            second_wants.set()
        return advance(*args, **options)

    monkeypatch.setattr(queries, "draw", draw_when_both_want_it)
    monkeypatch.setattr(flow, "advance", note_second)
    person = Person(office, practice_s=0.0)
    first = str(uuid.uuid4())
    second = first if same else str(uuid.uuid4())
    answers = at_once(
        lambda: person.agree(id=first),
        lambda: first_draws.wait(30.0) and person.agree(id=second),
    )
    assert sorted(answer.status_code for answer in answers) == [200, 200 if same else 409]
    assert (person.count(QueryRow), person.count(EventRow)) == (DRAWN, 1)
    if same:
        assert answers[0].json() == answers[1].json()


def test_moves_are_drawn_for_one_person_at_a_time(
    office: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw, people = queries.draw, [Person(office, practice_s=0.0) for _ in range(2)]
    draws, together = threading.Semaphore(1), threading.Event()

    def note_together(*args: Any) -> list[QueryRow]:
        if not draws.acquire(blocking=False):
            together.set()
            return draw(*args)
        together.wait(1.0)
        drawn = draw(*args)
        draws.release()
        return drawn

    monkeypatch.setattr(queries, "draw", note_together)
    answers = at_once(*(person.agree for person in people))
    assert [len(answer.json()["queries"]) for answer in answers] == [LABELS] * 2
    assert not together.is_set()


@pytest.mark.parametrize("erase", [True, False])
def test_who_withdraws_while_their_questions_are_drawn_gets_none(
    office: TestClient, monkeypatch: pytest.MonkeyPatch, erase: bool
) -> None:
    draw = queries.draw
    person = Person(office, practice_s=0.0)

    def withdraw_meanwhile(*args: Any) -> list[QueryRow]:
        (left,) = at_once(lambda: person.post("withdraw", erase=erase))
        assert left.status_code == 200
        return draw(*args)

    monkeypatch.setattr(queries, "draw", withdraw_meanwhile)
    refused = person.agree()
    assert refused.status_code == 409
    assert "stopped taking part" in refused.json()["error"]["sentence"]
    assert person.count(QueryRow) == 0
    assert person.session()["state"] == "withdrawn"


def test_answers_that_changed_meanwhile_are_judged_anew(
    office: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    designed = tasks(questions="designed", labels=8)
    person, arrived = by_practice(office, tasks=designed)
    asked = [query["id"] for query in arrived.json()["queries"]]
    judged: list[Any] = []

    def change_meanwhile(_task: Any, labels: Any, *_more: Any) -> bool:
        judged.append(labels.human_inputs.tolist())
        if len(judged) == 1:
            (changed,) = at_once(lambda: person.answer(asked[0], (-1.0, 0.0)))
            assert changed.status_code == 201
        return len(judged) == 1  # that the first five say enough is not true any more

    monkeypatch.setattr(queries, "is_enough", change_meanwhile)
    for index, query_id in enumerate(asked[:LABELS]):
        answered = person.answer(query_id, (0.5, 0.1 * index))
    assert [labels[0] for labels in judged] == [[0.5, 0.0], [-1.0, 0.0]]
    assert answered.json()["step"] == "queries"
    assert person.count(JobRow) == 0


def test_an_answer_reads_where_the_person_is_and_their_questions_once(
    office: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    person, arrived = by_practice(office)
    asked = [query["id"] for query in arrived.json()["queries"]]
    for query_id in asked[:-1]:
        person.answer(query_id, (0.5, 0.5))
    read: list[tuple[Any, str]] = []
    for module, name in ((flow, "here"), (participants, "queries_of")):
        function = getattr(module, name)

        def noted(db: Any, *rest: Any, _function: Any = function, _name: str = name) -> Any:
            read.append((db, _name))
            return _function(db, *rest)

        monkeypatch.setattr(module, name, noted)
    answered = person.answer(asked[-1], (0.5, 0.5))
    monkeypatch.undo()
    assert answered.json()["step"] == "training"
    (theirs,) = [db for db, name in read if name == "here"]  # the training reads in its own
    assert sorted(name for db, name in read if db is theirs) == ["here", "queries_of"]
    with database_of(office).read() as db:
        row = db.get_one(ParticipantRow, person.id)
        job = db.query(JobRow).filter_by(participant_id=person.id).one()
        given = queries.asked(db, row, flow.here(db, row).task)
        assert job.data_hash == training.data_hash(row, given)
