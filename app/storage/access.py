"""Asking the database about experimenters, their links, logins and programs' keys."""

from datetime import datetime

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from .tables import ApiTokenRow, AuditRow, ExperimenterRow, LoginRow, SetupLinkRow


def setup_link(db: Session, token_hash: str) -> SetupLinkRow | None:
    """The set-up link with this hash."""
    return db.get(SetupLinkRow, token_hash)


def forget_setup_links(db: Session) -> None:
    """Make every earlier set-up link of the server's own worthless."""
    db.execute(delete(SetupLinkRow).where(SetupLinkRow.made_by.is_(None)))


def by_name(db: Session, name: str) -> ExperimenterRow | None:
    """The account of that name."""
    return db.scalar(select(ExperimenterRow).where(ExperimenterRow.name == name))


def accounts(db: Session) -> list[ExperimenterRow]:
    """All accounts, oldest first."""
    return list(db.scalars(select(ExperimenterRow).order_by(ExperimenterRow.created_at)))


def owners(db: Session) -> int:
    """How many owners can log in."""
    statement = select(func.count()).where(
        ExperimenterRow.role == "owner", ExperimenterRow.disabled_at.is_(None)
    )
    return db.scalar(statement) or 0


def login(db: Session, token_hash: str) -> LoginRow | None:
    """The login with this hash."""
    return db.get(LoginRow, token_hash)


def forget_logins(db: Session, experimenter_id: str) -> None:
    """End all logins of an account."""
    db.execute(delete(LoginRow).where(LoginRow.experimenter_id == experimenter_id))


def forget_past_logins(db: Session, now: datetime) -> None:
    """Delete the logins that have run out."""
    db.execute(delete(LoginRow).where(LoginRow.expires_at <= now))


def forget_invitations(db: Session, experimenter_id: str) -> None:
    """Make the unused invitations of an account worthless."""
    db.execute(
        delete(SetupLinkRow).where(
            SetupLinkRow.made_by == experimenter_id, SetupLinkRow.used_at.is_(None)
        )
    )


def logins(db: Session, experimenter_id: str) -> list[LoginRow]:
    """An account's logins, newest first."""
    statement = (
        select(LoginRow)
        .where(LoginRow.experimenter_id == experimenter_id)
        .order_by(LoginRow.created_at.desc())
    )
    return list(db.scalars(statement))


def api_token(db: Session, token_hash: str) -> ApiTokenRow | None:
    """The program's key with this hash."""
    return db.scalar(select(ApiTokenRow).where(ApiTokenRow.token_hash == token_hash))


def api_tokens(db: Session, experimenter_id: str | None = None) -> list[ApiTokenRow]:
    """Programs' keys, newest first: one account's, or everybody's."""
    statement = select(ApiTokenRow).order_by(ApiTokenRow.created_at.desc())
    if experimenter_id is not None:
        statement = statement.where(ApiTokenRow.experimenter_id == experimenter_id)
    return list(db.scalars(statement))


def revoke_tokens(db: Session, experimenter_id: str, now: datetime) -> None:
    """End all keys of an account."""
    db.execute(
        update(ApiTokenRow)
        .where(ApiTokenRow.experimenter_id == experimenter_id, ApiTokenRow.revoked_at.is_(None))
        .values(revoked_at=now)
    )


def audit(db: Session, before: int | None, limit: int) -> list[AuditRow]:
    """The audit trail, newest first, from before an entry."""
    statement = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
    if before is not None:
        statement = statement.where(AuditRow.id < before)
    return list(db.scalars(statement))
