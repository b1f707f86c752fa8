"""Experimenters: accounts, logins and programs' keys. Of every token only the hash is kept."""

import uuid
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Literal

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy.orm import Session

from app.errors import IdReused, JoymapError, NotAllowed, UsedSetupLink
from app.services import audit
from app.services.enrolment import hash_of, new_token
from app.storage import access
from app.storage.tables import ApiTokenRow, ExperimenterRow, LoginRow, SetupLinkRow

Role = Literal["viewer", "assistant", "owner"]
ROLES: tuple[Role, ...] = ("viewer", "assistant", "owner")
LOGIN_LASTS = timedelta(days=14)
TOKEN_PREFIX = "jm_"
LEAST_PASSWORD = 10
USE_NOTED_EVERY = timedelta(minutes=1)
_HASHER = PasswordHasher()
# Somebody unknown takes as long to refuse as somebody with a wrong password.
_NOBODY = _HASHER.hash(new_token())


@dataclass(frozen=True)
class Experimenter:
    """Who asks.

    Attributes:
        id: The account's.
        name: What they log in with.
        role: What they may do at most: viewer, assistant or owner.
        asked_by: The hash of the cookie or key that says so.
        by_key: Whether a program asks by its key, not a browser that is logged in.
        key_id: The key's id whose use is to be noted; null: nothing to note.
    """

    id: str
    name: str
    role: Role
    asked_by: str = ""
    by_key: bool = False
    key_id: str | None = None

    def may(self, role: Role) -> bool:
        """Whether they may do what this role may."""
        return ROLES.index(self.role) >= ROLES.index(role)


class WrongPassword(JoymapError):
    """A name and a password that do not belong together."""

    status_code = 401
    kind = "wrong-password"

    def __init__(self) -> None:
        """Say no more than that."""
        super().__init__("This name and password do not belong together.")


class BadAccount(JoymapError):
    """A name, password or role that cannot be."""

    status_code = 422
    kind = "bad-account"


class NotYours(JoymapError):
    """Something that one's role does not allow."""

    status_code = 403
    kind = "not-yours"

    def __init__(self, role: Role) -> None:
        """Say who may."""
        article = "a" if role == "viewer" else "an"
        super().__init__(f"Only {article} {role} may do this.")


class NotByKey(JoymapError):
    """Something that only the person does, in their browser."""

    status_code = 403
    kind = "not-by-key"

    def __init__(self) -> None:
        """Say how it is done."""
        super().__init__("A program's key cannot do this; please log in with your password.")


class NoSuchAccount(JoymapError):
    """An account, login or key that is not there."""

    status_code = 404
    kind = "no-such-account"

    def __init__(self) -> None:
        """Say so."""
        super().__init__("There is nothing of that id.")


# Set-up links and accounts.


def new_setup_link(db: Session, role: Role = "owner", made_by: str | None = None) -> str:
    """The token of a link that makes one account; the server's own ends its earlier ones."""
    if made_by is None:
        access.forget_setup_links(db)
    token = new_token()
    now = datetime.now(UTC)
    row = SetupLinkRow(token_hash=hash_of(token), role=role, made_by=made_by, created_at=now)
    db.add(row)
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


def sign_up(db: Session, setup_token: str, name: str, password_hash: str) -> str:
    """Use up a set-up link and make an account; returns the token for the browser's cookie.

    Raises:
        UsedSetupLink: If the link was used, or is of an earlier start.
        BadAccount: If somebody has that name.
    """
    link = check_setup_link(db, setup_token)
    if access.by_name(db, name) is not None:
        raise BadAccount("Somebody has this name already; please choose another.")
    now = datetime.now(UTC)
    link.used_at = now
    account = ExperimenterRow(
        id=str(uuid.uuid4()),
        name=name,
        password_hash=password_hash,
        role=link.role,
        created_at=now,
    )
    db.add(account)
    db.flush()
    audit.note(db, account.id, "account.create", account.id, name=name, role=link.role)
    return _log_in(db, account)


def clean_name(name: str) -> str:
    """A name as it is kept.

    Raises:
        BadAccount: If it is empty or too long.
    """
    name = name.strip().lower()
    if not 1 <= len(name) <= 64 or not name.isprintable():
        raise BadAccount("A name has 1 to 64 letters.")
    return name


def hashed(password: str) -> str:
    """What is kept of a password. Takes a moment, on purpose: not within a transaction.

    Raises:
        BadAccount: If it is too short or far too long.
    """
    if not LEAST_PASSWORD <= len(password) <= 1000:
        raise BadAccount(f"A password has at least {LEAST_PASSWORD} letters.")
    return _HASHER.hash(password)


def fits(password_hash: str | None, password: str) -> bool:
    """Whether a password is the one that was hashed. Takes a moment, whoever asks."""
    try:
        return _HASHER.verify(password_hash or _NOBODY, password) and password_hash is not None
    except (VerificationError, InvalidHashError):
        return False


def rehashed(password_hash: str | None, password: str) -> str | None:
    """A fitting password hashed anew, where it was hashed by an earlier library's parameters."""
    if password_hash is None or not _HASHER.check_needs_rehash(password_hash):
        return None
    return _HASHER.hash(password)


def log_in(db: Session, name: str, fits_hash: str | None, rehashed: str | None = None) -> str:
    """Log somebody in whose password fitted this hash; the token for the cookie.

    The password is kept as ``rehashed`` from now on, if that is given.

    Raises:
        WrongPassword: If there is no such account now, or its password is another meanwhile.
    """
    account = access.by_name(db, name)
    if account is None or account.disabled_at is not None or account.password_hash != fits_hash:
        raise WrongPassword
    if rehashed is not None:
        account.password_hash = rehashed
    return _log_in(db, account)


def password_hash_of(db: Session, name: str) -> str | None:
    """What to compare a password with, if there is such an account."""
    account = access.by_name(db, name)
    return None if account is None or account.disabled_at is not None else account.password_hash


def log_out(db: Session, token: str) -> None:
    """End a login."""
    login = access.login(db, hash_of(token))
    if login is not None:
        db.delete(login)


def experimenter_of(db: Session, login: str | None, bearer: str | None) -> Experimenter:
    """Who asks, by their cookie or their program's key.

    Raises:
        NotAllowed: If neither is good (any more).
    """
    now = datetime.now(UTC)
    if bearer is not None:
        key = access.api_token(db, hash_of(bearer))
        if key is None or key.revoked_at is not None or _is_past(key.expires_at, now):
            raise NotAllowed
        account = db.get_one(ExperimenterRow, key.experimenter_id)
        if account.disabled_at is not None:
            raise NotAllowed
        role: Role = "viewer" if key.scope == "read" else account.role  # type: ignore[assignment]
        is_noted = key.used_at is not None and now - key.used_at < USE_NOTED_EVERY
        to_note = None if is_noted else key.id
        return Experimenter(account.id, account.name, role, key.token_hash, True, to_note)
    row = None if login is None else access.login(db, hash_of(login))
    if row is None or _is_past(row.expires_at, now):
        raise NotAllowed
    account = db.get_one(ExperimenterRow, row.experimenter_id)
    if account.disabled_at is not None:
        raise NotAllowed
    return Experimenter(
        account.id,
        account.name,
        account.role,  # type: ignore[arg-type]
        row.token_hash,
    )


def note_use(db: Session, key_id: str) -> None:
    """Note that a program's key was used now."""
    db.get_one(ApiTokenRow, key_id).used_at = datetime.now(UTC)


def login_id(token_hash: str) -> str:
    """What a login is called on the wire: part of the hash, from which nobody gets the cookie."""
    return token_hash[:16]


def end_login(db: Session, who: Experimenter, wanted: str) -> None:
    """End one of one's own logins.

    Raises:
        NoSuchAccount: If there is none of that id.
    """
    for login in access.logins(db, who.id):
        if login_id(login.token_hash) == wanted:
            db.delete(login)
            audit.note(db, who.id, "login.end", wanted)
            return
    raise NoSuchAccount


def change(
    db: Session, who: Experimenter, account_id: str, *, role: Role | None, disabled: bool | None
) -> ExperimenterRow:
    """Change somebody's role, or let them in no more (or again).

    Raises:
        NoSuchAccount: If there is none of that id.
        BadAccount: If nobody would be left to own the place.
    """
    account = db.get(ExperimenterRow, account_id)
    if account is None:
        raise NoSuchAccount
    loses = (role is not None and role != "owner") or disabled
    is_owner = account.role == "owner" and account.disabled_at is None
    if is_owner and loses and access.owners(db) <= 1:
        raise BadAccount("Somebody has to be the owner; make another owner first.")
    if role is not None:
        account.role = role
    if loses:
        access.forget_invitations(db, account_id)
    if disabled is not None:
        account.disabled_at = datetime.now(UTC) if disabled else None
        if disabled:
            access.forget_logins(db, account_id)
            access.revoke_tokens(db, account_id, datetime.now(UTC))
    audit.note(db, who.id, "account.change", account_id, role=role, disabled=disabled)
    return account


def change_password(db: Session, who: Experimenter, password_hash: str) -> None:
    """A new password; whoever was let in by the old one, programs too, is so no more."""
    db.get_one(ExperimenterRow, who.id).password_hash = password_hash
    access.forget_logins(db, who.id)
    access.revoke_tokens(db, who.id, datetime.now(UTC))
    audit.note(db, who.id, "account.password", who.id)


# Programs' keys.


def new_api_token(
    db: Session, who: Experimenter, token_id: str, name: str, scope: str, days: int | None
) -> str:
    """A key for a program, shown this once.

    Raises:
        IdReused: If the id was used before.
    """
    if db.get(ApiTokenRow, token_id) is not None:
        raise IdReused
    token, now = TOKEN_PREFIX + new_token(), datetime.now(UTC)
    db.add(
        ApiTokenRow(
            id=token_id,
            experimenter_id=who.id,
            name=name,
            scope=scope,
            token_hash=hash_of(token),
            created_at=now,
            expires_at=None if days is None else now + timedelta(days=days),
        )
    )
    audit.note(db, who.id, "token.create", token_id, name=name, scope=scope)
    return token


def revoke_api_token(db: Session, who: Experimenter, token_id: str) -> None:
    """End a key: one's own, or anybody's if one owns the place.

    Raises:
        NoSuchAccount: If there is none of that id that one may end.
    """
    key = db.get(ApiTokenRow, token_id)
    if key is None or (key.experimenter_id != who.id and not who.may("owner")):
        raise NoSuchAccount
    key.revoked_at = key.revoked_at or datetime.now(UTC)
    audit.note(db, who.id, "token.revoke", token_id)


def _log_in(db: Session, account: ExperimenterRow) -> str:
    token, now = new_token(), datetime.now(UTC)
    access.forget_past_logins(db, now)
    db.add(
        LoginRow(
            token_hash=hash_of(token),
            experimenter_id=account.id,
            created_at=now,
            expires_at=now + LOGIN_LASTS,
        )
    )
    return token


def _is_past(moment: datetime | None, now: datetime) -> bool:
    return moment is not None and moment <= now
