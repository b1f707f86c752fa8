"""Links and logins: 256-bit tokens, of which only the hash is kept."""

import hashlib
import secrets
import uuid
from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError, NotAllowed, UnknownLink, UsedSetupLink
from app.storage import access, participants
from app.storage.tables import LoginRow, ParticipantRow, SetupLinkRow

STARTUP = "start"
EXPERIMENTER = "experimenter"


def new_token() -> str:
    """A token nobody can guess, fit for an address."""
    return secrets.token_urlsafe(32)


def hash_of(token: str) -> str:
    """What is kept of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


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


class NoSuchParticipant(JoymapError):
    """A participant nobody invited."""

    status_code = 404
    kind = "no-such-participant"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is no such participant.")


def by_id(db: Session, participant_id: str) -> ParticipantRow:
    """The participant of that id.

    Raises:
        NoSuchParticipant: If there is none.
    """
    participant = db.get(ParticipantRow, participant_id)
    if participant is None:
        raise NoSuchParticipant
    return participant


def add_participant(db: Session, participant_id: str, origin: str, task: str, token: str) -> str:
    """Make a participant with this link; returns the label.

    Raises:
        IdReused: If the client's id was used before. (The token of the first time is not kept, so
            the same answer cannot be given twice.)
    """
    if db.get(ParticipantRow, participant_id) is not None:
        raise IdReused
    row = ParticipantRow(
        id=participant_id,
        number=participants.next_number(db),
        origin=origin,
        token_hash=hash_of(token),
        seed=secrets.randbits(31),
        task=task,
        step="consent",
        created_at=datetime.now(UTC),
        opened_at=None,
    )
    db.add(row)
    return label_of(row)


def startup_link(db: Session, task: str) -> str:
    """The token of the participant link printed at a start; an unopened one is used again."""
    token = new_token()
    waiting = participants.never_opened(db, STARTUP)
    if waiting is None:
        add_participant(db, str(uuid.uuid4()), STARTUP, task, token)
    else:
        waiting.token_hash = hash_of(token)
    return token


def note_opened(participant: ParticipantRow) -> None:
    """Remember that the link was opened, the first time it is."""
    if participant.opened_at is None:
        participant.opened_at = datetime.now(UTC)


def new_setup_link(db: Session) -> str:
    """The token of this start's experimenter link; earlier ones stop working."""
    access.forget_setup_links(db)
    token = new_token()
    db.add(SetupLinkRow(token_hash=hash_of(token), created_at=datetime.now(UTC), used_at=None))
    return token


def check_setup_link(db: Session, token: str) -> SetupLinkRow:
    """The unused set-up link with this token.

    Raises:
        UsedSetupLink: If there is none.
    """
    link = access.setup_link(db, hash_of(token))
    if link is None or link.used_at is not None:
        raise UsedSetupLink
    return link


def log_in(db: Session, setup_token: str) -> str:
    """Use up the set-up link; returns the token for the browser's cookie."""
    check_setup_link(db, setup_token).used_at = datetime.now(UTC)
    token = new_token()
    db.add(LoginRow(token_hash=hash_of(token), created_at=datetime.now(UTC)))
    return token


def check_login(db: Session, token: str | None) -> None:
    """Let experimenters pass.

    Raises:
        NotAllowed: If the cookie is missing or unknown.
    """
    if token is None or access.login(db, hash_of(token)) is None:
        raise NotAllowed
