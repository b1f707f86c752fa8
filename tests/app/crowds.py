"""Many people at once: they come and leave, answer and write. Some hundreds in the tests, ten
thousand in ``python -m tests.soak.many_people``."""

import random
import threading
import time
import uuid
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy.orm import Session

from app.errors import IdReused
from app.schemas.participants import AnswerIn
from app.services import enrolment, flow, queries
from app.storage import participants, studies
from app.storage.database import Database
from app.storage.tables import AnswerRow, AuditRow, ParticipantRow, StudyRow
from tests.app.factories import enrol, make_answer, make_participant, make_study, now

CELLS = 6  # orders of three strategies, by a Williams square
PLACES = 600
_QUESTIONS = 14
_LEAVE = 0.3


@dataclass
class Coming:
    """How even a study stayed while people came and left.

    Attributes:
        came: How many were enrolled.
        left: How many of them left.
        worst: The greatest difference between two orders, of those who held a place, after any
            enrolment.
        completed: For each study that was filled, how many completed each order.
    """

    came: int = 0
    left: int = 0
    worst: int = 0
    completed: list[Counter[int]] = field(default_factory=list)


def imbalance(db: Session, study: StudyRow) -> int:
    """How many more the fullest cell has than the emptiest, of those who hold a place."""
    protocol = studies.latest(db, study.id)
    assert protocol is not None
    counts = studies.cell_counts(db, protocol.id, enrolment.LIVE)
    spread = [counts.get(cell, 0) for cell in range(CELLS)]
    return max(spread) - min(spread)


def come_and_leave(database: Database, people: int, seed: int) -> Coming:
    """Fill studies until so many came; three of ten leave before they drive, and are replaced."""
    rng = random.Random(seed)
    found = Coming()
    while found.came < people:
        with database.write() as db:
            _fill(db, make_study(db, participants=PLACES), rng, found)
    return found


def _fill(db: Session, study: StudyRow, rng: random.Random, found: Coming) -> None:
    active: list[ParticipantRow] = []
    while True:
        try:
            active.append(enrol(db, study))
            found.came += 1
        except enrolment.StudyFull:
            if not active:
                break
        if len(active) > rng.randint(0, 20):
            person = active.pop(rng.randrange(len(active)))
            if rng.random() < _LEAVE:
                found.left += 1
                enrolment.leave(db, person, rng.choice(("abandoned", "withdrawn")))
            else:
                person.place = 10
                person.state = "completed"
                db.flush()
        found.worst = max(found.worst, imbalance(db, study))
    protocol = studies.latest(db, study.id)
    assert protocol is not None
    found.completed.append(Counter(studies.cell_counts(db, protocol.id, ("completed",))))


@dataclass
class Sending:
    """Which answers were sent, and which are kept.

    Attributes:
        sent: The ids, each once.
        kept: The ids of the rows, as often as there are rows.
        refused: Answers that were refused.
        wrong: What went wrong besides.
    """

    sent: set[str]
    kept: list[str]
    refused: list[AnswerIn]
    wrong: list[BaseException]


def answer_from_two_tabs(database: Database, answers: int, people: int, seed: int) -> Sending:
    """Each of so many people sends so many answers, each one to five times, from two tabs."""
    rng = random.Random(seed)
    sending = Sending(set(), [], [], [])
    for _ in range(people):
        with database.write() as db:
            who = make_participant(db, step="queries", moves=_QUESTIONS)
            shown = participants.queries_of(db, who.id, "plane")[:7]
            given = [make_answer(rng.choice(shown)) for _ in range(answers)]
            who_id = who.id
        sending.sent |= {str(answer.id) for answer in given}
        sent = [answer for answer in given for _ in range(rng.randint(1, 5))]
        orders = [rng.sample(sent, len(sent)) for _ in range(2)]
        sending.wrong += at_once(2, _tab(database, who_id, orders, sending.refused))
    with database.read() as db:
        sending.kept = [row.id for row in db.query(AnswerRow)]
    return sending


def _tab(
    database: Database, who_id: str, orders: list[list[AnswerIn]], refused: list[AnswerIn]
) -> Callable[[int], None]:
    def send_all(tab: int) -> None:
        for answer in orders[tab]:
            with database.write() as db:
                try:
                    who = db.get_one(ParticipantRow, who_id)
                    queries.record(db, who, flow.here(db, who), answer)
                except IdReused:
                    refused.append(answer)

    return send_all


def write_at_once(
    database: Database, writers: int, writes: int, pause_s: float = 0.0
) -> tuple[list[float], list[BaseException]]:
    """So many writers make so many transactions each, resting about so long before each.

    Returns:
        How long each transaction took, its waiting included, in [s]; and what went wrong.
    """
    waits: list[float] = []

    def write(index: int) -> None:
        rng = random.Random(index)
        for _ in range(writes):
            time.sleep(rng.uniform(0.0, 2.0 * pause_s))
            began_s = time.perf_counter()
            with database.write() as db:
                detail = {"by": index}
                db.add(AuditRow(at=now(), action="test", subject=str(uuid.uuid4()), detail=detail))
            waits.append(time.perf_counter() - began_s)

    wrong = at_once(writers, write)
    return waits, wrong


def at_once(count: int, work: Callable[[int], Any]) -> list[BaseException]:
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
