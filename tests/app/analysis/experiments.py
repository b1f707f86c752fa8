"""Rows made by hand, and experiments that are over at once; workers import them by name."""

import os
from collections.abc import Iterable
from dataclasses import asdict
from itertools import product
from typing import Any

from models.errors import InputError
from models.experiment import (
    METHODS,
    PAPER_LABELS,
    PAPER_NOISES,
    PAPER_TASKS,
    PAPER_UNLABELLED,
    Cell,
    Row,
)

ROTATION_WEIGHT = 10.0
# Position errors with which everything holds that was claimed and asked for.
GOOD = {
    "no-align": 1.4,
    "manual-align": 0.5,
    "no-priors": 0.6,
    "proportionality": 0.11,
    "reversibility": 0.12,
    "consistency": 0.1,
    "all-priors": 0.02,
    "ideal-align": 0.018,
    "task-space": 0.005,
}


def make_row(**values: Any) -> Row:
    """A row of the plane; the errors follow from ``position_error``."""
    position = values.get("position_error", 0.1)
    given: dict[str, Any] = {
        "task": "plane",
        "method": "all-priors",
        "noise": 0.0,
        "seed": 0,
        "labels": 10,
        "unlabelled": 1000,
        "preference": "random",
        "queries": "random",
        "controller": "autoencoder",
        "wrong_answers": 0.0,
        "position_error": position,
        "rotation_error": position / 100.0,
        "alignment_error": position + ROTATION_WEIGHT * position / 100.0,
        "motion_gain": 1.0,
        "training_seconds": 0.1,
    }
    return Row(**given | values)


def paper_rows(
    errors: dict[str, float] = GOOD,
    tasks: Iterable[str] = PAPER_TASKS,
    seeds: int = 10,
) -> list[Row]:
    """The paper's grid: each method has its error, a little more with each seed.

    Answers alone do worse with each task, so that priors matter more.
    """
    harder = dict(zip(PAPER_TASKS, (1.0, 1.2, 1.5), strict=True))
    return [
        make_row(
            task=task,
            method=method,
            noise=noise,
            seed=seed,
            labels=PAPER_LABELS[task],
            unlabelled=PAPER_UNLABELLED[task],
            position_error=errors[method]
            * (1.0 + 0.01 * seed)
            * (harder[task] if method == "no-priors" else 1.0),
        )
        for task, method, noise, seed in product(
            tasks, (name for name in METHODS if name in errors), PAPER_NOISES, range(seeds)
        )
    ]


def labels_rows(designed: float = 0.1) -> list[Row]:
    """Errors that fall with the number of labels; designed questions are that much better."""
    return [
        make_row(
            task=task,
            method=method,
            noise=0.1,
            seed=seed,
            labels=labels,
            queries=queries,
            position_error=(designed if queries == "designed" else 0.5) / labels,
        )
        for task, method, queries, labels, seed in product(
            PAPER_LABELS,
            ("no-priors", "all-priors", "task-space"),
            ("random", "designed"),
            (3, 5, 8, 10, 20),
            range(2),
        )
    ]


def people_rows(task_space: float = 0.005) -> list[Row]:
    """Three kinds of people at two noise levels, and wrong answers at one of them."""
    errors = {"all-priors": 0.02, "task-space": task_space}
    kinds = [
        (preference, noise, 0.0)
        for preference, noise in product(("axes", "polar", "expo:0.7"), (0.0, 0.1))
    ]
    return [
        make_row(
            task=task,
            method=method,
            seed=seed,
            preference=preference,
            noise=noise,
            wrong_answers=share,
            position_error=errors[method] * (1.0 + share),
        )
        for task, method, seed, (preference, noise, share) in product(
            PAPER_LABELS, errors, range(2), [*kinds, ("axes", 0.1, 0.2)]
        )
    ]


def controllers_rows(manual_on_warped: float = 0.9) -> list[Row]:
    """Two controllers on the plane."""
    return [
        make_row(method=method, controller=controller, seed=seed, position_error=error)
        for seed in range(2)
        for method, controller, error in (
            ("manual-align", "autoencoder", 0.2),
            ("manual-align", "warped", manual_on_warped),
            ("all-priors", "autoencoder", 0.03),
            ("all-priors", "warped", 0.1),
        )
    ]


def run_at_once(cell: Cell) -> Row:
    """A row that the cell decides."""
    chosen = {name: value for name, value in asdict(cell).items() if name != "rotation_weight"}
    error = (1 + cell.seed) / 7.0 + cell.noise
    return make_row(**chosen, position_error=error)


def run_all_but_two(cell: Cell) -> Row:
    """Seed 1 cannot be run, seed 2 takes its process with it."""
    if cell.seed == 1:
        raise InputError("Seed 1 brings bad luck.")
    if cell.seed == 2:
        os._exit(7)
    return run_at_once(cell)
