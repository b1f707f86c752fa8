"""Experimenters: accounts, logins and programs' keys. Of every token only the hash is kept."""

import uuid
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Literal

from argon2 import PasswordHasher
from argon2.exceptions import VerificationError
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
    """

    id: str
    name: str
    role: Role

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
    except VerificationError:
        return False


def log_in(db: Session, name: str, fits_hash: str | None) -> str:
    """Log somebody in whose password fitted this hash; the token for the cookie.

    Raises:
        WrongPassword: If there is no such account now, or its password is another meanwhile.
    """
    account = access.by_name(db, name)
    if account is None or account.disabled_at is not None or account.password_hash != fits_hash:
        raise WrongPassword
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
        return Experimenter(account.id, account.name, role)
    row = None if login is None else access.login(db, hash_of(login))
    if row is None or _is_past(row.expires_at, now):
        raise NotAllowed
    account = db.get_one(ExperimenterRow, row.experimenter_id)
    if account.disabled_at is not None:
        raise NotAllowed
    return Experimenter(account.id, account.name, account.role)  # type: ignore[arg-type]


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
    if account.role == "owner" and loses and access.owners(db) <= 1:
        raise BadAccount("Somebody has to be the owner; make another owner first.")
    if role is not None:
        account.role = role
    if disabled is not None:
        account.disabled_at = datetime.now(UTC) if disabled else None
        if disabled:
            access.forget_logins(db, account_id)
            access.revoke_tokens(db, account_id, datetime.now(UTC))
    audit.note(db, who.id, "account.change", account_id, role=role, disabled=disabled)
    return account


def change_password(db: Session, who: Experimenter, password_hash: str) -> None:
    """A new password; whoever was logged in with the old one is so no more."""
    db.get_one(ExperimenterRow, who.id).password_hash = password_hash
    access.forget_logins(db, who.id)
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
