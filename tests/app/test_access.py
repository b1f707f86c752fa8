"""Who may do what: every route of the service, and everybody who could ask for it."""

import uuid
from collections.abc import Generator, Iterable
from datetime import timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session
from starlette.routing import Mount
from starlette.testclient import WebSocketDenialResponse
from starlette.websockets import WebSocketDisconnect

from app.main import create_app
from app.services import accounts, enrolment, protocols
from app.services.accounts import Experimenter, Role
from app.settings import Settings
from app.storage.database import Database, migrate
from app.storage.tables import ApiTokenRow, ExperimenterRow, LoginRow, QueryRow, StudyRow
from models.panda_pack import default_folder
from tests.app.factories import make_participant, now

OK = 200  # let in: what is answered then is for the other tests
# Who asks, and what they get by what a route needs. A "link" is that of who asks; who has none
# tries one of nobody's. What is done "in person" is refused to programs' keys.
WHO = {
    "nobody": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "participant": {"link": OK, "viewer": 401, "assistant": 401, "owner": 401},
    "other participant": {"link": OK, "viewer": 401, "assistant": 401, "owner": 401},
    "viewer": {"link": 404, "viewer": OK, "assistant": 403, "owner": 403},
    "assistant": {"link": 404, "viewer": OK, "assistant": OK, "owner": 403},
    "owner": {"link": 404, "viewer": OK, "assistant": OK, "owner": OK},
    "read key": {"link": 404, "viewer": OK, "assistant": 403, "owner": 403},
    "write key": {"link": 404, "viewer": OK, "assistant": OK, "owner": OK},
    "expired key": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "revoked key": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "ended login": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "expired login": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "disabled": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
    "disabled's key": {"link": 404, "viewer": 401, "assistant": 401, "owner": 401},
}
NEEDS = {
    "GET /": "nothing",
    "GET /health": "nothing",
    "GET /login": "nothing",
    "GET /setup/{token}": "a link of nobody's",
    "POST /setup/{token}": "a link of nobody's",
    "GET /join/{token}": "a link of nobody's",
    "GET /join/{token}/study": "a link of nobody's",
    "POST /join/{token}": "a link of nobody's",
    "GET /p/{token}": "link",
    "GET /p/{token}/scene/": "link",
    "GET /p/{token}/api/session": "link",
    "POST /p/{token}/api/consent": "link",
    "POST /p/{token}/api/practice": "link",
    "POST /p/{token}/api/answers": "link",
    "PUT /p/{token}/api/stick": "link",
    "GET /p/{token}/api/training": "link",
    "POST /p/{token}/api/training/retry": "link",
    "POST /p/{token}/api/driving": "link",
    "POST /p/{token}/api/block": "link",
    "POST /p/{token}/api/questions": "link",
    "POST /p/{token}/api/withdraw": "link",
    "POST /p/{token}/api/drives": "link",
    "WS /p/{token}/scene": "link",
    "WS /p/{token}/live": "link",
    "GET /dashboard": "viewer",
    "GET /account": "viewer",
    "GET /studies/{study_id}": "viewer",
    "GET /participants/{participant_id}": "viewer",
    "GET /participants/{participant_id}/live/scene/": "viewer",
    "WS /participants/{participant_id}/live/scene": "viewer",
    "GET /drives/{drive_id}": "viewer",
    "GET /drives/{motion_id}/{view}/scene/": "viewer",
    "GET /moves/{query_id}": "viewer",
    "GET /moves/{motion_id}/{view}/scene/": "viewer",
    "WS /moves/{query_id}/{view}/scene": "viewer",
    "WS /moves/{query_id}/{view}/control": "viewer",
    "GET /api/v1/moves/{query_id}": "viewer",
    "WS /drives/{drive_id}/{view}/scene": "viewer",
    "WS /drives/{drive_id}/{view}/control": "viewer",
    "POST /api/v1/login": "nothing",
    "POST /api/v1/logout": "nothing",
    "GET /api/v1/openapi.json": "viewer",
    "GET /api/v1/me": "viewer",
    "POST /api/v1/password": "viewer in person",
    "GET /api/v1/logins": "viewer in person",
    "DELETE /api/v1/logins/{login_id}": "viewer in person",
    "GET /api/v1/accounts": "owner",
    "POST /api/v1/accounts/{account_id}": "owner in person",
    "POST /api/v1/invitations": "owner in person",
    "GET /api/v1/tokens": "viewer",
    "POST /api/v1/tokens": "assistant in person",
    "DELETE /api/v1/tokens/{token_id}": "assistant",
    "GET /api/v1/audit": "owner",
    "GET /api/v1/studies": "viewer",
    "GET /api/v1/choices": "viewer",
    "POST /api/v1/protocols/check": "viewer",
    "POST /api/v1/studies": "assistant",
    "GET /api/v1/studies/{study_id}": "viewer",
    "PUT /api/v1/studies/{study_id}/protocol": "assistant",
    "POST /api/v1/studies/{study_id}/state": "assistant",
    "POST /api/v1/studies/{study_id}/link": "assistant",
    "DELETE /api/v1/studies/{study_id}/link": "assistant",
    "GET /api/v1/studies/{study_id}/participants": "viewer",
    "POST /api/v1/studies/{study_id}/participants": "assistant",
    "GET /api/v1/studies/{study_id}/export": "assistant",
    "GET /api/v1/studies/{study_id}/figures": "viewer",
    "POST /api/v1/studies/{study_id}/figures": "viewer",
    "GET /api/v1/studies/{study_id}/figures/{name}": "viewer",
    "GET /api/v1/live": "viewer",
    "GET /api/v1/jobs": "viewer",
    "GET /api/v1/participants/{participant_id}": "viewer",
    "GET /api/v1/participants/{participant_id}/drives": "viewer",
    "POST /api/v1/participants/{participant_id}/exclude": "assistant",
    "POST /api/v1/participants/{participant_id}/include": "assistant",
    "POST /api/v1/participants/{participant_id}/link": "assistant",
    "POST /api/v1/participants/{participant_id}/revoke": "assistant",
    "POST /api/v1/participants/{participant_id}/notes": "assistant",
    "POST /api/v1/participants/{participant_id}/retrain": "assistant",
    "POST /api/v1/participants/{participant_id}/withdraw": "owner",
    "GET /api/v1/drives/{drive_id}": "viewer",
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


def routes_of(routes: Iterable[Any]) -> set[str]:
    """Every route, as "METHOD /path"; what is mounted is static."""
    found: set[str] = set()
    for route in routes:
        inner = getattr(route, "original_router", None)
        if inner is not None:
            found |= routes_of(inner.routes)
        elif isinstance(route, Mount):
            assert route.path == "/static"
        else:
            methods = getattr(route, "methods", None) or {"WS"}
            found |= {f"{method} {route.path}" for method in methods - {"HEAD", "OPTIONS"}}
    return found


def account(db: Session, role: Role, link: str | None = None) -> tuple[Experimenter, str]:
    """Somebody new of that role, and the token of their login."""
    made_by = None if link is None else link
    token = accounts.new_setup_link(db, role, made_by)
    name = f"{role}-{uuid.uuid4().hex[:8]}"
    login = accounts.sign_up(db, token, name, "not a hash")
    return accounts.experimenter_of(db, login, None), login


def key(db: Session, who: Experimenter, scope: str) -> tuple[str, ApiTokenRow]:
    token_id = str(uuid.uuid4())
    token = accounts.new_api_token(db, who, token_id, "a program", scope, 1)
    db.flush()
    return token, db.get_one(ApiTokenRow, token_id)


def everybody(db: Session) -> dict[str, dict[str, str]]:
    """What each sends with a request."""
    found: dict[str, dict[str, str]] = {"nobody": {}}
    owner, login = account(db, "owner")
    found["owner"] = cookie(login)
    for role in ("viewer", "assistant"):
        found[role] = cookie(account(db, role, owner.id)[1])
    for scope in ("read", "write"):
        found[f"{scope} key"] = bearer(key(db, owner, scope)[0])
    expired, row = key(db, owner, "write")
    row.expires_at = now() - timedelta(seconds=1)
    found["expired key"] = bearer(expired)
    revoked, row = key(db, owner, "write")
    accounts.revoke_api_token(db, owner, row.id)
    found["revoked key"] = bearer(revoked)
    _, ended = account(db, "owner", owner.id)
    accounts.log_out(db, ended)
    found["ended login"] = cookie(ended)
    _, old = account(db, "owner", owner.id)
    login_row = db.get_one(LoginRow, enrolment.hash_of(old))
    login_row.expires_at = now() - timedelta(seconds=1)
    found["expired login"] = cookie(old)
    gone, gone_login = account(db, "owner", owner.id)
    gone_key, _ = key(db, gone, "write")
    db.get_one(ExperimenterRow, gone.id).disabled_at = now()
    found["disabled"], found["disabled's key"] = cookie(gone_login), bearer(gone_key)
    return found


def cookie(login: str) -> dict[str, str]:
    return {"Cookie": f"joymap_login={login}"}


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def knock(client: TestClient, method: str, path: str, headers: dict[str, str]) -> tuple[int, str]:
    """The status and kind of an answer; bodies are empty, so that nothing happens."""
    if method == "WS":
        try:
            with client.websocket_connect(path, headers=headers):
                return OK, ""
        except WebSocketDenialResponse as refused:
            return refused.status_code, refused.json()["error"]["kind"]
        except WebSocketDisconnect:  # let in, and told that the page is of another version
            return OK, ""
    asked = client.request(
        method,
        path,
        content="{}" if method in ("POST", "PUT") else None,
        headers=headers | {"Content-Type": "application/json"},
        follow_redirects=False,
    )
    is_json = asked.headers.get("content-type") == "application/json"
    said = asked.json().get("error", {}) if is_json and asked.status_code >= 400 else {}
    return asked.status_code, said.get("kind", "")


def test_every_route_lets_in_whom_it_is_for_and_nobody_else(client: TestClient) -> None:
    assert routes_of(client.app.routes) == set(NEEDS)  # type: ignore[attr-defined]
    service = client.app.state.service  # type: ignore[attr-defined]
    database: Database = service.database
    tokens = {name: enrolment.new_token() for name in ("participant", "other participant", "seen")}
    ids = {}
    with database.write() as db:
        who = everybody(db)
        study = db.get_one(StudyRow, protocols.DEMO)
        for name, token in tokens.items():
            made = enrolment.enrol(
                db, study, token, participant_id=str(uuid.uuid4()), origin="experimenter"
            )
            ids[name] = made.id
    who |= {name: bearer(token) | cookie(token) for name, token in tokens.items()}
    assert set(WHO) == set(who) - {"seen"}
    wrong = []
    for route, needs in sorted(NEEDS.items()):
        method, path = route.split(" ")
        path = path.replace("{study_id}", protocols.DEMO).replace("{participant_id}", ids["seen"])
        for name, gets in WHO.items():
            if route == "POST /api/v1/logout" and "Cookie" in who[name]:
                continue  # would log them out; tested with the accounts
            service.doorkeeper._knocks.clear()
            role, _, in_person = needs.partition(" in ")
            own = tokens.get(name, "x" * 43) if needs == "link" else "x" * 43
            status, kind = knock(client, method, path.replace("{token}", own), who[name])
            is_let_in = status < 500 and status not in (401, 403, 429) and kind != "unknown-link"
            if needs == "nothing":
                is_right = is_let_in
            elif needs == "a link of nobody's":
                is_right = status in (404, 422)
            else:
                expected = gets[role]
                if in_person and name in ("read key", "write key"):
                    expected = 403
                is_right = is_let_in if expected == OK else status == expected
            if not is_right:
                wrong.append((route, name, status, kind))
    assert not wrong


def test_a_participant_cannot_touch_what_is_anothers(client: TestClient) -> None:
    database: Database = client.app.state.service.database  # type: ignore[attr-defined]
    token = enrolment.new_token()
    with database.write() as db:
        asked = make_participant(db, step="queries", moves=1)
        query = db.query(QueryRow).filter_by(participant_id=asked.id).one().id
        other = make_participant(db, step="queries", moves=1)
        other.token_hash = enrolment.hash_of(token)
    answer = {"id": str(uuid.uuid4()), "query_id": query, "h": [0.1, 0.2], "thinking_time_s": 1.0}
    refused = client.post(f"/p/{token}/api/answers", json=answer)
    assert (refused.status_code, refused.json()["error"]["kind"]) == (404, "unknown-query")
    assert query not in client.get(f"/p/{token}/api/session").text
