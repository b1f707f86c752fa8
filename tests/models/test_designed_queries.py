import numpy as np
import pytest

from models.checkpoints import load_controller
from models.demonstrations import joints_at
from models.designed_queries import design_queries
from models.errors import InputError
from models.queries import QueryPool, long_step, sample_pool
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


def variance_left(u, place, motion, rows):
    """What stays unknown of the answers to all moves once those of some rows are known.

    Answers differ by what is not known of a person: both parts of the linear map (1), how it
    changes from place to place (0.15), the response's exponent (0.3) and the noise (0.15).
    """
    length = np.abs(u)
    f = u / length
    near = np.exp(-0.5 * (np.abs(place[:, None] - place[None]) ** 2).sum(axis=-1) / 0.2**2)
    bend = 0.3 * f * (np.log(length) + 1.0)
    both = np.outer(f, f.conj()) + np.outer(f.conj(), f)
    prior = both * (1.0 + 0.15**2 * near) + np.outer(bend, bend.conj())
    prior = prior * (motion[:, None] == motion[None])
    asked = prior[np.ix_(rows, rows)] + 0.15**2 * np.eye(len(rows))
    known = prior[:, rows] @ np.linalg.solve(asked, prior[rows])
    return np.real(np.trace(prior - known))


def test_everything_that_fits_can_be_asked_about_and_no_more(plane, pool, kinematics):
    length = np.linalg.norm(moves(plane, pool, kinematics, np.arange(len(pool))), axis=1)
    fit = np.flatnonzero((length >= 0.3) & (length <= 0.8))
    assert sorted(design(plane, pool, kinematics, len(fit))) == fit.tolist()
    for k in (0, len(fit) + 1):
        with pytest.raises(InputError, match=f"{k} questions were asked for"):
            design(plane, pool, kinematics, k)


@pytest.mark.parametrize("task_name", ["plane", "reach-and-pour"])
def test_each_question_leaves_the_least_unknown(task_name, kinematics):
    task = get_task(task_name)
    pool = sample_pool(task, load_controller(task_name), kinematics, 60, np.random.default_rng(3))
    pose = kinematics.hand_pose(pool.states)
    move = moves(task, pool, kinematics, np.arange(60))
    u = move[:, 0] + 1j * move[:, 1]
    seen = np.abs(u) > 0.05
    fit = np.flatnonzero((np.abs(u) >= 0.3) & (np.abs(u) <= 0.8))
    asked = design(task, pool, kinematics, 8)
    for number, row in enumerate(asked):

        def left(candidate, before=asked[:number]):
            rows = np.flatnonzero(seen).searchsorted([*before, candidate])
            parts = u[seen], task.dof(pose)[seen], task.motion_at(pose)[seen]
            return variance_left(*parts, rows)

        least = min(left(candidate) for candidate in fit if candidate not in asked[:number])
        assert left(row) == pytest.approx(least, rel=1e-9)


def test_the_same_move_is_asked_about_again_far_away(plane, kinematics):
    low, high = plane.workspace
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 7).T, indexing="ij"), axis=-1)
    place = grid.reshape(-1, 2)
    long = np.arange(len(place)) % 7 == 0  # too long to be asked about
    there = place + np.array([0.0, 0.02]) * np.where(long, 1.0, 0.6)[:, None]
    states, next_states = (joints_at(plane.motions[0], kinematics, at) for at in (place, there))
    blank = np.zeros(len(place))
    pool = QueryPool(states, np.zeros((len(place), 2)), next_states, blank, blank, blank == 0.0)
    for seed in range(5):
        first, second = design_queries(plane, kinematics, pool, 2, np.random.default_rng(seed))
        assert np.linalg.norm(place[first] - place[second]) > 0.2
