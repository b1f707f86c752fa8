from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import TypeCheckError
from numpy.testing import assert_allclose, assert_array_equal

from models.errors import CheckpointError, ShapeError
from models.mapping import Z_REACH, Mapping
from tests.drivers import unaligned


def test_without_an_alignment_the_stick_is_the_latent(controller, pool, rng):
    mapping = unaligned(controller)
    h = rng.uniform(-1, 1, (len(pool), 2))
    assert_array_equal(mapping.z(h, pool.states), h)
    assert_array_equal(mapping(h, pool.states), controller.decode(h, pool.states))


def test_with_one_it_is_the_composition(person, controller, pool, rng):
    h = 0.3 * rng.uniform(-1, 1, (len(pool), 2))
    z = person.fit.alignment(h, pool.states)
    assert np.abs(z).max() < Z_REACH
    assert_array_equal(person.mapping(h, pool.states), controller.decode(z, pool.states))


def test_a_row_of_a_batch_is_the_batch_of_a_row(person, pool):
    h = np.tile([0.4, -0.2], (len(pool), 1))
    assert_allclose(
        person.mapping(h, pool.states)[9], person.mapping(h[9], pool.states[9]), atol=1e-12
    )


def test_a_latent_out_of_reach_is_shortened_and_keeps_its_direction(controller, plane):
    z = unaligned(controller).z(np.array([4.0, -2.0]), plane.home_q)
    assert_allclose(z, [Z_REACH, -Z_REACH / 2])


def test_an_alignment_for_another_controller_is_refused(person, controller):
    other = replace(controller, a_scale=2.0 * controller.a_scale)
    with pytest.raises(CheckpointError, match="another controller"):
        Mapping(other, person.fit.alignment)


def test_shapes_that_disagree_are_refused(person, plane):
    with pytest.raises((ShapeError, TypeCheckError)):
        person.fit.alignment(np.zeros((2, 2)), plane.home_q)
    first = person.fit.alignment.mlp.layers[:1]
    with pytest.raises(ShapeError, match="9 numbers"):
        replace(person.fit.alignment, mlp=replace(person.fit.alignment.mlp, layers=first))
