"""The account page: one's logins and keys, inviting somebody, and what was done."""

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from tests.browser.test_study import assert_accessible
from tests.browser.visitor import LAPTOP, PHONE, sign_up
from tests.running_server import running_server


def opened(browser: Browser, errors: list[str]) -> Page:
    page = browser.new_context(viewport=LAPTOP).new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    return page


def enter(page: Page, name: str) -> None:
    page.get_by_test_id("name").fill(name)
    page.get_by_test_id("password").fill("correct horse")
    page.locator("form#enter button").click()


def test_an_owner_invites_makes_a_key_and_ends_a_login(browser: Browser, tmp_path: Path) -> None:
    with running_server(tmp_path) as server:
        errors: list[str] = []
        owner = opened(browser, errors)
        sign_up(owner, server)
        owner.goto(f"{server.base_url}/account")

        # A login elsewhere is seen here, and ended from here.
        elsewhere = opened(browser, errors)
        elsewhere.goto(f"{server.base_url}/login")
        enter(elsewhere, "ada")
        elsewhere.wait_for_url("**/dashboard")
        owner.reload()
        logins = owner.locator("#logins li")
        expect(logins).to_have_count(2)
        expect(logins.filter(has_text="this browser")).to_have_count(1)
        logins.get_by_role("button").click()
        expect(logins).to_have_count(1)
        elsewhere.goto(f"{server.base_url}/dashboard")
        elsewhere.wait_for_url("**/login")

        # A key is shown once, works, and works no more once it is ended.
        owner.locator("#token [name=name]").fill("analysis")
        owner.locator("#token [name=days]").fill("30")
        owner.get_by_role("button", name="Make a key").click()
        key = owner.get_by_test_id("link").input_value()
        assert re.fullmatch(r"jm_[\w-]{43}", key)
        expect(owner.locator("#tokens")).to_contain_text("never used")
        bearer = {"Authorization": f"Bearer {key}"}
        studies = f"{server.base_url}/api/v1/studies"
        program = elsewhere.context.request
        assert program.get(studies, headers=bearer).status == 200
        owner.reload()
        expect(owner.locator("#tokens")).to_contain_text(", used ")
        expect(owner.get_by_test_id("link")).to_have_count(0)
        owner.get_by_role("button", name="End the key analysis").click()
        expect(owner.locator("#tokens")).to_contain_text("ended")
        assert program.get(studies, headers=bearer).status == 401

        # An invited viewer sees neither keys to make nor others' accounts.
        owner.locator("#invite select").select_option("viewer")
        owner.get_by_role("button", name="Make a link").click()
        elsewhere.goto(owner.get_by_test_id("link").input_value())
        assert_accessible(elsewhere)
        enter(elsewhere, "bob")
        elsewhere.wait_for_url("**/dashboard")
        elsewhere.goto(f"{server.base_url}/account")
        expect(elsewhere.locator("#logins li")).to_have_count(1)
        expect(elsewhere.locator("#token")).to_be_hidden()
        expect(elsewhere.locator("#owners")).to_be_hidden()
        owner.reload()
        expect(owner.locator("#accounts li")).to_have_count(2)
        expect(owner.locator("#audit")).to_contain_text("account.invite")
        row = owner.locator("#accounts li").filter(has_text="bob")
        row.get_by_role("button", name="Let in no more").click()
        expect(row.get_by_role("button")).to_have_text("Let in again")
        elsewhere.goto(f"{server.base_url}/account")
        elsewhere.wait_for_url("**/login")

        owner.locator("body[data-ready='true']").wait_for()
        assert_accessible(owner)
        owner.set_viewport_size(PHONE)
        wide = owner.evaluate("document.documentElement.scrollWidth - innerWidth")
        assert wide <= 0
        assert errors == []
        owner.context.close()
        elsewhere.context.close()
