import numpy as np
import pytest

from models.checkpoints import load_controller
from models.designed_queries import design_queries
from models.errors import InputError
from models.queries import long_step, sample_pool
from models.tasks import get_task


def design(task, pool, kinematics, k, **options):
    return design_queries(task, kinematics, pool, k, np.random.default_rng(5), **options)


def moves(task, pool, kinematics, rows):
    before = kinematics.hand_pose(pool.states[rows])
    after = kinematics.hand_pose(pool.next_states[rows])
    return task.dof_change(before, after) / long_step(task, kinematics, pool)


def test_the_first_two_cross(plane, pool, kinematics):
    first, second = moves(plane, pool, kinematics, design(plane, pool, kinematics, 2))
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    assert abs(cosine) < 0.5


def test_fewer_questions_are_the_beginning_of_more(plane, pool, kinematics):
    seven = design(plane, pool, kinematics, 7)
    assert len(set(seven)) == 7
    assert design(plane, pool, kinematics, 4) == seven[:4]


def test_moves_can_be_seen_and_answered(plane, pool, kinematics):
    length = np.linalg.norm(
        moves(plane, pool, kinematics, design(plane, pool, kinematics, 10)), axis=1
    )
    assert length.min() > 0.25
    assert length.max() < 0.85


def test_both_motions_of_a_task_are_asked_about_early(kinematics):
    task = get_task("reach-and-pour")
    pool = sample_pool(task, load_controller(task.name), kinematics, 300, np.random.default_rng(2))
    rows = design(task, pool, kinematics, 4)
    motion = task.motion_at(kinematics.hand_pose(pool.states[rows]))
    assert sorted(motion) == [0, 0, 1, 1]


def test_they_spread_over_the_workspace(plane, pool, kinematics):
    rows = design(plane, pool, kinematics, 6)
    place = plane.dof(kinematics.hand_pose(pool.states[rows]))
    everywhere = plane.dof(kinematics.hand_pose(pool.states))
    assert np.all(place.std(axis=0) > 0.5 * everywhere.std(axis=0))


def test_only_what_is_allowed_is_asked(plane, pool, kinematics):
    allowed = np.arange(60)
    assert max(design(plane, pool, kinematics, 5, allowed=allowed)) < 60
    with pytest.raises(InputError, match="questions were asked for"):
        design(plane, pool, kinematics, 5, allowed=np.arange(2))
