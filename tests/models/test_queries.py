import numpy as np
import pytest
from jaxtyping import TypeCheckError
from numpy.testing import assert_allclose, assert_array_equal

from models.checkpoints import load_controller
from models.demonstrations import BEYOND_M
from models.errors import InputError, ShapeError
from models.queries import SHOWN_STEPS, choose_queries, make_query, sample_pool
from models.tasks import get_task

SMALLEST_M = 0.007


def test_every_sample_is_one_step_of_the_controller(pool, controller):
    expected = controller.next_state(pool.latents, pool.states, 0.1)
    assert_array_equal(pool.next_states, expected)
    assert np.linalg.norm(pool.latents, axis=1).max() <= 1.0


def test_travel_is_how_far_the_hand_gets(pool, kinematics):
    before, after = kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    assert_allclose(pool.travel_m, np.linalg.norm(after.position - before.position, axis=1))


def test_the_same_seed_draws_the_same_pool(plane, controller, kinematics, pool):
    again = sample_pool(plane, controller, kinematics, 200, np.random.default_rng(1))
    other = sample_pool(plane, controller, kinematics, 200, np.random.default_rng(2))
    assert_array_equal(again.states, pool.states)
    assert_array_equal(again.latents, pool.latents)
    assert not np.array_equal(other.states, pool.states)


def test_an_empty_pool_is_refused(plane, controller, kinematics, rng):
    with pytest.raises(InputError, match="pool of 0"):
        sample_pool(plane, controller, kinematics, 0, rng)


def test_no_question_is_asked_twice_and_every_move_can_be_seen(pool, rng):
    fit = np.flatnonzero(pool.can_show & (pool.length_m >= SMALLEST_M))
    assert sorted(choose_queries(pool, len(fit), rng, SMALLEST_M)) == fit.tolist()


def test_people_are_asked_about_turns_on_the_spot_too(kinematics, rng):
    task = get_task("pour-cup")
    pool = sample_pool(task, load_controller("pour-cup"), kinematics, 300, rng)
    asked = choose_queries(pool, 100, rng, 0.012)
    before, after = (kinematics.hand_pose(q[asked]) for q in (pool.states, pool.next_states))
    reach, tilt = np.abs(task.dof_change(before, after)).T
    assert np.sum(tilt > 2 * reach) > 20
    assert np.sum(reach > 2 * tilt) > 20


def test_questions_are_drawn_at_random_from_all_that_fit(pool):
    asked = {
        index
        for seed in range(200)
        for index in choose_queries(pool, 5, np.random.default_rng(seed), SMALLEST_M)
    }
    fit = np.flatnonzero(pool.can_show & (pool.length_m >= SMALLEST_M))
    assert len(asked) > 0.95 * len(fit)
    assert asked <= set(fit.tolist())


@pytest.mark.parametrize("k", [0, 201])
def test_more_questions_than_the_pool_has_are_refused(pool, rng, k):
    with pytest.raises(InputError, match=f"{k} questions"):
        choose_queries(pool, k, rng, SMALLEST_M)


def test_a_shown_move_passes_through_its_sample(pool, controller, rng):
    for index in choose_queries(pool, 20, rng, SMALLEST_M):
        query = make_query(controller, pool.states[index], pool.latents[index], SHOWN_STEPS)
        assert query.path.shape == (SHOWN_STEPS + 1, 7)
        assert_array_equal(query.s, pool.states[index])
        assert_allclose(query.next_s, pool.next_states[index], atol=1e-12)
        z = np.tile(query.z, (SHOWN_STEPS, 1))
        driven = controller.next_state(z, query.path[:-1], 0.1)
        assert_allclose(query.path[1:], driven, atol=1e-5)


def test_the_step_that_is_learned_from_is_the_middle_of_what_was_seen(pool, controller, rng):
    for steps in (1, 2, 9, 10):
        query = make_query(controller, pool.states[3], pool.latents[3], steps)
        assert_array_equal(query.s, query.path[steps // 2])
        assert_array_equal(query.next_s, query.path[steps // 2 + 1])
        assert_array_equal(query.next_s, controller.next_state(query.z, query.s, 0.1))


def test_a_shown_move_is_straight_stays_over_the_workspace_and_in_the_plane(
    pool, controller, kinematics, plane, rng
):
    low, high = plane.workspace
    for index in choose_queries(pool, 30, rng, SMALLEST_M):
        query = make_query(controller, pool.states[index], pool.latents[index], SHOWN_STEPS)
        hand = kinematics.hand_pose(query.path).position
        assert np.all((hand[:, :2] > low - 0.07) & (hand[:, :2] < high + 0.07))
        assert np.abs(hand[:, 2] - plane.height_m).max() < 0.02
        steps = np.diff(hand[:, :2], axis=0)
        steps /= np.linalg.norm(steps, axis=1, keepdims=True)
        middle = steps[SHOWN_STEPS // 2]
        assert np.degrees(np.arccos(np.clip(steps @ middle, -1, 1))).max() < 20.0


@pytest.mark.parametrize("task_name", ["plane", "pour-cup", "reach-and-pour"])
def test_both_halves_of_a_move_that_can_be_shown_stay_over_the_workspace(task_name, kinematics):
    task = get_task(task_name)
    pool = sample_pool(task, load_controller(task_name), kinematics, 400, np.random.default_rng(6))
    before, after = kinematics.hand_pose(pool.states), kinematics.hand_pose(pool.next_states)
    half = SHOWN_STEPS / 2 * task.dof_change(before, after)
    place, motion = task.dof(before), task.motion_at(before)
    corners = [each.workspace for each in task.motions]
    low, high = (np.array([pair[side] for pair in corners])[motion] for side in (0, 1))
    ends = {
        way: np.all(
            (place + sign * half > low - BEYOND_M) & (place + sign * half < high + BEYOND_M), axis=1
        )
        for way, sign in (("forward", 1.0), ("backward", -1.0))
    }
    assert np.array_equal(pool.can_show, ends["forward"] & ends["backward"])
    # There are moves of which only one of the halves would leave it.
    assert np.sum(ends["forward"] & ~ends["backward"]) > 5
    assert np.sum(ends["backward"] & ~ends["forward"]) > 5


def test_a_query_is_made_for_one_state(pool, controller):
    with pytest.raises((ShapeError, TypeCheckError)):
        make_query(controller, pool.states[:2], pool.latents[:2], 3)
    with pytest.raises(InputError, match="at least one step"):
        make_query(controller, pool.states[0], pool.latents[0], 0)
