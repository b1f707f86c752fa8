from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import TypeCheckError
from numpy.testing import assert_array_equal

from models.alignment import get_strategy
from models.errors import InputError, ShapeError, TooFewLabelsError
from models.evaluation import direction_error_deg
from models.mapping import Mapping
from models.reference_training import ExactProblem, exact_losses, fit_reference
from models.training import Labels, TrainingSettings, fit_alignment

FEW = TrainingSettings(steps=30)
# A step of the hand is linear in z up to this share of its RMS length.
LINEARISATION = 0.08


@pytest.fixture(scope="module")
def fit(controller, kinematics, plane, pool, person):
    def fit(strategy, settings=FEW, seed=0, on_progress=None, labels=person.labels):
        return fit_alignment(
            strategy, controller, kinematics, plane, labels, pool, settings, seed, on_progress
        )

    return fit


def weights_of(fitted):
    return np.concatenate([array.ravel() for array in fitted.alignment.to_arrays().values()])


@pytest.mark.parametrize("strategy", ["no-priors", "all-priors"])
def test_the_same_seed_gives_the_same_alignment_to_the_bit(fit, strategy):
    first, again, other = fit(strategy), fit(strategy), fit(strategy, seed=1)
    assert_array_equal(weights_of(first), weights_of(again))
    assert not np.array_equal(weights_of(first), weights_of(other))
    assert first.history == again.history


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
    assert 10.0 < answers_only < error(Mapping(controller))


def test_training_improves_every_loss_that_it_is_about(person):
    history = person.fit.history
    for name, curve in history.losses.items():
        assert len(curve) == len(history.steps)
        if name == "supervised":
            assert curve[-1] < 0.4 * curve[0]
    weights = get_strategy("all-priors").weights
    weighted = [
        history.losses["supervised"][i]
        + weights.proportionality * history.losses["proportionality"][i]
        + weights.reversibility * history.losses["reversibility"][i]
        + weights.consistency * history.losses["consistency"][i]
        for i in (0, -1)
    ]
    assert weighted[1] < 0.4 * weighted[0]


def test_without_priors_the_answers_are_met_and_nothing_else_is_asked(fit):
    history = fit("no-priors", TrainingSettings()).history
    assert list(history.losses) == ["supervised"]
    assert history.losses["supervised"][-1] < 0.1


def test_progress_is_told_from_the_first_step_to_the_last(fit):
    told = []
    fitted = fit("all-priors", TrainingSettings(steps=130), on_progress=told.append)
    assert (told[0].step, told[-1].step, told[-1].fraction) == (1, 130, 1.0)
    assert [progress.step for progress in told] == list(fitted.history.steps)
    assert told[-1].losses["supervised"] == fitted.history.losses["supervised"][-1]


def test_snapshots_show_the_beginning_the_middle_and_the_end(person):
    fractions = [fraction for fraction, _ in person.fit.snapshots]
    assert fractions == [0.0, 0.5, 1.0]
    assert person.fit.snapshots[-1][1] is person.fit.alignment
    first, middle, last = (
        weights_of(replace(person.fit, alignment=a)) for _, a in person.fit.snapshots
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
    for name, curve in person.fit.history.losses.items():
        assert exact[name] == pytest.approx(np.mean(curve[-5:]), abs=LINEARISATION)


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
    strategy = get_strategy("all-priors")
    settings = TrainingSettings(steps=120)
    slow = fit_reference(
        strategy, controller, kinematics, plane, person.labels, few, settings, seed=0
    )
    fast = fit_alignment(
        strategy, controller, kinematics, plane, person.labels, few, settings, seed=0
    ).alignment
    problem = ExactProblem.build(controller, kinematics, plane, person.labels, few)

    def total(alignment):
        terms = exact_losses(alignment, problem, settings, seed=1)
        weights = strategy.weights
        return (
            terms["supervised"]
            + weights.proportionality * terms["proportionality"]
            + weights.reversibility * terms["reversibility"]
            + weights.consistency * terms["consistency"]
        )

    untrained = person.fit.snapshots[0][1]
    assert total(slow) < 0.7 * total(untrained)
    assert total(fast) < total(slow) + LINEARISATION


def test_no_alignment_is_nothing_to_learn(fit):
    with pytest.raises(InputError, match="nothing to learn"):
        fit("no-align")
    with pytest.raises(InputError, match="no-align, manual-align, no-priors"):
        fit("some-priors")


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
