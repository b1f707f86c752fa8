from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from jaxtyping import TypeCheckError
from numpy.testing import assert_allclose, assert_array_equal

from models.checkpoints import CONTROLLERS, PRETRAINED, load_controller, read_checkpoint
from models.controller import WarpedController
from models.controller_training import (
    ConditionalAutoencoder,
    ControllerSettings,
    fit_controller,
)
from models.errors import InputError, ShapeError
from models.monomials import monomials
from models.panda import Q_MAX, Q_MIN
from models.queries import sample_pool
from models.reference_training import decode_torch
from models.tasks import TASKS, get_task
from tests.models.conftest import random_joints


def test_a_latent_of_zero_moves_nothing_anywhere(controller, rng):
    s = random_joints(rng, 500)
    assert not controller.decode(np.zeros((500, 2)), s).any()
    assert not controller.decode(np.zeros(2), s[0]).any()
    assert_array_equal(controller.next_state(np.zeros((500, 2)), s, 0.1), s)


def test_a_batch_is_its_rows(controller, pool):
    a = controller.decode(pool.latents.reshape(4, 50, 2), pool.states.reshape(4, 50, 7))
    row = controller.decode(pool.latents[57], pool.states[57])
    assert_allclose(a[1, 7], row, atol=1e-12)


def test_the_decoder_of_torch_is_the_same(controller, pool):
    z, s = torch.from_numpy(pool.latents), torch.from_numpy(pool.states)
    assert_allclose(
        decode_torch(controller, z, s).numpy(),
        controller.decode(pool.latents, pool.states),
        atol=1e-12,
    )


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("form", CONTROLLERS)
def test_every_form_is_at_rest_for_zero_and_close_to_its_secant_and_its_expansion(
    task, form, kinematics
):
    learned = load_controller(task, form)
    pool = sample_pool(get_task(task), learned, kinematics, 200, np.random.default_rng(1))
    s, z = pool.states, pool.latents
    assert_array_equal(learned.decode(np.zeros_like(z), s), np.zeros_like(s))
    a = learned.decode(z, s)

    def missed(guess):
        return np.sqrt(np.mean((a - guess) ** 2) / np.mean(a**2))

    linear = missed((learned.secant(s) @ z[..., None])[..., 0])
    cubic = missed((learned.expand(s) @ monomials(z)[..., None])[..., 0])
    # A latent of the user study's tasks, which tilt the hand far, bends the more.
    assert cubic < 0.08
    assert cubic <= 0.7 * linear + 1e-9


def test_a_warped_latent_means_another_thing_at_every_state(kinematics):
    plain, warped = load_controller("plane"), load_controller("plane", "warped")
    assert isinstance(warped, WarpedController)
    pool = sample_pool(get_task("plane"), plain, kinematics, 300, np.random.default_rng(1))
    assert 1.0 < np.std(warped.angle(pool.states)) < 1.5
    z = np.broadcast_to([0.5, 0.0], (300, 2))
    assert np.abs(warped.decode(z, pool.states) - plain.decode(z, pool.states)).max() > 0.1


def test_there_is_no_other_form():
    with pytest.raises(InputError, match="choose one of: autoencoder, linear"):
        load_controller("plane", "quadratic")


@given(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=2), st.floats(0.0, 100.0))
def test_the_next_state_is_always_within_the_limits(controller, plane, z, dt_s):
    after = controller.next_state(np.array(z), plane.home_q, dt_s)
    assert np.all((after >= Q_MIN) & (after <= Q_MAX))


def test_shapes_that_disagree_are_refused(controller):
    with pytest.raises((ShapeError, TypeCheckError)):
        controller.decode(np.zeros((3, 2)), np.zeros((4, 7)))
    with pytest.raises(ShapeError, match="9 numbers"):
        replace(
            controller, decoder=replace(controller.decoder, layers=controller.decoder.layers[:1])
        )


def test_the_hash_names_the_content(controller):
    same = replace(controller)
    other = replace(controller, a_scale=controller.a_scale * (1 + 1e-12))
    assert controller.content_hash == same.content_hash != other.content_hash


def test_the_pretrained_controller_is_as_good_as_promised():
    quality = read_checkpoint(PRETRAINED / "plane").facts["quality"]
    assert quality["reconstruction_error"] <= 0.04
    assert quality["off_task_motion"] <= 0.04
    assert quality["share_spanning"] == 1.0


def test_every_latent_direction_moves_the_hand_in_the_plane(controller, kinematics, plane, pool):
    angles = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    before = kinematics.hand_pose(pool.states)
    for angle in angles:
        z = np.tile([np.cos(angle), np.sin(angle)], (len(pool), 1))
        after = kinematics.hand_pose(controller.next_state(z, pool.states, 0.1))
        assert np.linalg.norm(plane.dof_change(before, after), axis=1).min() > 0.006
        assert np.abs(plane.off_task_change(before, after)[:, 0]).max() < 0.003


@pytest.fixture(scope="module")
def few_demonstrations(plane, kinematics):
    return plane.demonstrations(kinematics, np.random.default_rng(0), 60, 12, disturbed=True)


def test_the_autoencoder_learns_with_its_decoder_at_rest_subtracted():
    network = ConditionalAutoencoder(hidden=8)
    s = torch.randn(6, 7)
    assert not network.decode(torch.zeros(6, 2), s).any()
    assert network.decode(torch.ones(6, 2), s).all()


def fit(plane, kinematics, demonstrations, steps, seed=0, on_progress=None):
    settings = ControllerSettings(hidden=32, steps=steps, batch=64)
    return fit_controller(plane, kinematics, demonstrations, settings, seed, on_progress)


def test_training_a_controller_improves_it(plane, kinematics, few_demonstrations):
    seen = []
    _, early = fit(plane, kinematics, few_demonstrations, 5)
    trained, late = fit(
        plane, kinematics, few_demonstrations, 300, on_progress=lambda *at: seen.append(at)
    )
    assert late.reconstruction_error < 0.6 * early.reconstruction_error
    assert [step for step, _ in seen] == [100, 200, 300]
    assert seen[-1][1] < seen[0][1]
    assert not trained.decode(np.zeros(2), plane.home_q).any()


def test_the_same_seed_gives_the_same_controller_to_the_bit(plane, kinematics, few_demonstrations):
    first, _ = fit(plane, kinematics, few_demonstrations, 20)
    again, _ = fit(plane, kinematics, few_demonstrations, 20)
    other, _ = fit(plane, kinematics, few_demonstrations, 20, seed=1)
    assert first.content_hash == again.content_hash != other.content_hash


def test_fitting_leaves_the_chance_of_others_alone(plane, kinematics, few_demonstrations):
    torch.manual_seed(7)
    expected = torch.rand(3)
    torch.manual_seed(7)
    fit(plane, kinematics, few_demonstrations, 2)
    assert torch.equal(torch.rand(3), expected)
