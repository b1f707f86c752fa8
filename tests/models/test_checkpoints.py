import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import models.checkpoints as checkpoints
from models.affine import AffineMethod
from models.checkpoints import (
    CONTROLLERS,
    code_version,
    load_controller,
    read_checkpoint,
    save_alignment,
    save_controller,
)
from models.controller_training import ControllerSettings
from models.errors import CheckpointError
from models.fitting import AlignmentContext, Labels
from models.make_controllers import make_controllers
from models.task_space import fit_task_space, survey
from models.tasks import get_task


@pytest.fixture
def stem(tmp_path, person):
    stem = tmp_path / "of-one-person"
    save_alignment(
        stem,
        person.fit.alignment,
        strategy="all-priors",
        seed=3,
        data_hash="abc",
        settings={"steps": 800},
    )
    return stem


@pytest.fixture
def load(person):
    return lambda stem: checkpoints.load_alignment(stem, person.problem)


def save(stem, alignment, strategy="all-priors"):
    save_alignment(stem, alignment, strategy=strategy, seed=0, data_hash="", settings={})


def weights(stem):
    return stem.with_name(f"{stem.name}.safetensors")


def description(stem):
    return stem.with_name(f"{stem.name}.json")


def test_an_alignment_comes_back_to_the_bit(load, stem, person, pool, rng):
    again = load(stem)
    h = rng.uniform(-1, 1, (len(pool), 2))
    assert_array_equal(again(h, pool.states), person.fit.alignment(h, pool.states))
    assert again.controller_hash == person.fit.alignment.controller_hash
    assert read_checkpoint(stem).facts["strategy"] == "all-priors"


def test_a_task_space_alignment_comes_back_to_the_bit(
    load, tmp_path, person, pool, plane, kinematics, controller, rng
):
    seen = survey(plane, kinematics, pool)
    alignment = fit_task_space(controller, kinematics, plane, person.labels, seen)
    save(tmp_path / "a", alignment, "task-space")
    again = load(tmp_path / "a")
    h = rng.uniform(-1, 1, (len(pool), 2))
    assert_array_equal(again(h, pool.states), alignment(h, pool.states))
    assert again.expected_error == alignment.expected_error
    assert again.understanding.reading == alignment.understanding.reading


def test_a_task_space_alignment_is_for_a_task_of_as_many_motions(
    tmp_path, person, pool, plane, kinematics, controller
):
    seen = survey(plane, kinematics, pool)
    alignment = fit_task_space(controller, kinematics, plane, person.labels, seen)
    save(tmp_path / "a", alignment, "task-space")
    two = get_task("reach-and-pour")
    with pytest.raises(CheckpointError, match="do not fit together"):
        checkpoints.load_alignment(tmp_path / "a", AlignmentContext(two, kinematics, controller))


def test_an_affine_alignment_comes_back_to_the_bit(load, tmp_path, pool, person, rng):
    h = rng.uniform(-1, 1, (len(pool), 2))
    labels = Labels(pool.states, h, pool.next_states, pool.latents)
    affine = AffineMethod().fit(replace(person.problem, labels=labels), 0).alignment
    save(tmp_path / "a", affine, "manual-align")
    assert_array_equal(load(tmp_path / "a")(h, pool.states), affine(h, pool.states))


def test_an_alignment_for_another_controller_is_refused(stem, plane, kinematics):
    other = AlignmentContext(plane, kinematics, load_controller("plane", "linear"))
    with pytest.raises(CheckpointError, match="learned for another controller"):
        checkpoints.load_alignment(stem, other)


def test_a_controller_comes_back_to_the_bit(tmp_path, controller):
    save_controller(
        tmp_path / "plane", controller, seed=1, data_hash="d", settings={}, facts={"note": "x"}
    )
    assert load_controller("plane", folder=tmp_path).content_hash == controller.content_hash


def test_a_checkpoint_says_how_it_came_about(stem, person):
    about = read_checkpoint(stem)
    assert (about.kind, about.seed, about.data_hash) == ("alignment", 3, "abc")
    assert about.settings == {"steps": 800}
    assert about.libraries["torch"].startswith("2.")
    assert about.code_version == code_version()
    assert about.facts["controller_hash"] == person.fit.alignment.controller_hash


def test_nothing_is_left_beside_the_two_files(stem):
    assert sorted(path.name for path in stem.parent.iterdir()) == [
        "of-one-person.json",
        "of-one-person.safetensors",
    ]


def test_a_name_with_a_dot_stays_whole(load, tmp_path, person):
    stem = tmp_path / "v1.2"
    save(stem, person.fit.alignment)
    assert load(stem).controller_hash == person.fit.alignment.controller_hash


@pytest.mark.parametrize("place", [10, 400, -1])
def test_a_damaged_file_is_refused(load, stem, place):
    content = bytearray(weights(stem).read_bytes())
    content[place] ^= 1
    weights(stem).write_bytes(content)
    with pytest.raises(CheckpointError, match="damaged"):
        load(stem)


def test_a_file_cut_short_is_refused(load, stem):
    weights(stem).write_bytes(weights(stem).read_bytes()[:-8])
    with pytest.raises(CheckpointError, match="damaged"):
        load(stem)


def test_an_unfinished_checkpoint_is_refused(load, stem):
    description(stem).unlink()
    with pytest.raises(CheckpointError, match="no finished checkpoint 'of-one-person'"):
        load(stem)


def test_lost_weights_are_named(load, stem):
    weights(stem).unlink()
    with pytest.raises(CheckpointError, match="weights of 'of-one-person' are missing"):
        load(stem)


def test_a_writer_that_dies_half_way_leaves_nothing_to_load(load, stem, person, monkeypatch):
    written = []

    def die(path, content):
        written.append(path.name)
        if path.suffix == ".json":
            raise OSError("the machine stops here")
        write(path, content)

    write = checkpoints._write
    monkeypatch.setattr(checkpoints, "_write", die)
    with pytest.raises(OSError, match="stops here"):
        save(stem, person.fit.snapshots[0][1])
    assert written == ["of-one-person.safetensors", "of-one-person.json"]
    with pytest.raises(CheckpointError, match="no finished checkpoint"):
        load(stem)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"kind": "alignment"}'])
def test_a_description_that_is_none_is_refused(load, stem, text):
    description(stem).write_text(text)
    with pytest.raises(CheckpointError, match="does not describe"):
        load(stem)


def test_another_format_is_refused(load, stem):
    about = json.loads(description(stem).read_text())
    description(stem).write_text(json.dumps({**about, "format": 99}))
    with pytest.raises(CheckpointError, match="format 99"):
        load(stem)


def test_a_controller_is_no_alignment(load, tmp_path, controller):
    save_controller(tmp_path / "plane", controller, seed=1, data_hash="", settings={}, facts={})
    with pytest.raises(CheckpointError, match="different kind than alignment"):
        load(tmp_path / "plane")


def test_weights_that_are_not_numbers_are_refused(load, tmp_path, person):
    broken = replace(person.fit.alignment, s_mean=np.full(7, np.nan))
    save(tmp_path / "a", broken)
    with pytest.raises(CheckpointError, match="not numbers"):
        load(tmp_path / "a")


def test_weights_that_belong_to_nothing_are_refused(load, tmp_path, person):
    broken = replace(person.fit.alignment, s_mean=np.zeros(7))
    object.__setattr__(broken, "s_mean", np.zeros(6))
    save(tmp_path / "a", broken)
    with pytest.raises(CheckpointError, match="lacks 's_mean' of shape"):
        load(tmp_path / "a")


def test_controllers_made_twice_are_the_same_files(tmp_path, monkeypatch):
    monkeypatch.setattr("models.make_controllers.TRAJECTORIES", 40)
    settings = ControllerSettings(hidden=8, steps=10, batch=16)
    for folder in ("a", "b"):
        make_controllers("plane", 5, settings, tmp_path / folder)
    files = sorted((tmp_path / "a").iterdir())
    assert len(files) == 2 * len(CONTROLLERS)
    for file in files:
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes(), file.name
    for form in CONTROLLERS:
        assert load_controller("plane", form, tmp_path / "a").form == form
