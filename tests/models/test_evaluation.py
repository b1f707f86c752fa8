from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from models.evaluation import (
    direction_error_deg,
    judge_moves,
    motion_gain,
    position_error,
    rotation_error,
)
from models.field import STICKS, learned_field
from tests.drivers import unaligned


def test_position_error_is_zero_at_the_goal_and_one_at_the_start(kinematics, pool):
    s, goal = pool.states, pool.next_states
    assert_allclose(position_error(kinematics, s, goal, goal), 0.0)
    assert_allclose(position_error(kinematics, s, goal, s), 1.0)


def test_rotation_error_is_the_angle_between_two_poses(kinematics, plane):
    # The last joint turns the hand about the vertical and nothing else.
    turned = plane.home_q + np.array([0, 0, 0, 0, 0, 0, 0.2])
    assert_allclose(rotation_error(kinematics, plane.home_q, turned), 0.2, atol=1e-6)
    assert_allclose(rotation_error(kinematics, turned, turned), 0.0)


def test_who_means_the_opposite_is_wrong_by_the_rest_of_the_half_turn(person, kinematics, pool):
    turned = replace(person.human.preference, matrix=-person.human.preference.matrix)
    opposite = replace(person.human, preference=turned)
    s = pool.states[:10]
    error = direction_error_deg(person.mapping, person.human, kinematics, s)
    other = direction_error_deg(person.mapping, opposite, kinematics, s)
    assert error.shape == (10, 16)
    assert_allclose(error + other, 180.0, atol=1e-6)


def test_a_hand_that_does_not_move_is_a_right_angle_off(person, controller, kinematics, pool):
    still = unaligned(replace(controller, a_scale=0.0))
    s = pool.states[:5]
    assert_allclose(direction_error_deg(still, person.human, kinematics, s), 90.0)
    assert_allclose(motion_gain(still, person.human, kinematics, s), 0.0)


def test_what_was_learned_is_as_fast_as_meant(person, kinematics, pool):
    gain = motion_gain(person.mapping, person.human, kinematics, pool.states)
    assert 0.9 < gain.mean() < 1.1


def test_moves_asked_for_are_made(person, controller, kinematics, pool):
    learned = judge_moves(person.mapping, person.human, kinematics, pool)
    not_aligned = judge_moves(unaligned(controller), person.human, kinematics, pool)
    assert learned.position_error < 0.06
    assert not_aligned.position_error > 0.5
    assert learned.rotation_error < np.radians(0.5)
    assert 0.9 < learned.motion_gain < 1.1


def test_a_robot_that_does_not_move_has_no_gain_and_misses_every_move_whole(
    person, controller, kinematics, pool
):
    still = unaligned(replace(controller, a_scale=0.0))
    judged = judge_moves(still, person.human, kinematics, pool)
    assert judged.position_error == pytest.approx(1.0)
    assert judged.motion_gain == pytest.approx(0.0)


def test_the_field_shows_a_move_for_every_side_at_every_point(person, kinematics, plane):
    field = learned_field(person.mapping, kinematics, plane, grid=(3, 4))
    assert field.points.shape == (12, 2)
    assert field.moves.shape == (12, 4, 2)
    assert tuple(STICKS) == ("up", "down", "left", "right")
    meant = person.human.wish(np.array([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0], [1.0, 0.0]]))
    assert_allclose(field.moves, np.tile(meant, (12, 1, 1)), atol=0.006)


def test_a_field_at_known_states_is_the_same(person, kinematics, plane):
    states = plane.spread(kinematics, (3, 4))
    found = learned_field(person.mapping, kinematics, plane, grid=(3, 4))
    given = learned_field(person.mapping, kinematics, plane, states=states)
    assert_allclose(given.moves, found.moves)
    assert_allclose(given.points[[0, -1]], plane.workspace, atol=1e-6)
