"""Asking the database about experimenters' set-up links and logins."""

from sqlalchemy import delete
from sqlalchemy.orm import Session

from .tables import LoginRow, SetupLinkRow


def setup_link(db: Session, token_hash: str) -> SetupLinkRow | None:
    """The set-up link with this hash."""
    return db.get(SetupLinkRow, token_hash)


def forget_setup_links(db: Session) -> None:
    """Make every earlier set-up link worthless."""
    db.execute(delete(SetupLinkRow))


def login(db: Session, token_hash: str) -> LoginRow | None:
    """The login with this hash."""
    return db.get(LoginRow, token_hash)
