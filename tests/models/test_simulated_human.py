from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from models.errors import InputError
from models.kinematics import HandPose
from models.preferences import Preference, axes, mirrored, random_preference, rotated
from models.simulated_human import SimulatedHuman, sensitivity


def hand_at(x, y):
    return HandPose(np.array([x, y, 0.25]), np.diag([1.0, -1.0, -1.0]))


def moved(x, y):
    return hand_at(0.5, 0.0), hand_at(0.5 + x, y)


@pytest.fixture
def human(plane):
    return SimulatedHuman(plane, axes(), np.array([0.02, 0.01]))


def test_they_answer_with_the_move_over_their_sensitivity(human):
    assert_allclose(human.label(*moved(0.01, -0.005)), [0.5, -0.5], atol=1e-12)


def test_what_they_wish_for_is_what_they_would_answer_with(human, rng):
    turned = replace(human, preference=mirrored(rotated(33.0)))
    h = rng.uniform(-1, 1, (50, 2))
    assert_allclose(turned.answer(turned.wish(h)), h, atol=1e-12)


def test_a_quarter_turn_makes_right_mean_up(human):
    turned = replace(human, preference=rotated(90.0), kappa=np.array([0.02, 0.02]))
    assert_allclose(turned.label(*moved(0.02, 0.0)), [0.0, 1.0], atol=1e-12)


def test_a_mirrored_preference_changes_hands_and_a_turned_one_does_not():
    assert np.linalg.det(rotated(77.0).matrix) == pytest.approx(1.0)
    assert np.linalg.det(mirrored(rotated(77.0)).matrix) == pytest.approx(-1.0)


def test_random_preferences_are_of_both_hands(rng):
    hands = {round(np.linalg.det(random_preference(rng).matrix)) for _ in range(50)}
    assert hands == {-1, 1}


def test_the_stick_ends_at_its_edge_and_keeps_its_direction(human):
    h = human.label(*moved(0.06, 0.03))
    assert_allclose(np.linalg.norm(h), 1.0)
    assert_allclose(h[0], h[1])


def test_noise_is_as_long_as_they_are_noisy(human, rng):
    before, after = moved(0.01, 0.0)
    many = 20_000
    start = HandPose(np.tile(before.position, (many, 1)), np.tile(before.rotation, (many, 1, 1)))
    end = HandPose(np.tile(after.position, (many, 1)), np.tile(after.rotation, (many, 1, 1)))
    noise = replace(human, noise_cv=0.2).label(start, end, rng) - human.label(start, end)
    assert np.sqrt(np.mean(np.sum(noise**2, axis=1))) == pytest.approx(0.2 * 0.5, rel=0.03)


def test_someone_who_always_pushes_fully_says_nothing_of_the_length(human):
    full = replace(human, always_full=True)
    assert_allclose(full.label(*moved(0.001, 0.0)), [1.0, 0.0])
    assert_allclose(full.label(*moved(0.0, 0.0)), [0.0, 0.0])


def test_full_stick_is_a_long_step_of_the_pool(plane, kinematics, pool):
    kappa = sensitivity(plane, kinematics, pool)
    assert kappa[0] == kappa[1]
    assert np.median(pool.travel_m) < kappa[0] <= pool.travel_m.max()


def test_noise_without_chance_is_refused(human):
    with pytest.raises(InputError, match="random generator"):
        replace(human, noise_cv=0.1).label(*moved(0.01, 0.0))


def test_a_preference_that_loses_a_direction_is_refused(human):
    with pytest.raises(InputError, match="invertible"):
        replace(human, preference=Preference(np.ones((2, 2))))
    with pytest.raises(InputError, match="positive"):
        replace(human, kappa=np.zeros(2))
