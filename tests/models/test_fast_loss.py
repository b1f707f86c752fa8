"""The hand-written gradient against automatic differentiation of :mod:`models.priors`."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from models.fast_loss import AlignmentParameters, Labelled, States, Unlabelled, losses
from models.monomials import COUNT
from models.priors import (
    PriorWeights,
    consistency_loss,
    proportionality_loss,
    reversibility_loss,
    supervised_loss,
)

HIDDEN, K, N = 12, 5, 9
WEIGHTS = PriorWeights(0.7, 1.3, 0.9)


@pytest.fixture(params=[3, 6])
def problem(request, rng):
    """Random answers and draws, with pose changes with and without rotation."""

    def states(n):
        return States(rng.normal(size=(n, 7)), rng.normal(size=(n, request.param, COUNT)))

    labelled = Labelled(rng.uniform(-1, 1, (K, 2)), states(K), rng.normal(size=(K, request.param)))
    unlabelled = Unlabelled(
        rng.uniform(-1, 1, (N, 2)),
        rng.uniform(-1, 1, N),
        states(N),
        states(N),
        rng.uniform(0.1, 1, N),
    )
    return labelled, unlabelled


def by_torch(parameters, problem, supervised_form, consistency_form):
    """The same terms and the gradient of their weighted sum, from :mod:`models.priors`."""
    labelled, unlabelled = problem
    tensors = [
        (torch.tensor(weight, requires_grad=True), torch.tensor(bias, requires_grad=True))
        for weight, bias in parameters.layers
    ]
    parts = [labelled.states, unlabelled.states, unlabelled.others]
    normalised = torch.from_numpy(np.concatenate([part.normalised for part in parts]))
    per_monomial = torch.from_numpy(np.concatenate([part.per_monomial for part in parts]))

    def displacement(h, rows):
        x = torch.cat([h, normalised[rows]], dim=-1)
        for index, (weight, bias) in enumerate(tensors):
            x = x @ weight + bias
            x = torch.nn.functional.silu(x) if index < 2 else x
        a, b = x[:, 0], x[:, 1]
        powers = [a, b, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3]
        return rows, (per_monomial[rows] @ torch.stack(powers, dim=-1)[..., None])[..., 0]

    rows = torch.arange(K), torch.arange(K, K + N), torch.arange(K + N, K + 2 * N)
    h, alpha = torch.from_numpy(unlabelled.h), torch.from_numpy(unlabelled.alpha)
    near = torch.from_numpy(unlabelled.nearness)
    intended = torch.from_numpy(labelled.intended)
    answered = torch.from_numpy(labelled.h)
    terms = {
        "supervised": supervised_loss(displacement, answered, rows[0], intended, supervised_form),
        "proportionality": proportionality_loss(displacement, h, alpha, rows[1]),
        "reversibility": reversibility_loss(displacement, h, rows[1]),
        "consistency": consistency_loss(displacement, h, rows[1], rows[2], near, consistency_form),
    }
    total = (
        terms["supervised"]
        + WEIGHTS.proportionality * terms["proportionality"]
        + WEIGHTS.reversibility * terms["reversibility"]
        + WEIGHTS.consistency * terms["consistency"]
    )
    flat = [tensor for pair in tensors for tensor in pair]
    gradient = torch.cat([g.reshape(-1) for g in torch.autograd.grad(total, flat)])
    return {name: term.item() for name, term in terms.items()}, gradient.numpy()


@pytest.mark.parametrize("supervised_form", ["unsquared", "squared"])
@pytest.mark.parametrize("consistency_form", ["scale-free", "raw"])
def test_losses_and_gradient_are_those_of_automatic_differentiation(
    problem, rng, supervised_form, consistency_form
):
    parameters = AlignmentParameters.random(HIDDEN, np.float64, rng)
    gradient = AlignmentParameters.zeros(HIDDEN, np.float64)
    terms = losses(
        parameters, gradient, problem[0], problem[1], WEIGHTS, supervised_form, consistency_form
    )
    expected, expected_gradient = by_torch(parameters, problem, supervised_form, consistency_form)
    assert terms == pytest.approx(expected, rel=1e-12)
    assert_allclose(gradient.vector, expected_gradient, atol=1e-12)


def test_each_prior_alone_has_the_right_gradient(problem, rng):
    parameters = AlignmentParameters.random(HIDDEN, np.float64, rng)
    gradient = AlignmentParameters.zeros(HIDDEN, np.float64)
    direction = rng.normal(size=parameters.vector.shape)
    for name in ("proportionality", "reversibility", "consistency"):
        alone = PriorWeights(
            **{
                other: float(other == name)
                for other in ("proportionality", "reversibility", "consistency")
            }
        )

        def total(step, alone=alone, name=name):
            moved = AlignmentParameters(parameters.vector + step * direction, HIDDEN)
            scratch = AlignmentParameters.zeros(HIDDEN, np.float64)
            terms = losses(moved, scratch, problem[0], problem[1], alone, "unsquared", "scale-free")
            return terms["supervised"] + terms[name]

        losses(parameters, gradient, problem[0], problem[1], alone, "unsquared", "scale-free")
        slope = (total(1e-6) - total(-1e-6)) / 2e-6
        assert slope == pytest.approx(gradient.vector @ direction, rel=1e-5)


def test_without_priors_only_the_answers_count(problem, rng):
    labelled, unlabelled = problem
    parameters = AlignmentParameters.random(HIDDEN, np.float64, rng)
    with_zero, without = (AlignmentParameters.zeros(HIDDEN, np.float64) for _ in range(2))
    nothing = PriorWeights(0.0, 0.0, 0.0)
    losses(parameters, with_zero, labelled, unlabelled, nothing, "unsquared", "scale-free")
    terms = losses(parameters, without, labelled, None, nothing, "unsquared", "scale-free")
    assert list(terms) == ["supervised"]
    assert_allclose(with_zero.vector, without.vector, atol=1e-14)


def test_huge_activations_do_not_overflow(problem):
    parameters = AlignmentParameters.zeros(HIDDEN, np.float32)
    parameters.vector[:] = -1e4
    gradient = AlignmentParameters.zeros(HIDDEN, np.float32)
    with np.errstate(over="raise", invalid="raise"):
        losses(parameters, gradient, problem[0], None, WEIGHTS, "unsquared", "scale-free")
    assert np.isfinite(gradient.vector).all()
