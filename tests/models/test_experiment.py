from dataclasses import asdict, replace

import pytest

from models import experiment
from models.errors import ModelsError
from models.evaluation import judge_moves
from models.experiment import METHODS, PAPER_METHODS, Cell, run_cell
from models.queries import sample_pool

CELL = Cell("plane", "task-space", noise=0.0, seed=900, labels=10, unlabelled=200)


def without_time(row):
    return {name: value for name, value in asdict(row).items() if name != "training_seconds"}


def test_the_same_cell_gives_the_same_bits():
    cell = replace(CELL, method="all-priors", noise=0.1)
    assert without_time(run_cell(cell)) == without_time(run_cell(cell))


@pytest.mark.parametrize(
    ("task", "seed", "unlabelled"),
    [
        ("plane", 21, 500),
        ("plane", 22, 200),
        ("reach-and-pour", 21, 500),
        ("reach-and-pour", 23, 200),
    ],
)
def test_no_state_of_the_test_is_one_that_was_learned_from(task, seed, unlabelled, monkeypatch):
    drawn, judged = [], []

    def draw(*given):
        drawn.append(sample_pool(*given))
        return drawn[-1]

    def judge(mapping, person, kinematics, pool):
        judged.append(pool)
        return judge_moves(mapping, person, kinematics, pool)

    monkeypatch.setattr(experiment, "sample_pool", draw)
    monkeypatch.setattr(experiment, "judge_moves", judge)
    run_cell(replace(CELL, task=task, seed=seed, unlabelled=unlabelled))
    (test,) = judged
    (pool,) = (each for each in drawn if each is not test)
    assert len(pool) == unlabelled
    assert not {q.tobytes() for q in test.states} & {q.tobytes() for q in pool.states}


def test_another_seed_is_another_person():
    assert run_cell(CELL).position_error != run_cell(replace(CELL, seed=901)).position_error


def test_methods_come_out_in_the_order_of_what_they_know():
    error = {name: run_cell(replace(CELL, method=name)).position_error for name in METHODS}
    assert error["ideal-align"] < error["all-priors"] < error["no-priors"] < error["no-align"]
    assert error["all-priors"] < error["manual-align"]
    assert error["task-space"] < error["ideal-align"]


def test_one_affine_map_fails_where_the_latent_turns_with_the_state():
    warped = replace(CELL, controller="warped", unlabelled=400)
    assert run_cell(replace(warped, method="manual-align")).position_error > 0.5
    assert run_cell(warped).position_error < 0.01


def test_noise_and_wrong_answers_cost_something():
    exact = run_cell(CELL).position_error
    assert run_cell(replace(CELL, noise=0.5)).position_error > exact
    spoilt = replace(CELL, method="no-priors", wrong_answers=0.3)
    clean = replace(CELL, method="no-priors")
    assert run_cell(spoilt).position_error > run_cell(clean).position_error


def test_the_weights_make_the_alignment_error():
    row = run_cell(replace(CELL, task="pour", method="no-align", rotation_weight=3.0))
    assert row.rotation_error > 0.0
    assert row.alignment_error == pytest.approx(row.position_error + 3.0 * row.rotation_error)


def test_the_paper_has_eight_methods():
    assert len(PAPER_METHODS) == 8
    assert METHODS[-1] == "task-space"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("task", "fly"),
        ("method", "magic"),
        ("noise", -0.1),
        ("noise", float("nan")),
        ("labels", 1),
        ("labels", 150),
        ("unlabelled", 5),
        ("seed", -1),
        ("preference", "sideways"),
        ("queries", "clever"),
        ("controller", "steam"),
        ("wrong_answers", 1.5),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_sentence(field, value):
    with pytest.raises(ModelsError) as refusal:
        run_cell(replace(CELL, **{field: value}))
    assert "\n" not in str(refusal.value)
