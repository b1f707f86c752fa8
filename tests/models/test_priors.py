"""Each prior is zero for a map that obeys it, and positive for one that breaks it."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from models.priors import (
    consistency_loss,
    nearness,
    proportionality_loss,
    reversibility_loss,
    supervised_loss,
)

N = 40
MATRIX = torch.tensor([[0.6, -1.1], [0.9, 0.4], [0.0, 0.2]], dtype=torch.float64)


def linear(h, s):
    """Obeys everything: the same linear map everywhere."""
    return s, h @ MATRIX.T


def steered_by_place(h, s):
    """Proportional, but different in every place."""
    return s, (1.0 + s[:, :1]) * (h @ MATRIX.T)


def bent(h, s):
    """Bent: twice the stick is not twice the move, but the opposite is opposite."""
    return s, (h @ MATRIX.T) ** 3


def drifting(h, s):
    """The arm moves with the stick at rest."""
    return s, h @ MATRIX.T + 0.3


def still(h, s):
    """Nothing ever moves."""
    return s, 0.0 * (h @ MATRIX.T)


@pytest.fixture
def draw(rng):
    def tensor(*shape):
        return torch.from_numpy(rng.uniform(-1.0, 1.0, shape))

    return tensor


def test_proportionality_holds_for_linear_maps_only(draw):
    h, alpha, s = draw(N, 2), draw(N), draw(N, 7)
    assert proportionality_loss(linear, h, alpha, s) < 1e-20
    assert proportionality_loss(steered_by_place, h, alpha, s) < 1e-20
    assert proportionality_loss(bent, h, alpha, s) > 0.01
    assert proportionality_loss(drifting, h, alpha, s) > 0.01


def test_reversibility_holds_where_the_way_back_is_the_way(draw):
    h, s = draw(N, 2), draw(N, 7)
    assert reversibility_loss(linear, h, s) < 1e-20
    assert reversibility_loss(bent, h, s) < 1e-20
    assert reversibility_loss(drifting, h, s) > 0.01


def test_reversibility_looks_at_where_the_way_back_begins(draw):
    def walking(h, s):
        return s + 1.0, (1.0 + s[:, :1]) * (h @ MATRIX.T)

    h, s = draw(N, 2), draw(N, 7)
    expected = torch.mean(torch.sum((h @ MATRIX.T) ** 2, dim=1))
    assert_allclose(float(reversibility_loss(walking, h, s)), float(expected))


@pytest.mark.parametrize("form", ["raw", "scale-free"])
def test_consistency_holds_where_every_place_is_alike(draw, form):
    h, s_1, s_2 = draw(N, 2), draw(N, 7), draw(N, 7)
    near = nearness(s_1, s_2, gamma=1.0)
    assert consistency_loss(linear, h, s_1, s_2, near, form) < 1e-20
    assert consistency_loss(bent, h, s_1, s_2, near, form) < 1e-20
    assert consistency_loss(steered_by_place, h, s_1, s_2, near, form) > 0.005


def test_standing_still_earns_nothing_from_scale_free_consistency(draw):
    h, s_1, s_2 = draw(N, 2), draw(N, 7), draw(N, 7)
    near = nearness(s_1, s_2, gamma=1.0)

    def shrunk(h, s):
        return s, 0.5 * steered_by_place(h, s)[1]

    def ratio(form):
        small = consistency_loss(shrunk, h, s_1, s_2, near, form)
        return float(small / consistency_loss(steered_by_place, h, s_1, s_2, near, form))

    assert ratio("raw") == pytest.approx(0.25)
    assert ratio("scale-free") > 0.9


def test_states_far_apart_may_differ(draw):
    h, s_1, s_2 = draw(N, 2), draw(N, 7), draw(N, 7)
    losses = [
        float(consistency_loss(steered_by_place, h, s_1, s_2, nearness(s_1, s_2, gamma), "raw"))
        for gamma in (0.0, 1.0, 30.0)
    ]
    assert losses[0] > losses[1] > losses[2]
    assert losses[2] < 1e-6
    assert_allclose(nearness(s_1, s_1, 5.0), 1.0)


@pytest.mark.parametrize("form", ["squared", "unsquared"])
def test_the_labels_are_met_by_the_map_they_came_from(draw, form):
    h, s = draw(N, 2), draw(N, 7)
    at_best = supervised_loss(linear, h, s, h @ MATRIX.T, form)
    assert at_best <= supervised_loss(still, h, s, torch.zeros(N, 3, dtype=torch.float64), form)
    assert supervised_loss(drifting, h, s, h @ MATRIX.T, form) > at_best + 0.1


def test_one_wrong_answer_pulls_less_when_distances_are_not_squared(draw):
    h, s = draw(N, 2), draw(N, 7)
    intended = h @ MATRIX.T

    def pull(wrong_by, form):
        wrong = intended.clone()
        wrong[0, 0] += wrong_by
        offset = torch.zeros(3, dtype=torch.float64, requires_grad=True)
        loss = supervised_loss(lambda h, s: (s, linear(h, s)[1] + offset), h, s, wrong, form)
        return float(torch.autograd.grad(loss, offset)[0][0].abs())

    assert pull(20.0, "squared") == pytest.approx(10 * pull(2.0, "squared"))
    assert pull(20.0, "unsquared") < 1.2 * pull(2.0, "unsquared")


def test_the_paper_is_averaged_over_samples(draw):
    h, alpha, s = draw(N, 2), draw(N), draw(N, 7)
    whole = proportionality_loss(bent, h, alpha, s)
    parts = [
        proportionality_loss(bent, h[i : i + 1], alpha[i : i + 1], s[i : i + 1]) for i in range(N)
    ]
    assert_allclose(float(whole), np.mean([float(part) for part in parts]))
