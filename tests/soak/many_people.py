"""Ten thousand people come and leave, and ten thousand answers are sent again and again.

Run ``python -m tests.soak.many_people``; it prints what was found and ends with 1 if any of it is
not as it should be.
"""

import argparse
import sys
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from app.storage.database import Database, migrate
from tests.app.crowds import CELLS, PLACES, answer_from_two_tabs, come_and_leave, write_at_once

SEED = 20261125
WRITERS = 200
# A study of two hundred who all answer at the same time, each after some seconds of thought.
PAUSE_S = 5.0


@contextmanager
def fresh() -> Generator[Database]:
    """An empty database."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joymap.db"
        migrate(path)
        database = Database(path)
        yield database
        database.close()


def coming(people: int) -> bool:
    """People enrol; three of ten leave before they drive."""
    with fresh() as database:
        found = come_and_leave(database, people, SEED)
    even = {cell: PLACES // CELLS for cell in range(CELLS)}
    exact = sum(dict(each) == even for each in found.completed)
    print(
        f"{found.came} enrolled, {found.left} left; {exact} of {len(found.completed)} studies with"
        f" exactly {even[0]} in each order; never more than {found.worst} apart"
    )
    return exact == len(found.completed) and found.worst <= 1


def answering(answers: int) -> bool:
    """Answers are sent one to five times from two tabs."""
    people = max(answers // 500, 1)
    with fresh() as database:
        found = answer_from_two_tabs(database, answers // people, people, SEED)
    print(
        f"{len(found.sent)} answers, each sent one to five times from two tabs: {len(found.kept)}"
        f" rows, {len(found.refused)} refused, {len(found.wrong)} errors"
    )
    return sorted(found.kept) == sorted(found.sent) and not found.refused and not found.wrong


def writing(writes: int, pause_s: float) -> bool:
    """Two hundred write at once."""
    with fresh() as database:
        waits, wrong = write_at_once(database, WRITERS, writes, pause_s)
    median, p99 = 1000.0 * np.quantile(waits, [0.5, 0.99])
    how = f"each every {pause_s:g} s" if pause_s else "each again at once"
    print(
        f"{WRITERS} writers, {how}: {len(waits)} transactions, {len(wrong)} errors,"
        f" median {median:.1f} ms, p99 {p99:.1f} ms"
    )
    return not wrong


def main() -> int:
    """Do it all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=10_000)
    parser.add_argument("--answers", type=int, default=10_000)
    chosen = parser.parse_args()
    good = [
        coming(chosen.people),
        answering(chosen.answers),
        writing(10, PAUSE_S),
        writing(10, 0.0),
    ]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
