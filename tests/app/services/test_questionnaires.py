"""The library's questionnaires, and what they come to."""

import pytest

from app.services.questionnaires import LIBRARY, NASA_TLX, SUS, score

LOADS = ("mental", "physical", "temporal", "performance", "effort", "frustration")


def sus(*values: int | None) -> dict[str, int | str | None]:
    return {f"sus-{number}": value for number, value in enumerate(values, start=1)}


def test_every_questionnaire_stands_under_its_own_name() -> None:
    assert set(LIBRARY) == {"steering", "preference", "nasa-tlx", "sus", "comments"}
    assert all(name == each.name for name, each in LIBRARY.items())


def test_the_load_index_has_its_six_scales_of_21_marks() -> None:
    assert tuple(item.key for item in NASA_TLX.items) == LOADS
    for item in NASA_TLX.items:
        assert (item.low, item.high, item.step) == (0, 100, 5)
        assert item.low_label
        assert item.high_label


def test_raw_load_is_the_mean_of_the_scales() -> None:
    values = dict(zip(LOADS, (70, 5, 40, 20, 55, 50), strict=True))
    assert score("nasa-tlx", values) == {"tlx_raw": 40.0}


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((5, 1, 5, 1, 5, 1, 5, 1, 5, 1), 100.0),
        ((1, 5, 1, 5, 1, 5, 1, 5, 1, 5), 0.0),
        ((3,) * 10, 50.0),
        ((5,) * 10, 50.0),  # who agrees to everything says nothing
        # The filled-in example of Brooke 1996.
        ((5, 4, 2, 1, 2, 3, 2, 4, 5, 2), 55.0),
    ],
)
def test_usability_is_scored_as_published(values: tuple[int, ...], expected: float) -> None:
    assert score("sus", sus(*values)) == {"sus": expected}


def test_the_usability_items_say_good_and_bad_in_turn() -> None:
    best = score("sus", sus(*[5 if number % 2 else 1 for number in range(1, 11)]))
    for number in range(1, 11):
        values = sus(*[5 if other % 2 else 1 for other in range(1, 11)])
        values[f"sus-{number}"] = 3
        assert score("sus", values)["sus"] == best["sus"] - 5.0


def test_there_is_no_score_of_what_was_declined() -> None:
    assert score("sus", sus(*[3] * 9, None)) == {}
    assert score("sus", {}) == {}
    assert score("nasa-tlx", dict.fromkeys(LOADS[1:], 50)) == {}


def test_there_is_no_score_where_none_is_published() -> None:
    assert score("steering", {item.key: 7 for item in LIBRARY["steering"].items}) == {}
    assert score("own", {"a": 1}) == {}


def test_the_items_of_the_usability_scale_are_all_there() -> None:
    assert len(SUS.items) == 10
    assert all((item.low, item.high, item.step) == (1, 5, 1) for item in SUS.items)
