import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from models.monomials import monomials
from models.motion import PoseMeter, root_mean_square


@pytest.fixture(params=[0.0, 0.3])
def meter(request, kinematics):
    return PoseMeter(kinematics, request.param, unit_m=0.013)


def test_torch_measures_the_same(meter, pool):
    before, after = torch.from_numpy(pool.states), torch.from_numpy(pool.next_states)
    assert_allclose(
        meter.change_torch(before, after).numpy(), meter.change(pool.states, pool.next_states)
    )


def test_rotation_is_measured_only_where_it_counts(meter, pool):
    change = meter.change(pool.states, pool.next_states)
    assert change.shape == (len(pool), 6 if meter.rotation_weight_m > 0.0 else 3)


def test_a_turn_counts_as_its_metres(kinematics, plane):
    turned = plane.home_q + np.array([0, 0, 0, 0, 0, 0, 0.2])
    change = PoseMeter(kinematics, 0.3).change(plane.home_q, turned)
    assert_allclose(np.linalg.norm(change[3:]), 0.3 * np.sin(0.2), atol=1e-6)
    assert_allclose(change[:3], 0.0, atol=1e-9)


def test_a_step_is_its_polynomial_in_z_very_nearly(meter, controller, pool):
    exact = meter.change(pool.states, pool.next_states)
    expanded = meter.per_monomial(controller, pool.states)
    cubic = (expanded @ monomials(pool.latents)[..., None])[..., 0]
    linear = (expanded[..., :2] @ pool.latents[..., None])[..., 0]
    assert root_mean_square(exact - cubic) < 0.03 * root_mean_square(exact)
    assert root_mean_square(exact - cubic) < 0.6 * root_mean_square(exact - linear)


def test_the_polynomial_is_twice_as_large_in_units_of_half_the_size(kinematics, controller, pool):
    whole, half = (PoseMeter(kinematics, 0.3, unit_m) for unit_m in (1.0, 0.5))
    s = pool.states[:5]
    assert_allclose(2.0 * whole.per_monomial(controller, s), half.per_monomial(controller, s))
