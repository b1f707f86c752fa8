from itertools import pairwise

import pytest

from app.analysis.simulation_grid import Grid, running_order
from models.errors import InputError
from models.experiment import Cell


def make_grid(**values: object) -> Grid:
    given: dict[str, object] = {
        "tasks": ("plane", "reach-and-pour"),
        "methods": ("all-priors", "no-align"),
        "noises": (0.5, 0.0),
        "seeds": (3, 4),
        "labels": None,
        "unlabelled": None,
        "preferences": ("random",),
        "queries": ("random",),
        "controllers": ("autoencoder",),
        "wrong_answers": (0.0,),
        "rotation_weight": 10.0,
    }
    return Grid(**given | values)  # type: ignore[arg-type]


def test_cells_come_in_the_order_of_the_columns_and_of_the_lists() -> None:
    cells = make_grid().cells()
    assert len(cells) == 2 * 2 * 2 * 2
    first = [(c.task, c.method, c.noise, c.seed) for c in cells[:5]]
    assert first == [
        ("plane", "all-priors", 0.5, 3),
        ("plane", "all-priors", 0.5, 4),
        ("plane", "all-priors", 0.0, 3),
        ("plane", "all-priors", 0.0, 4),
        ("plane", "no-align", 0.5, 3),
    ]


def test_a_task_has_the_papers_numbers_of_moves_unless_others_are_given() -> None:
    papers = {(c.task, c.labels, c.unlabelled) for c in make_grid().cells()}
    assert papers == {("plane", 10, 1000), ("reach-and-pour", 20, 2000)}
    given = {(c.labels, c.unlabelled) for c in make_grid(labels=(3, 5), unlabelled=50).cells()}
    assert given == {(3, 50), (5, 50)}


def test_a_cell_that_cannot_be_run_is_refused_before_any_is() -> None:
    with pytest.raises(InputError, match="wrong-answers must lie between 0 and 1"):
        make_grid(wrong_answers=(0.0, 2.0)).cells()


def test_cells_that_share_their_moves_are_run_side_by_side() -> None:
    cells = make_grid().cells()
    ordered = running_order(cells)
    assert set(ordered) == set(cells)
    worlds = [(c.task, c.seed) for c in ordered]
    changes = sum(before != after for before, after in pairwise(worlds))
    assert changes == len(set(worlds)) - 1


def test_the_rotation_weight_is_part_of_a_cell() -> None:
    assert make_grid(rotation_weight=2.0).cells()[0] == Cell(
        "plane", "all-priors", 0.5, 3, 10, 1000, rotation_weight=2.0
    )
