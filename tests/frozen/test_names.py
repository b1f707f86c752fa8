"""Names that others rely on stay; new ones are frozen on purpose."""

from pathlib import Path
from typing import Any

import pytest

from tests.frozen import names
from tests.frozen.exported import Export
from tests.frozen.names import Names
from tests.frozen.today import TodaysServer


@pytest.fixture(scope="session")
def names_now(
    new_export: Export,
    figures: Path,
    simulation: Path,
    server: TodaysServer,
    told: list[dict[str, Any]],
    tmp_path_factory: pytest.TempPathFactory,
) -> Names:
    scratch = tmp_path_factory.mktemp("alignments")
    return names.collect(new_export, figures, simulation, server, told, scratch)


def test_every_frozen_name_is_still_there(names_now: Names) -> None:
    gone = names.missing(names.frozen(), names_now)
    assert not gone, "put back what others rely on:\n" + "\n".join(gone)


def test_every_name_is_frozen(names_now: Names) -> None:
    new = names.missing(names_now, names.frozen())
    assert not new, "to keep them: python -m tests.frozen.names --add\n" + "\n".join(new)


def test_the_file_of_names_is_in_order() -> None:
    kept = names.frozen()
    assert all(found == sorted(set(found)) for places in kept.values() for found in places.values())
    assert sum(len(found) for places in kept.values() for found in places.values()) > 2500
