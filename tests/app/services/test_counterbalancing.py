"""Designs by their laws, and quotas with people who come and go."""

import itertools
from collections import Counter

import pytest

from app.services.counterbalancing import next_cell, orders, williams


@pytest.mark.parametrize("count", range(1, 10))
def test_every_strategy_is_once_in_each_order_and_equally_often_at_each_place(count: int) -> None:
    square = williams(count)
    assert all(sorted(row) == list(range(count)) for row in square)
    for place in range(count):
        at_place = Counter(row[place] for row in square)
        assert len(set(at_place.values())) == 1
        assert len(at_place) == count


@pytest.mark.parametrize("count", range(2, 10))
def test_every_strategy_follows_each_other_equally_often(count: int) -> None:
    pairs = Counter(pair for row in williams(count) for pair in itertools.pairwise(row))
    assert len(pairs) == count * (count - 1)
    assert len(set(pairs.values())) == 1


def test_schemes() -> None:
    names = ("a", "b", "c")
    assert orders("fixed", names) == [names]
    assert sorted(orders("random", names)) == sorted(itertools.permutations(names))
    assert len(orders("williams", names)) == 6
    assert len(orders("williams", (*names, "d"))) == 4
    assert len(orders("random", "abcdefg")) == 14


def test_the_next_one_gets_a_cell_that_fewest_have() -> None:
    assert next_cell({0: 2, 1: 1, 2: 2}, 3, seed=1) == 1
    found = {next_cell({0: 1}, 4, seed=seed) for seed in range(50)}
    assert found == {1, 2, 3}
