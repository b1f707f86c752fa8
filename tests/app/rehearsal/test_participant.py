"""A simulated participant's part in process, as a study would have it."""

from typing import Any

import numpy as np
import pytest

from app.bots.person import Habits, Person
from app.rehearsal import participant
from app.rehearsal.participant import Part, take_part
from app.teleop.live_session import LiveSession
from models.errors import InputError


def test_who_is_understood_goes_round_twice_and_never_the_same_way() -> None:
    part = Part("avoid", ("all-priors", "all-priors"), 7, number=3)
    first, second = take_part(part)
    for drove in (first, second):
        assert drove.is_success
        assert 8.0 < drove.completion_time_s < 40.0
        # Two turns at the distance that they keep, and not much more.
        assert 1.3 < drove.path_length_m < 2.5
        assert drove.undo_share < 0.2
    assert first != second


def test_a_try_that_does_not_end_well_counts_with_the_time_limit() -> None:
    part = Part("avoid", ("no-align", "no-align"), 7, preference="rotated:180", limit_s=4.0)
    drove = take_part(part)
    assert [(each.is_success, each.completion_time_s) for each in drove] == [(False, 4.0)] * 2
    assert drove[0].path_length_m > 0.05
    assert take_part(part) == drove


def test_they_act_on_what_was_to_be_seen_a_reaction_time_ago(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pushes: list[tuple[float, np.ndarray]] = []
    hands: list[np.ndarray] = []

    def push(self: Person, task: Any, wanted: Any, hand: Any, now_s: float, dt_s: float) -> Any:
        pushes.append((now_s, hand.position))
        assert dt_s == pytest.approx(1 / 30)
        return np.array([1.0, 0.0])

    tick = LiveSession.tick

    def watch(self: LiveSession, now_s: float, dt_s: float) -> None:
        hands.append(self._simulation.hand.position)
        assert now_s == pytest.approx((len(hands) - 1) / 60)
        tick(self, now_s, dt_s)

    monkeypatch.setattr(Person, "push", push)
    monkeypatch.setattr(LiveSession, "tick", watch)
    take_part(Part("avoid", ("no-align",), 7, habits=Habits(reaction_s=0.5), limit_s=1.5))
    assert [round(now_s, 6) for now_s, _ in pushes[:3]] == [0.5, 0.533333, 0.566667]
    for number, (_, hand) in enumerate(pushes):
        np.testing.assert_array_equal(hand, hands[2 * number])
    assert np.linalg.norm(hands[-1] - hands[0]) > 0.02


def test_noise_is_in_their_answers_and_who_they_are_in_all_of_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: list[np.ndarray] = []

    def keep(part: Part, lab: Any, labels: Any, seed: int) -> dict[str, Any]:
        given.append(labels.human_inputs)
        return {}

    monkeypatch.setattr(participant, "_learn", keep)
    for noise, number in ((0.0, 0), (0.3, 0), (0.0, 1)):
        take_part(Part("avoid", (), 7, habits=Habits(label_noise=noise), number=number))
    exact, noisy, other = given
    assert exact.shape == (7, 2)
    off = np.linalg.norm(noisy - exact) / np.linalg.norm(exact)
    assert 0.05 < off < 0.6
    assert np.linalg.norm(other - exact) > 0.5


def test_what_nobody_could_do_is_refused_at_once() -> None:
    with pytest.raises(InputError, match="no preference 'upside-down'"):
        Part("avoid", ("no-align",), 7, preference="upside-down").check()
