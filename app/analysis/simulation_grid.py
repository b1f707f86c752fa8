"""The cells of a grid: every combination of the factors, in a fixed order."""

from dataclasses import dataclass
from itertools import product

from models.experiment import PAPER_LABELS, PAPER_UNLABELLED, Cell
from models.tasks import get_task


@dataclass(frozen=True)
class Grid:
    """What is varied, and over which values; each is a value of a :class:`Cell`.

    Attributes:
        labels: K; ``None`` for the paper's, which depends on the task.
        unlabelled: N; ``None`` for the paper's.
    """

    tasks: tuple[str, ...]
    methods: tuple[str, ...]
    noises: tuple[float, ...]
    seeds: tuple[int, ...]
    labels: tuple[int, ...] | None
    unlabelled: int | None
    preferences: tuple[str, ...]
    queries: tuple[str, ...]
    controllers: tuple[str, ...]
    wrong_answers: tuple[float, ...]
    rotation_weight: float

    def cells(self) -> list[Cell]:
        """Every combination, ordered by the columns of a row from left to right.

        Raises:
            InputError: If a cell cannot be run.
            UnknownTaskError: If there is no such task.
        """
        cells = [cell for task in self.tasks for cell in self._cells_of(get_task(task).name)]
        for cell in cells:
            cell.check()
        return cells

    def _cells_of(self, task: str) -> list[Cell]:
        combinations = product(
            self.methods,
            self.noises,
            self.seeds,
            self.labels or (PAPER_LABELS.get(task, PAPER_LABELS["plane"]),),
            (self.unlabelled or PAPER_UNLABELLED.get(task, PAPER_UNLABELLED["plane"]),),
            self.preferences,
            self.queries,
            self.controllers,
            self.wrong_answers,
        )
        return [Cell(task, *factors, self.rotation_weight) for factors in combinations]


def running_order(cells: list[Cell]) -> list[Cell]:
    """The same cells with those together that share their moves, which a worker keeps at hand."""
    return sorted(cells, key=lambda cell: (cell.task, cell.controller, cell.unlabelled, cell.seed))
