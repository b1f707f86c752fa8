import numpy as np
import pytest
from numpy.testing import assert_allclose

from models.errors import InputError
from models.preferences import parse_preference, rotated

WORDS = [
    "axes",
    "random",
    "rotated:30",
    "mirrored",
    "swapped",
    "polar",
    "expo:0.7",
    "gain:0.6",
    "random+polar+expo:1.5+gain:0.5",
]


@pytest.mark.parametrize("text", WORDS)
def test_the_move_meant_by_a_stick_is_the_one_that_it_is_given_for(text, rng):
    preference = parse_preference(text, rng)
    moves, azimuth = rng.uniform(-0.7, 0.7, (50, 2)), rng.uniform(-1, 1, 50)
    h = preference.stick(moves, azimuth)
    assert_allclose(preference.move(h, azimuth), moves, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "stick"),
    [
        ("axes", [0.4, 0.2]),
        ("mirrored", [-0.4, 0.2]),
        ("swapped", [0.2, 0.4]),
        ("rotated:90", [-0.2, 0.4]),
        ("mirrored+rotated:90", [-0.2, -0.4]),
        ("gain:0.5", [0.2, 0.1]),
        ("polar", [0.2, -0.4]),
    ],
)
def test_every_word_means_what_it_says(text, stick, rng):
    preference = parse_preference(text, rng)
    # Seen from the base, the hand is to the left: away from the base is along y.
    h = preference.stick(np.array([0.4, 0.2]), np.array(0.5 * np.pi))
    assert_allclose(h, stick, atol=1e-12)


def test_a_curved_response_keeps_the_direction(rng):
    h = parse_preference("expo:0.5", rng).stick(np.array([0.09, 0.12]), np.array(0.0))
    assert_allclose(np.linalg.norm(h), np.sqrt(0.15))
    assert_allclose(h[1] / h[0], 0.12 / 0.09)


def test_random_is_the_same_for_the_same_chance_and_of_both_hands():
    def drawn(seed):
        return parse_preference("random", np.random.default_rng(seed)).matrix

    assert_allclose(drawn(3), drawn(3))
    assert {round(np.linalg.det(drawn(seed))) for seed in range(20)} == {-1, 1}


@pytest.mark.parametrize(
    "text", ["", "sideways", "expo", "expo:", "expo:x", "expo:nan", "expo:9", "gain:0", "gain:2"]
)
def test_what_is_no_preference_is_refused_in_one_sentence(text, rng):
    with pytest.raises(InputError) as refusal:
        parse_preference(text, rng)
    assert "\n" not in str(refusal.value)


def test_a_rotation_is_counted_from_right_to_up():
    assert_allclose(rotated(90.0).matrix @ [1.0, 0.0], [0.0, 1.0], atol=1e-12)
