"""Experimenters' accounts: in and out, others' roles, programs' keys, and the audit trail."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response

from app.routers.dependencies import (
    LOGIN_COOKIE,
    Assistant,
    Here,
    InPerson,
    Owner,
    Viewer,
    address_of,
    login_cookie,
    same_origin,
)
from app.schemas.accounts import (
    AccountChangeIn,
    AccountOut,
    AccountsOut,
    AuditEntryOut,
    AuditOut,
    CredentialsIn,
    InvitationIn,
    InvitationOut,
    LoginOut,
    LoginsOut,
    NewTokenOut,
    PasswordIn,
    TokenIn,
    TokenOut,
    TokensOut,
)
from app.schemas.experimenter import LARGEST
from app.services import accounts, audit
from app.services.accounts import WrongPassword
from app.storage import access
from app.storage.tables import ApiTokenRow, ExperimenterRow

router = APIRouter(prefix="/api/v1", dependencies=[Depends(same_origin)], tags=["accounts"])


@router.post("/login")
def log_in(who: CredentialsIn, here: Here, request: Request, response: Response) -> AccountOut:
    """Log this browser in."""
    name = accounts.clean_name(who.name)
    here.doorkeeper.admit(f"enters {address_of(request)}")
    here.doorkeeper.admit(f"login {name}")
    with here.database.read() as db:
        kept = accounts.password_hash_of(db, name)
    if not accounts.fits(kept, who.password):
        raise WrongPassword
    rehashed = accounts.rehashed(kept, who.password)
    with here.database.write() as db:
        token = accounts.log_in(db, name, kept, rehashed)
        account = access.by_name(db, name)
        assert account is not None
        found = _account_out(account)
    login_cookie(request, response, token)
    return found


@router.post("/logout", status_code=204)
def log_out(here: Here, request: Request, response: Response) -> None:
    """Log this browser out."""
    token = request.cookies.get(LOGIN_COOKIE)
    if token is not None:
        with here.database.write() as db:
            accounts.log_out(db, token)
    response.delete_cookie(LOGIN_COOKIE)


@router.get("/me")
def read_me(me: Viewer, here: Here) -> AccountOut:
    """Who I am; by a key that may only read, a viewer."""
    with here.database.read() as db:
        found = _account_out(db.get_one(ExperimenterRow, me.id))
    return found.model_copy(update={"role": me.role})


@router.post("/password", status_code=204, dependencies=[InPerson])
def change_password(wanted: PasswordIn, me: Viewer, here: Here) -> None:
    """A new password for myself; ends all my logins and keys."""
    here.doorkeeper.admit(f"login {me.name}")
    with here.database.read() as db:
        kept = accounts.password_hash_of(db, me.name)
    if not accounts.fits(kept, wanted.old):
        raise WrongPassword
    hashed = accounts.hashed(wanted.new)
    with here.database.write() as db:
        accounts.change_password(db, me, hashed)


@router.get("/logins", dependencies=[InPerson])
def read_logins(me: Viewer, here: Here) -> LoginsOut:
    """The browsers in which I am logged in."""
    with here.database.read() as db:
        rows = access.logins(db, me.id)
        return LoginsOut(
            logins=[
                LoginOut(
                    id=accounts.login_id(row.token_hash),
                    created_at=_iso(row.created_at) or "",
                    expires_at=_iso(row.expires_at) or "",
                    is_this=row.token_hash == me.asked_by,
                )
                for row in rows
            ]
        )


@router.delete("/logins/{login_id}", status_code=204, dependencies=[InPerson])
def end_login(login_id: str, me: Viewer, here: Here) -> None:
    """Log one of my browsers out."""
    with here.database.write() as db:
        accounts.end_login(db, me, login_id)


@router.get("/accounts")
def read_accounts(me: Owner, here: Here) -> AccountsOut:
    """Everybody who can log in."""
    del me
    with here.database.read() as db:
        return AccountsOut(accounts=[_account_out(row) for row in access.accounts(db)])


@router.post("/accounts/{account_id}", dependencies=[InPerson])
def change_account(account_id: str, wanted: AccountChangeIn, me: Owner, here: Here) -> AccountOut:
    """Another role, or no access any more."""
    with here.database.write() as db:
        return _account_out(
            accounts.change(db, me, account_id, role=wanted.role, disabled=wanted.disabled)
        )


@router.post("/invitations", status_code=201, dependencies=[InPerson])
def invite(wanted: InvitationIn, me: Owner, here: Here) -> InvitationOut:
    """A link with which one more person makes an account."""
    with here.database.write() as db:
        token = accounts.new_setup_link(db, wanted.role, made_by=me.id)
        audit.note(db, me.id, "account.invite", role=wanted.role)
    return InvitationOut(link=f"{here.settings.base_url}/setup/{token}")


@router.get("/tokens")
def read_tokens(me: Viewer, here: Here) -> TokensOut:
    """My programs' keys; everybody's, if I own the place."""
    with here.database.read() as db:
        rows = access.api_tokens(db, None if me.may("owner") else me.id)
        return TokensOut(tokens=[_token_out(row) for row in rows])


@router.post("/tokens", status_code=201, dependencies=[InPerson])
def make_token(wanted: TokenIn, me: Assistant, here: Here) -> NewTokenOut:
    """A key for a program, shown this once."""
    with here.database.write() as db:
        token = accounts.new_api_token(
            db, me, str(wanted.id), wanted.name, wanted.scope, wanted.days
        )
    return NewTokenOut(id=str(wanted.id), token=token)


@router.delete("/tokens/{token_id}", status_code=204)
def revoke_token(token_id: str, me: Assistant, here: Here) -> None:
    """End a key."""
    with here.database.write() as db:
        accounts.revoke_api_token(db, me, token_id)


@router.get("/audit")
def read_audit(
    me: Owner,
    here: Here,
    before: Annotated[int | None, Query(ge=1, le=LARGEST)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> AuditOut:
    """What experimenters did, newest first."""
    del me
    with here.database.read() as db:
        rows = access.audit(db, before, limit)
        names = {row.id: row.name for row in access.accounts(db)}
        entries = [
            AuditEntryOut(
                id=row.id,
                at=_iso(row.at) or "",
                who=None if row.experimenter_id is None else names.get(row.experimenter_id),
                action=row.action,
                subject=row.subject,
                detail=row.detail,
            )
            for row in rows
        ]
    return AuditOut(entries=entries, next=entries[-1].id if len(entries) == limit else None)


@router.get("/openapi.json", include_in_schema=False)
def read_description(me: Viewer, request: Request) -> dict[str, Any]:
    """What this API is, for programs that read that."""
    del me
    description: dict[str, Any] = request.app.openapi()
    return description


def _account_out(row: ExperimenterRow) -> AccountOut:
    return AccountOut(
        id=row.id,
        name=row.name,
        role=row.role,  # type: ignore[arg-type]
        created_at=_iso(row.created_at) or "",
        is_disabled=row.disabled_at is not None,
    )


def _token_out(row: ApiTokenRow) -> TokenOut:
    return TokenOut(
        id=row.id,
        name=row.name,
        scope=row.scope,  # type: ignore[arg-type]
        created_at=_iso(row.created_at) or "",
        expires_at=_iso(row.expires_at),
        used_at=_iso(row.used_at),
        is_revoked=row.revoked_at is not None,
    )


def _iso(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="seconds")
