"""Experimenters' accounts, without a server: logins, keys, invitations, and the doorkeeper."""

import threading
import uuid
from datetime import timedelta
from pathlib import Path
from typing import Literal

import pytest
from argon2 import PasswordHasher
from sqlalchemy.orm import Session

from app.doors import TooOften
from app.errors import IdReused, NotAllowed, UsedSetupLink
from app.services import accounts
from app.services.accounts import (
    BadAccount,
    Experimenter,
    NoSuchAccount,
    Role,
    WrongPassword,
    experimenter_of,
)
from app.services.doorkeeping import Doorkeeper
from app.services.enrolment import hash_of
from app.storage import access
from app.storage.database import Database
from app.storage.tables import ApiTokenRow, AuditRow, ExperimenterRow, LoginRow
from tests.app.factories import now

PASSWORD = "correct horse"
HASH = PasswordHasher().hash(PASSWORD)


def account(
    db: Session, name: str = "ada", role: Role = "owner", made_by: str | None = None
) -> tuple[Experimenter, str]:
    """Somebody new, and the token of their login."""
    login = accounts.sign_up(db, accounts.new_setup_link(db, role, made_by), name, HASH)
    return experimenter_of(db, login, None), login


def is_in(db: Session, login: str | None, key: str | None = None) -> bool:
    try:
        experimenter_of(db, login, key)
    except NotAllowed:
        return False
    return True


def new_key(db: Session, who: Experimenter, days: int | None = None) -> tuple[str, ApiTokenRow]:
    token_id = str(uuid.uuid4())
    token = accounts.new_api_token(db, who, token_id, "robot", "write", days)
    db.flush()
    return token, db.get_one(ApiTokenRow, token_id)


def test_of_tokens_and_passwords_only_hashes_are_kept(database: Database, tmp_path: Path) -> None:
    with database.write() as db:
        link = accounts.new_setup_link(db)
        login = accounts.sign_up(db, link, "ada", HASH)
        token, _ = new_key(db, experimenter_of(db, login, None))
    assert token.startswith("jm_")
    assert len(token) >= 43 + 3
    content = b"".join(path.read_bytes() for path in tmp_path.glob("joymap.db*"))
    for secret in (link, login, token, PASSWORD):
        assert secret.encode() not in content
    assert hash_of(token).encode() in content


def test_a_login_ends_by_itself_and_past_ones_are_deleted(database: Database) -> None:
    with database.write() as db:
        _, login = account(db)
        row = db.get_one(LoginRow, hash_of(login))
        assert row.expires_at - row.created_at == timedelta(days=14)
        row.expires_at = now() - timedelta(seconds=1)
        db.flush()
        assert not is_in(db, login)
        accounts.log_in(db, "ada", HASH)
        assert len(db.query(LoginRow).all()) == 1


def test_one_ends_ones_own_logins_only(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        other = accounts.log_in(db, "ada", HASH)
        _, bobs = account(db, "bob", "viewer", ada.id)
        with pytest.raises(NoSuchAccount):
            accounts.end_login(db, ada, accounts.login_id(hash_of(bobs)))
        accounts.end_login(db, ada, accounts.login_id(hash_of(other)))
        db.flush()
        assert not is_in(db, other)
        assert is_in(db, bobs)


def test_another_password_ends_logins_and_keys(database: Database) -> None:
    with database.write() as db:
        ada, login = account(db)
        bob, bobs = account(db, "bob", "viewer", ada.id)
        token, _ = new_key(db, ada)
        bobs_token, _ = new_key(db, bob)
        assert is_in(db, None, token)
        accounts.change_password(db, ada, PasswordHasher().hash("another one"))
        db.flush()
        db.expire_all()
        assert not is_in(db, login)
        assert not is_in(db, None, token)
        assert is_in(db, bobs)
        assert is_in(db, None, bobs_token)


def test_a_key_is_noted_as_used_once_a_minute(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        token, row = new_key(db, ada)
        me = experimenter_of(db, None, token)
        assert me.by_key
        assert me.key_id == row.id
        accounts.note_use(db, row.id)
        assert experimenter_of(db, None, token).key_id is None
        row.used_at = now() - timedelta(seconds=61)
        assert experimenter_of(db, None, token).key_id == row.id


def test_a_key_runs_out_and_its_id_is_used_once(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        token, row = new_key(db, ada, days=1)
        with pytest.raises(IdReused):
            accounts.new_api_token(db, ada, row.id, "again", "read", None)
        assert row.expires_at is not None
        row.expires_at = now()
        assert not is_in(db, None, token)


def test_who_is_disabled_loses_logins_keys_and_invitations(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        bob, bobs = account(db, "bob", "owner", ada.id)
        token, _ = new_key(db, bob)
        invitation = accounts.new_setup_link(db, "owner", bob.id)
        accounts.change(db, ada, bob.id, role=None, disabled=True)
        db.flush()
        db.expire_all()
        assert not is_in(db, bobs)
        assert not is_in(db, None, token)
        with pytest.raises(UsedSetupLink):
            accounts.check_setup_link(db, invitation)
        with pytest.raises(WrongPassword):
            accounts.log_in(db, "bob", HASH)
        accounts.change(db, ada, bob.id, role=None, disabled=False)
        db.flush()
        db.expire_all()
        assert not is_in(db, bobs)  # they log in anew
        assert is_in(db, accounts.log_in(db, "bob", HASH))


def test_somebody_stays_owner(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        for change in ({"role": "viewer", "disabled": None}, {"role": None, "disabled": True}):
            with pytest.raises(BadAccount):
                accounts.change(db, ada, ada.id, **change)
        bob, _ = account(db, "bob", "owner", ada.id)
        accounts.change(db, ada, bob.id, role=None, disabled=True)
        db.flush()
        accounts.change(db, ada, bob.id, role="viewer", disabled=None)  # was no owner that counts
        with pytest.raises(BadAccount):
            accounts.change(db, ada, ada.id, role="assistant", disabled=None)


def test_a_change_and_its_entry_are_one(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        bob, _ = account(db, "bob", "viewer", ada.id)
    with pytest.raises(RuntimeError), database.write() as db:
        accounts.change(db, ada, bob.id, role="assistant", disabled=None)
        raise RuntimeError
    with database.write() as db:
        assert db.get_one(ExperimenterRow, bob.id).role == "viewer"
        assert db.query(AuditRow).filter_by(action="account.change").count() == 0
        accounts.change(db, ada, bob.id, role="assistant", disabled=None)
    with database.read() as db:
        (entry,) = db.query(AuditRow).filter_by(action="account.change")
        assert (entry.experimenter_id, entry.subject) == (ada.id, bob.id)
        assert entry.detail["role"] == "assistant"


def test_the_servers_link_is_the_latest_and_invitations_stay(database: Database) -> None:
    with database.write() as db:
        ada, _ = account(db)
        invitation = accounts.new_setup_link(db, "assistant", ada.id)
        first = accounts.new_setup_link(db)
        second = accounts.new_setup_link(db)
        with pytest.raises(UsedSetupLink):
            accounts.check_setup_link(db, first)
        accounts.check_setup_link(db, second)
        login = accounts.sign_up(db, invitation, "bob", HASH)
        assert experimenter_of(db, login, None).role == "assistant"
        with pytest.raises(BadAccount):
            accounts.sign_up(db, second, "bob", HASH)
        accounts.check_setup_link(db, second)  # a name that is taken uses nothing up


def test_names_are_lower_case_and_passwords_long_enough() -> None:
    assert accounts.clean_name("  Ada Lovelace ") == "ada lovelace"
    for bad in ("", "   ", "x" * 65, "a\nb", "a\u202eb"):
        with pytest.raises(BadAccount):
            accounts.clean_name(bad)
    for bad in ("123456789", "x" * 1001):
        with pytest.raises(BadAccount):
            accounts.hashed(bad)
    assert accounts.fits(accounts.hashed("1234567890"), "1234567890")
    assert not accounts.fits(HASH, "wrong horse")
    assert not accounts.fits(None, PASSWORD)


def test_nobody_takes_as_long_to_refuse_as_somebody(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[str] = []

    class Watched(PasswordHasher):
        def verify(self, hash: str | bytes, password: str | bytes) -> Literal[True]:
            compared.append(str(hash))
            return super().verify(hash, password)

    monkeypatch.setattr(accounts, "_HASHER", Watched())
    for kept in (HASH, None):
        assert not accounts.fits(kept, "wrong horse")
    first, second = (hashed.split("$")[1:4] for hashed in compared)
    assert first == second  # argon2id with the same memory, time and lanes


def test_a_weakly_hashed_password_is_hashed_anew_at_the_next_login(database: Database) -> None:
    weak = PasswordHasher(time_cost=1, memory_cost=1024).hash(PASSWORD)
    with database.write() as db:
        accounts.sign_up(db, accounts.new_setup_link(db), "ada", weak)
    better = accounts.rehashed(weak, PASSWORD)
    assert better is not None
    assert accounts.fits(better, PASSWORD)
    assert accounts.rehashed(HASH, PASSWORD) is None
    with database.write() as db:
        accounts.log_in(db, "ada", weak, better)
        found = access.by_name(db, "ada")
        assert found is not None
        assert found.password_hash == better
        with pytest.raises(WrongPassword):  # compared with what is kept no more
            accounts.log_in(db, "ada", weak)


# The doorkeeper.


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_so_many_knocks_a_minute_each_by_their_own_name() -> None:
    clock = Clock()
    door = Doorkeeper(clock)
    for _ in range(3):
        door.admit("ada", 3)
        clock.now += 10.0
    with pytest.raises(TooOften) as refused:
        door.admit("ada", 3)
    assert refused.value.wait_s == 30
    door.admit("bob", 3)
    clock.now += 29.0
    with pytest.raises(TooOften):
        door.admit("ada", 3)
    clock.now += 1.0
    door.admit("ada", 3)  # what was refused did not count


def test_the_doorkeepers_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.services.doorkeeping._KEPT", 5)
    door = Doorkeeper(Clock())
    for name in range(50):
        door.admit(str(name), 1)
    assert len(door._knocks) == 5
    with pytest.raises(TooOften):
        door.admit("49", 1)


def test_knocks_from_many_threads_are_counted_each() -> None:
    door, let_in = Doorkeeper(Clock()), []

    def knock() -> None:
        for _ in range(200):
            try:
                door.admit("ada", 500)
                let_in.append(1)
            except TooOften:
                pass

    threads = [threading.Thread(target=knock) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(let_in) == 500
