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
from models.fitting import Labels
from models.mapping import Mapping
from models.preferences import axes, mirrored, rotated
from models.simulated_human import SimulatedHuman
from models.task_space import fit_task_space, survey
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


def test_every_direction_of_the_stick_is_judged(plane, controller, kinematics, pool):
    seen = survey(plane, kinematics, pool)
    rows = np.flatnonzero(pool.length_m < seen.unit_m)[:12]
    s, kappa = pool.states[:6], np.full(2, seen.unit_m)
    straight = SimulatedHuman(plane, axes(), kappa)
    before, after = (kinematics.hand_pose(q[rows]) for q in (pool.states, pool.next_states))
    labels = Labels(pool.states[rows], straight.label(before, after), pool.next_states[rows])
    mapping = Mapping(controller, fit_task_space(controller, kinematics, plane, labels, seen))
    assert_allclose(direction_error_deg(mapping, straight, kinematics, s), 0.0, atol=0.5)
    # Who means the mirror image is off by twice the angle to the mirror.
    mirror = SimulatedHuman(plane, mirrored(axes()), kappa)
    side = 22.5 * np.arange(16)
    off = np.abs((180.0 - 2.0 * side + 180.0) % 360.0 - 180.0)
    errors = direction_error_deg(mapping, mirror, kinematics, s)
    assert_allclose(errors, np.tile(off, (6, 1)), atol=0.5)
    longer = direction_error_deg(mapping, mirror, kinematics, s, directions=8, stick=0.9)
    assert_allclose(longer, np.tile(off[::2], (6, 1)), atol=0.5)


def test_who_thinks_round_the_base_is_judged_by_where_the_hand_is(
    plane, controller, kinematics, pool
):
    s, kappa = pool.states[:6], np.full(2, 0.02)
    polar = SimulatedHuman(plane, replace(axes(), is_polar=True), kappa)
    azimuth_deg = np.degrees(plane.azimuth(kinematics.hand_pose(s)))
    assert np.ptp(azimuth_deg) > 10.0
    for judge in (direction_error_deg, motion_gain):
        found = judge(unaligned(controller), polar, kinematics, s)
        for row, angle in enumerate(azimuth_deg):
            turned = SimulatedHuman(plane, rotated(-angle), kappa)
            expected = judge(unaligned(controller), turned, kinematics, s[row : row + 1])
            assert_allclose(found[row], expected[0], rtol=1e-9, atol=1e-6)


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
