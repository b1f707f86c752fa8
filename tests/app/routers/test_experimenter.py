"""Experimenters: getting in, studies, participants, and what each role may."""

import uuid
from collections.abc import Generator
from datetime import UTC, datetime
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import accounts, enrolment, protocols
from app.services.accounts import Role
from app.settings import Settings
from app.storage import studies
from app.storage.database import Database, migrate
from app.storage.tables import ApiTokenRow, AuditRow, ExperimenterRow, ParticipantRow, StudyRow
from models.panda_pack import default_folder
from tests.app.factories import SMALL, enrol, make_study

PASSWORD = "correct horse"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), panda_dir=default_folder())
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


@pytest.fixture(autouse=True)
def _nobody_is_logged_in(client: TestClient) -> None:
    client.cookies.clear()
    client.app.state.service.doorkeeper._knocks.clear()  # type: ignore[attr-defined]


def database_of(client: TestClient) -> Database:
    return client.app.state.service.database  # type: ignore[attr-defined,no-any-return]


def sign_up(client: TestClient, role: Role = "owner") -> str:
    """A new account that is logged in; its name."""
    with database_of(client).write() as db:
        made_by = None if role == "owner" else _somebody(db)
        token = accounts.new_setup_link(db, role, made_by)
    name = f"{role}-{uuid.uuid4().hex[:8]}"
    client.cookies.clear()
    made = client.post(f"/setup/{token}", json={"name": name, "password": PASSWORD})
    assert made.status_code == 204
    return name


def _somebody(db: Any) -> str:
    found = db.query(ExperimenterRow).first()
    if found is None:
        token = accounts.new_setup_link(db)
        accounts.sign_up(db, token, f"owner-{uuid.uuid4().hex[:8]}", accounts.hashed(PASSWORD))
        found = db.query(ExperimenterRow).first()
    return str(found.id)


def sentence(response: Any) -> str:
    found: str = response.json()["error"]["sentence"]
    assert "\n" not in found
    return found


# Getting in.


def test_a_setup_link_makes_one_account_and_logs_it_in(client: TestClient) -> None:
    with database_of(client).write() as db:
        token = accounts.new_setup_link(db)
    for _ in range(2):  # looking uses nothing up
        assert client.get(f"/setup/{token}").status_code == 200
    who = {"name": " Ada ", "password": PASSWORD}
    made = client.post(f"/setup/{token}", json=who)
    assert made.status_code == 204
    cookie = made.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    assert client.get("/api/v1/me").json()["name"] == "ada"
    assert client.get("/api/v1/me").json()["role"] == "owner"
    assert client.get("/dashboard").status_code == 200
    client.cookies.clear()
    assert client.post(f"/setup/{token}", json=who | {"name": "eve"}).status_code == 404
    found = client.get("/dashboard", headers={"Accept": "text/html"}, follow_redirects=False)
    assert (found.status_code, found.headers["location"]) == (303, "/login")


def test_a_new_start_makes_the_earlier_setup_link_worthless(client: TestClient) -> None:
    with database_of(client).write() as db:
        first = accounts.new_setup_link(db)
        accounts.new_setup_link(db)
    who = {"name": "eve", "password": PASSWORD}
    assert client.post(f"/setup/{first}", json=who).status_code == 404


@pytest.mark.parametrize(
    ("who", "said"),
    [
        ({"name": "bob", "password": "short"}, "at least 10"),
        ({"name": "   ", "password": PASSWORD}, "1 to 64"),
        ({"name": "x" * 65, "password": PASSWORD}, "1 to 64"),
    ],
)
def test_a_bad_name_or_password_uses_the_link_not_up(
    client: TestClient, who: dict[str, str], said: str
) -> None:
    with database_of(client).write() as db:
        token = accounts.new_setup_link(db)
    refused = client.post(f"/setup/{token}", json=who)
    assert refused.status_code == 422
    assert said in sentence(refused)
    good = {"name": uuid.uuid4().hex, "password": PASSWORD}
    assert client.post(f"/setup/{token}", json=good).status_code == 204


def test_one_logs_in_with_name_and_password_and_out_again(client: TestClient) -> None:
    name = sign_up(client)
    client.cookies.clear()
    for who in (
        {"name": name, "password": "wrong horse!"},
        {"name": "nobody", "password": PASSWORD},
    ):
        refused = client.post("/api/v1/login", json=who)
        assert refused.status_code == 401
        assert sentence(refused) == "This name and password do not belong together."
    entered = client.post("/api/v1/login", json={"name": name.upper(), "password": PASSWORD})
    assert entered.status_code == 200
    cookie = client.cookies["joymap_login"]
    assert client.post("/api/v1/logout").status_code == 204
    client.cookies.clear()
    client.cookies.set("joymap_login", cookie)
    assert client.get("/api/v1/me").status_code == 401


def test_another_password_ends_all_logins(client: TestClient) -> None:
    name = sign_up(client)
    other = "battery staple"
    changed = client.post("/api/v1/password", json={"old": PASSWORD, "new": other})
    assert changed.status_code == 204
    assert client.get("/api/v1/me").status_code == 401
    assert (
        client.post("/api/v1/login", json={"name": name, "password": PASSWORD}).status_code == 401
    )
    assert client.post("/api/v1/login", json={"name": name, "password": other}).status_code == 200


def test_somebody_disabled_is_out_at_once_and_the_last_owner_stays(client: TestClient) -> None:
    sign_up(client, "assistant")
    cookie, assistant = client.cookies["joymap_login"], client.get("/api/v1/me").json()["id"]
    sign_up(client, "owner")
    changed = client.post(f"/api/v1/accounts/{assistant}", json={"disabled": True})
    assert changed.json()["is_disabled"]
    owners = [
        account["id"]
        for account in client.get("/api/v1/accounts").json()["accounts"]
        if account["role"] == "owner" and not account["is_disabled"]
    ]
    me = client.get("/api/v1/me").json()["id"]
    for owner in owners:
        if owner != me:
            client.post(f"/api/v1/accounts/{owner}", json={"disabled": True})
    refused = client.post(f"/api/v1/accounts/{me}", json={"role": "viewer"})
    assert refused.status_code == 422
    client.cookies.clear()
    client.cookies.set("joymap_login", cookie)
    assert client.get("/api/v1/me").status_code == 401


# Programs' keys.


def test_a_key_does_what_its_scope_allows_until_it_is_revoked(client: TestClient) -> None:
    sign_up(client)
    ids = {scope: str(uuid.uuid4()) for scope in ("read", "write")}
    keys = {
        scope: client.post(
            "/api/v1/tokens", json={"id": ids[scope], "name": scope, "scope": scope}
        ).json()["token"]
        for scope in ids
    }
    cookies = dict(client.cookies)
    client.cookies.clear()
    study = {"id": str(uuid.uuid4()), "protocol": SMALL}
    made = {
        scope: client.post(
            "/api/v1/studies", json=study, headers={"Authorization": f"Bearer {key}"}
        ).status_code
        for scope, key in keys.items()
    }
    assert made == {"read": 403, "write": 201}
    listed = client.get("/api/v1/studies", headers={"Authorization": f"Bearer {keys['read']}"})
    assert listed.status_code == 200
    client.cookies.update(cookies)
    assert client.delete(f"/api/v1/tokens/{ids['read']}").status_code == 204
    client.cookies.clear()
    again = client.get("/api/v1/studies", headers={"Authorization": f"Bearer {keys['read']}"})
    assert again.status_code == 401
    with database_of(client).read() as db:
        kept = db.query(ApiTokenRow).filter_by(id=ids["write"]).one()
        assert keys["write"] not in (kept.token_hash, kept.name)


# Studies.


def test_a_study_is_made_checked_changed_and_closed(client: TestClient) -> None:
    sign_up(client)
    text = protocols.as_yaml(protocols.parse(SMALL))
    checked = client.post("/api/v1/protocols/check", json={"yaml": text}).json()
    assert checked["protocol"]["title"] == SMALL["title"]
    assert checked["steps"][0]["title"] == "Welcome"
    assert checked["minutes"] > 5
    study_id = str(uuid.uuid4())
    made = client.post("/api/v1/studies", json={"id": study_id, "yaml": checked["yaml"]})
    assert made.status_code == 201
    assert client.post("/api/v1/studies", json={"id": study_id, "yaml": text}).status_code == 201
    other = {"id": study_id, "protocol": SMALL | {"drives": 2}}
    assert client.post("/api/v1/studies", json=other).status_code == 409
    found = client.get(f"/api/v1/studies/{study_id}")
    assert (found.json()["version"], found.json()["is_frozen"]) == (1, False)
    seen = {"If-Match": found.headers["etag"]}
    path = f"/api/v1/studies/{study_id}/protocol"
    changed = client.put(path, json={"protocol": SMALL | {"drives": 3}}, headers=seen)
    assert (changed.status_code, changed.json()["version"]) == (200, 1)
    late = client.put(path, json={"protocol": SMALL}, headers=seen)
    assert late.status_code == 412
    links = client.post(f"/api/v1/studies/{study_id}/participants", json={"id": str(uuid.uuid4())})
    assert links.status_code == 201
    newer = client.put(path, json={"protocol": SMALL | {"drives": 4}})
    assert (newer.json()["version"], newer.json()["is_frozen"]) == (2, False)
    assert [each["participants"] for each in newer.json()["versions"]] == [1, 0]
    closed = client.post(f"/api/v1/studies/{study_id}/state", json={"state": "closed"})
    assert closed.json()["state"] == "closed"
    more = client.post(f"/api/v1/studies/{study_id}/participants", json={"id": str(uuid.uuid4())})
    assert more.status_code == 409
    with database_of(client).read() as db:
        actions = [row.action for row in db.query(AuditRow).filter_by(subject=study_id)]
    assert actions == [
        "study.create",
        "study.protocol",
        "participants.add",
        "study.protocol",
        "study.closed",
    ]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"yaml": "title: [x"}, "line"),
        ({"protocol": SMALL | {"tasks": [{"task": "juggle"}]}}, "tasks.0"),
        ({}, "either yaml or protocol"),
        ({"yaml": "a: b", "protocol": {}}, "either yaml or protocol"),
    ],
)
def test_a_bad_protocol_is_said_to_be_so_and_nothing_is_kept(
    client: TestClient, content: dict[str, Any], said: str
) -> None:
    sign_up(client)
    study_id = str(uuid.uuid4())
    refused = client.post("/api/v1/studies", json={"id": study_id} | content)
    assert refused.status_code == 422
    assert said in sentence(refused)
    assert client.get(f"/api/v1/studies/{study_id}").status_code == 404


def test_a_study_kept_before_a_rule_came_is_read_and_mended(client: TestClient) -> None:
    sign_up(client)
    with database_of(client).write() as db:
        study = make_study(db)
        row = studies.latest(db, study.id)
        assert row is not None
        row.content = row.content | {"questionnaires": {"at_the_end": ["sus", "sus"]}}
        enrol(db, study)
        path = f"/api/v1/studies/{study.id}"
    found = client.get(path)
    assert found.status_code == 200
    protocol = found.json()["protocol"]
    assert protocol["questionnaires"]["at_the_end"] == ["sus", "sus"]
    assert client.get(f"{path}/participants").status_code == 200
    refused = client.put(f"{path}/protocol", json={"protocol": protocol})
    assert refused.status_code == 422
    assert "'sus' is there twice in questionnaires.at_the_end" in sentence(refused)
    mended = protocol | {"questionnaires": {"at_the_end": ["sus"]}}
    changed = client.put(f"{path}/protocol", json={"protocol": mended})
    assert changed.status_code == 200
    assert changed.json()["version"] == 2


def test_the_study_for_trying_out_is_the_settings_to_change(client: TestClient) -> None:
    sign_up(client)
    refused = client.put("/api/v1/studies/demo/protocol", json={"protocol": SMALL})
    assert refused.status_code == 409
    assert "settings" in sentence(refused)


def test_the_shared_link_can_be_renewed_and_ended(client: TestClient) -> None:
    sign_up(client)
    with database_of(client).write() as db:
        study_id = make_study(db).id
    links = [
        client.post(f"/api/v1/studies/{study_id}/link").json()["link"].rsplit("/", 1)[1]
        for _ in range(2)
    ]
    assert client.get(f"/join/{links[0]}/study").status_code == 404
    assert client.get(f"/join/{links[1]}/study").status_code == 200
    assert client.delete(f"/api/v1/studies/{study_id}/link").status_code == 204
    assert client.get(f"/join/{links[1]}/study").status_code == 404


# Participants.


def test_lists_go_page_by_page_and_are_sent_once(client: TestClient) -> None:
    sign_up(client)
    with database_of(client).write() as db:
        study = make_study(db)
        people = [enrol(db, study, external_id=f"ext-{index}") for index in range(7)]
        people[2].state = "completed"
        path = f"/api/v1/studies/{study.id}/participants"
        numbers = [person.number for person in people]
    found, after = [], 0
    while after is not None:
        page = client.get(path, params={"limit": 3, "after": after}).json()
        assert page["total"] == 7
        found += [line["label"] for line in page["participants"]]
        after = page["next"]
    assert found == [f"P-{number}" for number in numbers]
    assert client.get(path, params={"state": "completed"}).json()["total"] == 1
    assert client.get(path, params={"q": "ext-4"}).json()["total"] == 1
    assert client.get(path, params={"q": f"p-{numbers[1]}"}).json()["total"] == 1
    whole = client.get(path)
    again = client.get(path, headers={"If-None-Match": whole.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_a_thousand_participants_take_as_many_statements_as_ten(client: TestClient) -> None:
    sign_up(client)
    statements: list[str] = []
    counts = []
    with database_of(client).write() as db:
        study = make_study(db)
        study_id = study.id
        first = enrol(db, study)
    client.get(f"/api/v1/studies/{study_id}/participants")  # reads the protocol, once
    for many in (10, 1000):
        with database_of(client).write() as db:
            number = db.query(ParticipantRow).order_by(ParticipantRow.number.desc()).first()
            assert number is not None
            template = {
                column.name: getattr(db.get_one(ParticipantRow, first.id), column.name)
                for column in ParticipantRow.__table__.columns
            }
            db.add_all(
                ParticipantRow(
                    **template
                    | {
                        "id": str(uuid.uuid4()),
                        "number": number.number + 1 + index,
                        "token_hash": uuid.uuid4().hex,
                    }
                )
                for index in range(many)
            )
        statements.clear()
        with database_of(client).counting(statements):
            page = client.get(f"/api/v1/studies/{study_id}/participants", params={"limit": 200})
        assert page.status_code == 200
        counts.append(len(statements))
    assert counts[0] == counts[1] <= 15


def test_what_an_experimenter_does_with_a_participant(client: TestClient) -> None:
    sign_up(client)
    with database_of(client).write() as db:
        study = make_study(db)
        token = enrolment.new_token()
        enrolment.enrol(
            db,
            db.get_one(StudyRow, study.id),
            token,
            participant_id=(participant_id := str(uuid.uuid4())),
            origin="experimenter",
        )
    path = f"/api/v1/participants/{participant_id}"
    assert client.get(path).json()["order"]
    excluded = client.post(f"{path}/exclude", json={"reason": "pressed at random"}).json()
    assert excluded["excluded"] == "pressed at random"
    assert client.post(f"{path}/exclude", json={}).status_code == 422
    assert client.post(f"{path}/include").json()["excluded"] is None
    note = {"id": str(uuid.uuid4()), "text": "was late"}
    for _ in range(2):
        noted = client.post(f"{path}/notes", json=note).json()["notes"]
        assert [each["text"] for each in noted] == ["was late"]
    renewed = client.post(f"{path}/link").json()["link"].rsplit("/", 1)[1]
    assert client.get(f"/p/{token}/api/session").status_code == 404
    assert client.get(f"/p/{renewed}/api/session").status_code == 200
    client.post(f"{path}/revoke")
    assert client.get(f"/p/{renewed}/api/session").status_code == 404
    assert client.post(f"{path}/retrain", json={"task": "avoid"}).status_code == 409
    gone = client.post(f"{path}/withdraw", json={"id": str(uuid.uuid4()), "erase": True}).json()
    assert gone["state"] == "withdrawn"
    assert gone["events"] == gone["notes"] == []
    assert client.get("/api/v1/participants/nobody").status_code == 404


def test_an_unopened_startup_link_is_replaced_not_piled_up(client: TestClient) -> None:
    service = client.app.state.service  # type: ignore[attr-defined]
    with service.database.write() as db:
        enrolment.startup_link(db, service.settings)
        before = db.query(ParticipantRow).count()
        token = enrolment.startup_link(db, service.settings)
        assert db.query(ParticipantRow).count() == before
        enrolment.note_seen(enrolment.participant_of(db, token), datetime.now(UTC))
        enrolment.startup_link(db, service.settings)
        assert db.query(ParticipantRow).count() == before + 1
