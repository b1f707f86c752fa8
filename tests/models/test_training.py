from dataclasses import replace

import numpy as np
import pytest
import torch
from jaxtyping import TypeCheckError
from numpy.testing import assert_allclose, assert_array_equal

from models.alignment import HIDDEN
from models.checkpoints import load_controller
from models.errors import InputError, ShapeError, TooFewLabelsError
from models.evaluation import direction_error_deg
from models.fast_loss import AlignmentParameters, losses
from models.fitting import FitProblem, Labels, Progress
from models.mapping import Mapping
from models.priors import PriorWeights
from models.queries import sample_pool
from models.reference_training import ExactProblem, exact_losses, fit_reference
from models.strategies import get_strategy
from models.tasks import get_task
from models.training import (
    BETAS,
    NetworkMethod,
    TrainingSettings,
    draw_unlabelled,
    expanded_problem,
    learning_rate,
    settings_for,
)
from tests.drivers import unaligned

FEW = TrainingSettings(steps=30)
# A step of the hand is linear in z up to this share of its RMS length.
LINEARISATION = 0.08


@pytest.fixture(scope="module")
def fit(person):
    def fit(strategy, settings=FEW, seed=0, report=None, labels=person.labels):
        problem = replace(person.problem, labels=labels)
        told = [] if report is None else report
        return NetworkMethod(weights_of(strategy), settings).fit(problem, seed, told.append)

    return fit


def weights_of(strategy):
    method = get_strategy(strategy).method
    assert isinstance(method, NetworkMethod)
    return method.weights


def numbers_of(fitted):
    return np.concatenate([array.ravel() for array in fitted.alignment.to_arrays().values()])


def total(losses):
    weights = weights_of("all-priors")
    return losses["supervised"] + sum(
        getattr(weights, name) * losses[name]
        for name in ("proportionality", "reversibility", "consistency")
    )


@pytest.mark.parametrize("strategy", ["no-priors", "all-priors"])
def test_the_same_seed_gives_the_same_alignment_to_the_bit(fit, strategy):
    first, again, other = fit(strategy), fit(strategy), fit(strategy, seed=1)
    assert_array_equal(numbers_of(first), numbers_of(again))
    assert not np.array_equal(numbers_of(first), numbers_of(other))


def test_seven_answers_and_the_priors_are_enough(person, kinematics, pool):
    errors = direction_error_deg(person.mapping, person.human, kinematics, pool.states)
    assert errors.mean() < 3.0
    assert np.quantile(errors, 0.95) < 8.0


def test_answers_alone_are_not_enough_and_no_alignment_is_worse(
    fit, person, controller, kinematics, pool
):
    def error(mapping):
        return direction_error_deg(mapping, person.human, kinematics, pool.states).mean()

    answers_only = error(Mapping(controller, fit("no-priors", TrainingSettings()).alignment))
    assert 10.0 < answers_only < error(unaligned(controller))


def test_training_improves_every_loss_that_it_is_about(person):
    first, last = person.told[0].losses, person.told[-1].losses
    assert last["supervised"] < 0.4 * first["supervised"]
    assert total(last) < 0.4 * total(first)


def test_without_priors_the_answers_are_met_and_nothing_else_is_asked(fit):
    told: list[Progress] = []
    fit("no-priors", TrainingSettings(), report=told)
    assert all(list(progress.losses) == ["supervised"] for progress in told)
    assert told[-1].losses["supervised"] < 0.1


def test_progress_is_told_from_the_first_step_to_the_last(fit):
    told: list[Progress] = []
    fit("all-priors", TrainingSettings(steps=130), report=told)
    assert [progress.step for progress in told] == [1, *range(2, 131, 2)]
    assert told[-1].fraction == 1.0


def test_snapshots_show_the_beginning_the_middle_and_the_end(person):
    fractions = [fraction for fraction, _ in person.fit.snapshots]
    assert fractions == [0.0, 0.5, 1.0]
    assert person.fit.snapshots[-1][1] is person.fit.alignment
    first, middle, last = (
        numbers_of(replace(person.fit, alignment=a)) for _, a in person.fit.snapshots
    )
    assert not np.array_equal(first, middle)
    assert not np.array_equal(middle, last)


def test_a_training_of_one_step_has_an_end(fit):
    assert [fraction for fraction, _ in fit("no-priors", TrainingSettings(steps=1)).snapshots] == [
        0.0,
        1.0,
    ]


def test_the_exact_losses_agree_with_the_linearised_ones(
    person, controller, kinematics, plane, pool
):
    problem = ExactProblem.build(controller, kinematics, plane, person.labels, pool)
    exact = exact_losses(person.fit.alignment, problem, TrainingSettings(), seed=0)
    for name, loss in exact.items():
        last = np.mean([progress.losses[name] for progress in person.told[-5:]])
        assert loss == pytest.approx(last, abs=LINEARISATION)


def test_the_fast_training_does_as_well_on_the_exact_loss_as_the_slow_one(
    person, controller, kinematics, plane, pool
):
    few = replace(
        pool,
        **{
            name: getattr(pool, name)[:60]
            for name in ("states", "latents", "next_states", "travel_m", "length_m", "can_show")
        },
    )
    weights, settings = weights_of("all-priors"), TrainingSettings(steps=120)
    slow = fit_reference(
        weights, controller, kinematics, plane, person.labels, few, settings, seed=0
    )
    fast = NetworkMethod(weights, settings).fit(replace(person.problem, pool=few), 0).alignment
    exact = ExactProblem.build(controller, kinematics, plane, person.labels, few)

    def loss(alignment):
        return total(exact_losses(alignment, exact, settings, seed=1))

    untrained = person.fit.snapshots[0][1]
    assert loss(slow) < 0.7 * loss(untrained)
    assert loss(fast) < loss(slow) + LINEARISATION


def test_one_answer_is_too_few(fit, person):
    labels = Labels(
        person.labels.states[:1], person.labels.human_inputs[:1], person.labels.next_states[:1]
    )
    with pytest.raises(TooFewLabelsError, match="1 answers are too few"):
        fit("all-priors", labels=labels)


def test_answers_that_cannot_be_are_refused(person):
    states, h, next_states = (
        person.labels.states,
        person.labels.human_inputs,
        person.labels.next_states,
    )
    with pytest.raises(InputError, match=r"outside \[-1, 1\]"):
        Labels(states, 1.5 * h / np.abs(h).max(), next_states)
    with pytest.raises(InputError, match="not a number"):
        Labels(states, np.full_like(h, np.nan), next_states)
    with pytest.raises((ShapeError, TypeCheckError)):
        Labels(states, h[:3], next_states)


def test_the_rate_goes_from_the_whole_to_zero_along_a_cosine():
    settings = TrainingSettings(steps=1000, learning_rate=0.02)
    rates = np.array([learning_rate(settings, step) for step in range(1, 1001)])
    assert rates[0] == 0.02
    assert rates[500] == pytest.approx(0.01)  # half of the steps are done
    assert rates[250] == pytest.approx(0.01 * (1.0 + np.sqrt(0.5)))
    assert rates[-1] == pytest.approx(0.0, abs=1e-6)
    assert np.all(np.diff(rates) < 0.0)


@pytest.mark.parametrize(
    ("task_name", "strategy"), [("plane", "no-priors"), ("pour", "all-priors")]
)
def test_the_descent_is_that_of_adam_in_torch(task_name, strategy, kinematics):
    task, controller = get_task(task_name), load_controller(task_name)
    pool = sample_pool(task, controller, kinematics, 60, np.random.default_rng(4))
    rows = np.arange(7)
    labels = Labels(pool.states[rows], pool.latents[rows], pool.next_states[rows])
    settings = TrainingSettings(steps=40, batch=8, neighbours=0.2)
    weights = weights_of(strategy)

    rng = np.random.default_rng(6)
    problem = expanded_problem(controller, kinematics, task, labels, pool)
    parameters = AlignmentParameters.random(HIDDEN, np.float32, rng)
    draws = draw_unlabelled(problem, settings, (40, 8), rng) if weights != PriorWeights() else None
    gradient = AlignmentParameters.zeros(HIDDEN, np.float32)
    vector = torch.from_numpy(parameters.vector)  # the same memory
    vector.grad = torch.from_numpy(gradient.vector)
    adam = torch.optim.Adam([vector], betas=BETAS)
    for step in range(1, 41):
        draw = draws and draws.at(step - 1)
        losses(parameters, gradient, problem.labelled, draw, weights, "unsquared", "scale-free")
        adam.param_groups[0]["lr"] = learning_rate(settings, step)
        adam.step()

    fitted = NetworkMethod(weights, settings).fit(
        FitProblem(task, kinematics, controller, labels, pool), seed=6
    )
    expected = problem.alignment(controller.content_hash, parameters)
    for name, array in expected.to_arrays().items():
        assert_allclose(fitted.alignment.to_arrays()[name], array, atol=2e-5)


def ranks_of_partners(task_name, kinematics):
    """How near to its state each partner is among the pool's others, from 0, and their number."""
    task, controller = get_task(task_name), load_controller(task_name)
    pool = sample_pool(task, controller, kinematics, 200, np.random.default_rng(8))
    labels = Labels(pool.states[:5], pool.latents[:5], pool.next_states[:5])
    problem = expanded_problem(controller, kinematics, task, labels, pool, np.float64)
    settings = settings_for(task)
    drawn = draw_unlabelled(problem, settings, (100, 20), np.random.default_rng(9))
    apart = np.linalg.norm(pool.states[:, None] - pool.states[None], axis=-1)
    rank = np.argsort(np.argsort(apart, axis=1), axis=1)  # 0 is the state itself

    def rows(states):
        same = states.normalised[..., None, :] == problem.pool.normalised
        return np.argmax(np.all(same, axis=-1), axis=-1)

    return rank[rows(drawn.states), rows(drawn.others)]


def test_partners_are_near_where_the_stick_changes_its_meaning_with_the_motion(kinematics):
    ranks = ranks_of_partners("reach-and-pour", kinematics)
    assert set(ranks.ravel()) == set(range(1, 21))  # a tenth of 200, and never the state itself


def test_partners_are_any_where_it_does_not(kinematics):
    ranks = ranks_of_partners("plane", kinematics)
    assert len(set(ranks.ravel())) > 190
    assert np.median(ranks) == pytest.approx(100, abs=10)
