"""Questions chosen so that few suffice: who answers as one person would is asked less."""

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from app.main import create_app
from app.services import queries
from app.settings import Settings
from app.storage.database import migrate
from app.storage.tables import AlignmentRow, AnswerRow, JobRow, QueryRow
from models.panda_pack import default_folder
from models.preferences import parse_preference
from models.simulated_human import SimulatedHuman
from models.tasks import get_task
from tests.app.routers.test_participants import Page

WANTED = 12


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[TestClient]:
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("data"),
        panda_dir=default_folder(),
        training_steps=60,
        queries="designed",
        labels_wanted=WANTED,
        enough_error=0.05,
    )
    migrate(settings.database_path)
    with TestClient(create_app(settings)) as client:
        yield client


def answer_until_enough(page: Page, noise_cv: float) -> int:
    """Answer as a mirrored person would, until the questions end; how many that took."""
    service: Any = page.client.app.state.service  # type: ignore[attr-defined]
    unit_m = service.steps.survey("plane").unit_m
    preference = parse_preference("mirrored+rotated:30", np.random.default_rng(0))
    person = SimulatedHuman(get_task("plane"), preference, np.full(2, unit_m), noise_cv)
    rng = np.random.default_rng(5)
    asked = page.begin()
    moves = {row.id: row for row in page.rows(QueryRow)}
    for count, query_id in enumerate(asked, start=1):
        before, after = (
            service.steps.kinematics.hand_pose(np.array(q))
            for q in (moves[query_id].s, moves[query_id].next_s)
        )
        h = person.label(before, after, rng)
        if page.answer(query_id, h=[float(x) for x in h]).json()["step"] == "training":
            return count
    raise AssertionError("The questions never ended.")


def test_someone_of_one_mind_is_asked_the_least(client: TestClient) -> None:
    page = Page(client)
    assert answer_until_enough(page, noise_cv=0.0) == queries.LABELS_NEEDED
    assert len(page.rows(JobRow)) == 1
    assert len(page.rows(AnswerRow)) == queries.LABELS_NEEDED


def test_someone_noisy_is_asked_more_but_never_more_than_the_most(client: TestClient) -> None:
    assert queries.LABELS_NEEDED < answer_until_enough(Page(client), noise_cv=0.3) <= WANTED


def test_the_page_is_told_that_fewer_may_do(client: TestClient) -> None:
    session = Page(client).get("session").json()
    assert session["may_end_early"] is True
    assert session["labels_wanted"] == WANTED


def test_the_moves_asked_about_are_as_varied_as_the_design_wants(client: TestClient) -> None:
    page = Page(client)
    page.begin()
    rows = sorted(page.rows(QueryRow), key=lambda row: int(row.position))
    hands = [np.array(row.hand_path) for row in rows[:4]]
    ways = np.array([(path[-1] - path[0])[:2] for path in hands])
    angles = np.degrees(np.arctan2(ways[:, 1], ways[:, 0])) % 180.0
    crossed = np.abs((angles[:, None] - angles[None] + 90.0) % 180.0 - 90.0)
    assert crossed.max() > 60.0, "the first questions cross each other"
    assert not page.rows(AlignmentRow)
