"""Who takes part: links, enrolment with its place in the design, exclusion, and places freed.

A participant's cell (their order of the strategies) is chosen in the transaction that enrols them,
so that those who completed or take part now are spread evenly whatever happens at the same time.
"""

import hashlib
import secrets
import uuid
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta

from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError, UnknownLink
from app.schemas.protocol import Protocol
from app.services import counterbalancing, external_ids, plan, protocols
from app.settings import Settings
from app.storage import participants, studies
from app.storage.tables import EventRow, ParticipantRow, ProtocolRow, StudyRow

STARTUP = "start"
EXPERIMENTER = "experimenter"
LINK = "link"
# These hold a place of their study.
LIVE = ("active", "completed")


class StudyClosed(JoymapError):
    """A study that takes nobody in now."""

    status_code = 409
    kind = "study-closed"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("This study takes in nobody at the moment.")


class StudyFull(JoymapError):
    """A study that has all the people it wants."""

    status_code = 409
    kind = "study-full"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("This study has all the participants it needs. Thank you for coming!")


class IdTaken(JoymapError):
    """A recruiting service's id that somebody else came with before."""

    status_code = 409
    kind = "id-taken"

    def __init__(self) -> None:
        """Say how who it was gets in again."""
        super().__init__(
            "Somebody takes part with this id already. If that is you, open the link you were "
            "given then, or ask the experimenter for a new one."
        )


class NoSuchParticipant(JoymapError):
    """A participant nobody invited."""

    status_code = 404
    kind = "no-such-participant"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such participant.")


def new_token() -> str:
    """A token of 256 bits that nobody can guess, fit for an address."""
    return secrets.token_urlsafe(32)


def hash_of(token: str) -> str:
    """What is kept of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


def ids_from(request_id: str, count: int) -> list[str]:
    """The ids of those enrolled by one request: its own for the first, made from it for others."""
    made_from = uuid.UUID(request_id)
    return [
        request_id if index == 0 else str(uuid.uuid5(made_from, str(index)))
        for index in range(count)
    ]


def label_of(participant: ParticipantRow) -> str:
    """What experimenters call a participant."""
    return f"P-{participant.number}"


def participant_of(db: Session, token: str) -> ParticipantRow:
    """The participant whose link holds this token.

    Raises:
        UnknownLink: If it is nobody's.
    """
    participant = participants.by_token_hash(db, hash_of(token))
    if participant is None:
        raise UnknownLink
    return participant


def by_id(db: Session, participant_id: str) -> ParticipantRow:
    """The participant of that id.

    Raises:
        NoSuchParticipant: If there is none.
    """
    participant = db.get(ParticipantRow, participant_id)
    if participant is None:
        raise NoSuchParticipant
    return participant


def enrol(
    db: Session,
    study: StudyRow,
    token: str,
    *,
    participant_id: str,
    origin: str,
    external_id: str | None = None,
    browser_hash: str | None = None,
) -> ParticipantRow:
    """Give somebody a place in a study, under the newest version of its protocol.

    Raises:
        StudyClosed: If it takes nobody in.
        StudyFull: If all its places are taken.
        IdReused: If the id was used before. (The token of the first time is not kept, so the same
            answer cannot be given twice.)
    """
    if db.get(ParticipantRow, participant_id) is not None:
        raise IdReused
    row = studies.latest(db, study.id)
    if study.state != "open" or row is None:
        raise StudyClosed
    protocol = protocols.of_row(row)
    counts = studies.cell_counts(db, row.id, LIVE)
    if protocol.participants is not None and sum(counts.values()) >= protocol.participants:
        raise StudyFull
    number = participants.next_number(db)
    cell = counterbalancing.next_cell(counts, _cells(protocol), seed=number)
    now = datetime.now(UTC)
    if row.frozen_at is None:
        row.frozen_at = now
    participant = ParticipantRow(
        id=participant_id,
        number=number,
        study_id=study.id,
        protocol_id=row.id,
        cell=cell,
        place=0,
        state="active",
        origin=origin,
        external_id=external_id,
        token_hash=hash_of(token),
        browser_hash=browser_hash,
        seed=secrets.randbits(31),
        created_at=now,
        opened_at=None,
        seen_at=now,
        ended_at=None,
        excluded=None,
    )
    db.add(participant)
    db.flush()
    return participant


def join(
    db: Session,
    link_token: str,
    token: str,
    external_id: str | None,
    browser: str,
    press: str | None = None,
) -> ParticipantRow:
    """Come by a study's shared link; who comes back gets their place again.

    Neither an external id nor the id of a press is a secret: the place goes only to the browser
    that took it. Somebody who comes back gets a new link, and the former one ends.

    Args:
        db: The transaction.
        link_token: The shared link's.
        token: The participant's own link's, if they get in.
        external_id: What a recruiting service calls them, as their link has it.
        browser: What their browser is known by.
        press: The page's id of pressing the button: the same one again is the same person.

    Raises:
        UnknownLink: If it is no study's.
        NoId: If the study takes nobody in without an id, and this is nobody's.
        IdTaken: If somebody came with this id before, in another browser.
        IdReused: If the press is another browser's.
        StudyClosed: If the study takes nobody in, and this is nobody known.
        StudyFull: If all its places are taken.
    """
    study = study_of(db, link_token)
    latest = studies.latest(db, study.id)
    wanted = "optional" if latest is None else protocols.of_row(latest).external_ids
    name, browser_hash = external_ids.of_study(wanted, external_id), hash_of(browser)
    known = None if name is None else participants.by_external_id(db, study.id, name)
    if known is not None and known.browser_hash != browser_hash:
        raise IdTaken
    pressed = None if press is None else db.get(ParticipantRow, press)
    if known is None and pressed is not None:
        if pressed.study_id != study.id or pressed.browser_hash != browser_hash:
            raise IdReused
        known = pressed
    if known is not None:
        if known.state == "abandoned":
            come_back(db, known)
        known.token_hash = hash_of(token)
        return known
    return enrol(
        db,
        study,
        token,
        participant_id=press or str(uuid.uuid4()),
        origin=LINK,
        external_id=name,
        browser_hash=browser_hash,
    )


def takes_in(db: Session, study: StudyRow) -> bool:
    """Whether somebody new would get a place now."""
    row = studies.latest(db, study.id)
    if study.state != "open" or row is None:
        return False
    wanted = protocols.of_row(row).participants
    return wanted is None or sum(studies.cell_counts(db, row.id, LIVE).values()) < wanted


def study_of(db: Session, link_token: str) -> StudyRow:
    """The study a shared link belongs to.

    Raises:
        UnknownLink: If it is no study's.
    """
    study = studies.by_link_hash(db, hash_of(link_token))
    if study is None:
        raise UnknownLink
    return study


def startup_link(db: Session, settings: Settings) -> str:
    """The token of the participant link printed at a start; an unopened one is used again."""
    token = new_token()
    study = protocols.demo(db, settings)
    latest = studies.latest(db, study.id)
    waiting = participants.never_opened(db, STARTUP)
    if waiting is not None and latest is not None and waiting.protocol_id == latest.id:
        waiting.token_hash = hash_of(token)
    else:
        enrol(db, study, token, participant_id=str(uuid.uuid4()), origin=STARTUP)
    return token


def new_link(participant: ParticipantRow) -> str:
    """A new token for a participant; the former link ends, and their browser is known no more."""
    token = new_token()
    participant.token_hash, participant.browser_hash = hash_of(token), None
    return token


def revoke(participant: ParticipantRow) -> None:
    """End a participant's link; the study's shared link does not bring them back either."""
    participant.token_hash, participant.browser_hash = None, None


def exclude(participant: ParticipantRow, why: str | None) -> None:
    """Leave a participant's data out of analyses, for a reason; None takes them in again."""
    participant.excluded = why


def note_seen(participant: ParticipantRow, now: datetime) -> None:
    """Remember that the link was opened, the first time it is, and when it was used last."""
    if participant.opened_at is None:
        participant.opened_at = now
    participant.seen_at = now


def come_back(db: Session, participant: ParticipantRow) -> None:
    """Somebody given up for gone takes part again, in a cell that has room now."""
    participant.state = "active"
    rebalance(db, participant.protocol_id)


def free_abandoned(db: Session, now: datetime) -> int:
    """Free the places of those not heard of for as long as their protocol says; how many."""
    freed = 0
    for row in participants.active(db):
        protocol, _ = protocols.of_participant(db, row)
        silence = now - (row.seen_at or row.created_at)
        if not protocol.is_free and silence > timedelta(hours=protocol.abandoned_after_h):
            leave(db, row, "abandoned")
            freed += 1
    return freed


def leave(db: Session, participant: ParticipantRow, state: str) -> None:
    """Somebody takes part no more; those who remain are spread evenly as far as can be."""
    participant.state = state
    participant.ended_at = datetime.now(UTC) if state != "abandoned" else None
    db.flush()
    rebalance(db, participant.protocol_id)


def rebalance(db: Session, protocol_id: str) -> None:
    """Even out the cells by moving people who have not driven yet, newest first.

    Whoever has not come to their first way of steering has seen nothing of their order.
    """
    row: ProtocolRow = studies.protocol(db, protocol_id)
    protocol = protocols.of_row(row)
    cells = _cells(protocol)
    if cells == 1:
        return
    counts = {cell: 0 for cell in range(cells)} | studies.cell_counts(db, protocol_id, LIVE)
    first_block = next(
        index for index, step in enumerate(plan.steps_of(protocol, 0)) if step.strategies
    )
    movable: dict[int, list[ParticipantRow]] = {}
    if max(counts.values()) - min(counts.values()) > 1:
        for person in _undriven(participants.active_under(db, protocol_id), first_block):
            movable.setdefault(person.cell, []).append(person)
    while True:
        fullest = [cell for cell in counts if movable.get(cell)]
        emptiest = min(counts, key=counts.__getitem__)
        source = max(fullest, key=counts.__getitem__, default=emptiest)
        if counts[source] - counts[emptiest] <= 1:
            return
        person = movable[source].pop()
        db.add(
            EventRow(
                id=str(uuid.uuid4()),
                participant_id=person.id,
                kind="moved-cell",
                detail={"from": person.cell, "to": emptiest},
                at=datetime.now(UTC),
            )
        )
        person.cell = emptiest
        counts[source] -= 1
        counts[emptiest] += 1


def _undriven(people: Iterable[ParticipantRow], first_block: int) -> list[ParticipantRow]:
    return [person for person in people if person.place < first_block]


def _cells(protocol: Protocol) -> int:
    return len(counterbalancing.orders(protocol.order, protocol.strategies))
