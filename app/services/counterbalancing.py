"""Who gets the strategies in which order: designs, and the place in a design of who comes next.

Pure: rows and counts in, orders and cells out. A *cell* is one order of the strategies; it is the
same for all tasks of a study, so that a person's ways of steering come in one rhythm.
"""

import itertools
import random
from collections.abc import Mapping, Sequence


def williams(count: int) -> list[tuple[int, ...]]:
    """A Williams design: every strategy once at each place, and after each other one equally often.

    ``count`` orders if that is even, twice as many if it is odd. Source: E. J. Williams,
    "Experimental designs balanced for the estimation of residual effects of treatments", 1949.
    """
    # 0, 1, n-1, 2, n-2, …: neighbours differ by each amount once.
    first = [0] + [
        (index + 1) // 2 if index % 2 else count - index // 2 for index in range(1, count)
    ]
    square = [tuple((value + shift) % count for value in first) for shift in range(count)]
    if count % 2 == 1 and count > 1:
        square += [tuple(reversed(row)) for row in square]
    return square


def orders(scheme: str, strategies: Sequence[str]) -> list[tuple[str, ...]]:
    """All orders of a scheme, one a cell: ``williams``, ``random`` (every order) or ``fixed``.

    With more than five strategies ``random`` is a Williams design too: all orders would be more
    than people.
    """
    if scheme == "fixed":
        return [tuple(strategies)]
    if scheme == "random" and len(strategies) <= 5:
        return list(itertools.permutations(strategies))
    return [tuple(strategies[index] for index in row) for row in williams(len(strategies))]


def next_cell(counts: Mapping[int, int], cells: int, seed: int) -> int:
    """The cell for who comes next: one of those that fewest have, by chance from ``seed``.

    Args:
        counts: How many completed or take part now, by cell.
        cells: How many cells there are.
        seed: Of the chance among the emptiest.
    """
    fewest = min(counts.get(cell, 0) for cell in range(cells))
    emptiest = [cell for cell in range(cells) if counts.get(cell, 0) == fewest]
    return random.Random(seed).choice(emptiest)
