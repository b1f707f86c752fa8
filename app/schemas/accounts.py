"""What experimenters' accounts, logins and programs' keys look like on the wire."""

from typing import Annotated, Literal
from uuid import UUID

from pydantic import BaseModel, Field

from app.schemas.participants import In

Role = Literal["viewer", "assistant", "owner"]
Name = Annotated[str, Field(max_length=200)]
Password = Annotated[str, Field(max_length=1000)]


class CredentialsIn(In):
    """A name and a password: to log in, or to make an account by a set-up link."""

    name: Name
    password: Password


class PasswordIn(In):
    """Another password."""

    old: Password
    new: Password


class AccountOut(BaseModel):
    """An account."""

    id: str
    name: str
    role: Role
    created_at: str
    is_disabled: bool


class AccountsOut(BaseModel):
    """All accounts."""

    accounts: list[AccountOut]


class AccountChangeIn(In):
    """What to change of an account; null: nothing."""

    role: Role | None = None
    disabled: bool | None = None


class InvitationIn(In):
    """A link for one more account is wanted."""

    role: Role


class InvitationOut(BaseModel):
    """The link, shown this once."""

    link: str


class TokenIn(In):
    """A key for a program is wanted."""

    id: UUID
    name: Annotated[str, Field(min_length=1, max_length=80)]
    scope: Literal["read", "write"]
    days: Annotated[int, Field(ge=1, le=3650)] | None = None


class TokenOut(BaseModel):
    """A program's key, without what is secret of it."""

    id: str
    name: str
    scope: Literal["read", "write"]
    created_at: str
    expires_at: str | None
    used_at: str | None
    is_revoked: bool


class NewTokenOut(BaseModel):
    """The key, shown this once."""

    id: str
    token: str


class TokensOut(BaseModel):
    """One's keys."""

    tokens: list[TokenOut]


class LoginOut(BaseModel):
    """A browser that is logged in."""

    id: str
    created_at: str
    expires_at: str
    is_this: bool


class LoginsOut(BaseModel):
    """One's logins."""

    logins: list[LoginOut]


class AuditEntryOut(BaseModel):
    """What somebody did."""

    id: int
    at: str
    who: str | None
    action: str
    subject: str | None
    detail: dict[str, object]


class AuditOut(BaseModel):
    """The audit trail, newest first, and where it goes on."""

    entries: list[AuditEntryOut]
    next: int | None
