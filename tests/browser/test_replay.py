"""An experimenter looks at a drive again; before, its driver saw where the stick leads."""

from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, expect

from app.storage.tables import SampleChunkRow
from app.storage.ticks import unpack
from tests.app.test_running_server import answer_all
from tests.browser.visitor import Visitor, sign_up
from tests.running_server import Participant, running_server


def test_a_drive_with_arrows_is_seen_again(browser: Browser, tmp_path: Path) -> None:
    with running_server(tmp_path, task="avoid", training_steps=60) as server:
        participant = Participant(server.participant_link)
        answer_all(participant)
        participant.wait_for_training()
        participant.post("driving").raise_for_status()
        driver = Visitor(browser, server.participant_link, has_picture=False)
        driver.wait_for_step("driving")
        page = driver.page
        expect(page.get_by_test_id("hold")).to_have_text("Released: the arm holds")
        page.get_by_test_id("arrows").check()
        expect(page.get_by_test_id("stick")).to_have_attribute("data-ways", "true")
        page.keyboard.down("ArrowUp")
        page.wait_for_timeout(1500)
        page.keyboard.up("ArrowUp")
        expect(page.get_by_test_id("arrows")).to_be_checked()
        page.get_by_test_id("give-up").click()
        expect(page.get_by_test_id("attempt-says")).to_have_text("Given up.")
        driver.wait(lambda: len(server.rows(SampleChunkRow)) > 0)
        page.wait_for_timeout(800)
        driver.close()
        rows = np.concatenate([unpack(chunk.samples) for chunk in server.rows(SampleChunkRow)])

        context = browser.new_context(device_scale_factor=0.5)
        page = context.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        sign_up(page, server)
        page.get_by_test_id("study-demo").click()
        page.get_by_role("link", name="P-1").click()
        expect(page.get_by_test_id("drives")).to_contain_text("given up")
        page.get_by_test_id("replay").click()
        expect(page.get_by_test_id("measures")).to_contain_text("Touches")
        expect(page.locator("body")).to_have_attribute("data-tick", "0")
        page.get_by_test_id("speed").select_option("4")
        page.get_by_test_id("play").click()
        end = str(len(rows) - 1)
        expect(page.locator("body")).to_have_attribute("data-tick", end)
        expect(page.get_by_test_id("play")).to_have_text("Play")
        page.get_by_test_id("slider").fill("10")
        expect(page.locator("body")).to_have_attribute("data-tick", "10")
        assert errors == []
        context.close()
