"""Task-space alignments: what they understand, on people drawn for these tests alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from models.checkpoints import CONTROLLERS, load_controller
from models.errors import TooFewLabelsError
from models.evaluation import judge_moves
from models.fitting import Labels
from models.mapping import Mapping
from models.preferences import parse_preference
from models.queries import sample_pool
from models.reading import read_labels
from models.simulated_human import SimulatedHuman, make_wrong, sensitivity
from models.task_space import fit_task_space, survey
from models.tasks import TASKS, get_task


class Lab:
    """A task with its controller and samples."""

    def __init__(self, kinematics, task, form="autoencoder"):
        self.kinematics, self.task = kinematics, get_task(task)
        self.controller = load_controller(task, form)
        self.pool = sample_pool(
            self.task, self.controller, kinematics, 300, np.random.default_rng(71)
        )
        self.kappa = sensitivity(self.task, kinematics, self.pool)
        self.survey = survey(self.task, kinematics, self.pool)

    def person(self, preference, noise=0.0, seed=71):
        chance = np.random.default_rng(seed)
        return SimulatedHuman(self.task, parse_preference(preference, chance), self.kappa, noise)

    def labels(self, person, k, wrong=0.0, seed=71):
        chance = np.random.default_rng(seed)
        before = self.kinematics.hand_pose(self.pool.states)
        after = self.kinematics.hand_pose(self.pool.next_states)
        long = np.linalg.norm(self.task.dof_change(before, after), axis=-1) / self.kappa[0]
        rows = chance.choice(np.flatnonzero((long > 0.2) & (long < 1.0)), k, replace=False)
        s, there = self.pool.states[rows], self.pool.next_states[rows]
        h = person.label(self.kinematics.hand_pose(s), self.kinematics.hand_pose(there), chance)
        return Labels(s, make_wrong(h, wrong, chance), there)

    def fit(self, labels):
        return fit_task_space(self.controller, self.kinematics, self.task, labels, self.survey)

    def error(self, alignment, person):
        mapping = Mapping(self.controller, alignment)
        return judge_moves(mapping, person, self.kinematics, self.pool).position_error


@pytest.fixture(scope="module")
def plane_lab(kinematics):
    return Lab(kinematics, "plane")


@pytest.mark.parametrize("task", TASKS)
def test_exact_answers_are_understood_exactly(task, kinematics):
    lab = Lab(kinematics, task)
    person = lab.person("random")
    assert lab.error(lab.fit(lab.labels(person, 16)), person) < 0.005


@pytest.mark.parametrize("form", CONTROLLERS)
def test_it_serves_every_controller(form, kinematics):
    lab = Lab(kinematics, "plane", form)
    person = lab.person("random", noise=0.1)
    assert lab.error(lab.fit(lab.labels(person, 10)), person) < 0.1


@pytest.mark.parametrize(
    ("preference", "is_polar", "exponent"),
    [
        ("rotated:200+mirrored", False, 1.0),
        ("polar+swapped", True, 1.0),
        ("expo:0.65", False, 0.65),
        ("polar+expo:1.4+gain:0.7", True, 1.4),
    ],
)
def test_the_form_that_fits_is_chosen(plane_lab, preference, is_polar, exponent):
    person = plane_lab.person(preference)
    alignment = plane_lab.fit(plane_lab.labels(person, 12))
    reading = alignment.understanding.reading
    assert reading.is_polar == is_polar
    assert reading.exponent == pytest.approx(exponent, rel=0.02)
    assert plane_lab.error(alignment, person) < 0.01


def test_a_map_that_drifts_over_the_workspace_is_followed(plane_lab):
    # Someone whose stick turns with the place, in a way that no form knows.
    labels = plane_lab.labels(plane_lab.person("axes"), 30)
    evidence = read_labels(plane_lab.task, plane_lab.kinematics, labels, 1.0)
    angle = 2.0 * (evidence.place[:, 0] - 0.5)
    x, y = labels.human_inputs.T
    h = np.stack(
        [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], axis=1
    )
    alignment = plane_lab.fit(Labels(labels.states, h, labels.next_states))
    assert alignment.understanding.reading.drift > 0.0
    meant = alignment.move(h, labels.states)
    made = plane_lab.task.dof_change(
        plane_lab.kinematics.hand_pose(labels.states),
        plane_lab.kinematics.hand_pose(labels.next_states),
    )
    assert np.mean(np.linalg.norm(meant - made, axis=1)) < 0.1 * np.mean(
        np.linalg.norm(made, axis=1)
    )


def test_wrong_answers_are_found_and_left_out(plane_lab):
    errors, found = [], []
    for seed in range(8):
        person = plane_lab.person("random", noise=0.1, seed=seed)
        labels = plane_lab.labels(person, 10, wrong=0.2, seed=seed)
        alignment = plane_lab.fit(labels)
        errors.append(plane_lab.error(alignment, person))
        found.append(len(alignment.understanding.doubtful))
    assert np.median(errors) < 0.1
    assert np.median(found) == 2


def test_what_it_expects_to_miss_is_what_it_misses(plane_lab):
    people = [plane_lab.person("random", noise=0.2, seed=seed) for seed in range(12)]
    fits = [plane_lab.fit(plane_lab.labels(p, 8, seed=i)) for i, p in enumerate(people)]
    expected = np.mean([fit.expected_error for fit in fits])
    missed = np.mean([plane_lab.error(fit, p) for fit, p in zip(fits, people, strict=True)])
    assert 0.5 < missed / expected < 2.0


def test_a_stick_at_rest_asks_for_nothing(plane_lab):
    person = plane_lab.person("random", noise=0.1)
    alignment = plane_lab.fit(plane_lab.labels(person, 7))
    s = plane_lab.pool.states[:20]
    assert_allclose(alignment(np.zeros((20, 2)), s), 0.0, atol=1e-12)


def test_one_answer_is_too_few(plane_lab):
    with pytest.raises(TooFewLabelsError):
        plane_lab.fit(plane_lab.labels(plane_lab.person("axes"), 1))
