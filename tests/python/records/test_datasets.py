import os
import pickle
from dataclasses import replace

import h5py
import numpy as np
import pytest

from energymargin import datasets
from energymargin.tasks import Trajectory


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("push", trajectories=3, frames=4, seed=1)


@pytest.fixture
def saved(dataset, tmp_path):
    dataset.save(tmp_path / "push.h5")
    return tmp_path / "push.h5"


def test_what_is_saved_is_loaded_to_the_last_bit(dataset, saved):
    loaded = datasets.load(saved)
    assert loaded.digest() == dataset.digest()
    assert (loaded.task, loaded.parameters, loaded.seed) == (dataset.task, dataset.parameters, 1)
    for old, new in zip(dataset.trajectories, loaded.trajectories, strict=True):
        assert np.array_equal(old.states, new.states) and np.array_equal(old.times, new.times)
        assert np.array_equal(old.captured, new.captured)
        assert (old.success, old.params, old.seed) == (new.success, new.params, new.seed)
        assert [len(frame) for frame in old.contacts] == [len(frame) for frame in new.contacts]
    old, new = (d.trajectories[0].contacts[-1][0] for d in (dataset, loaded))
    assert (old.body_a, old.body_b, old.normal_force) == (new.body_a, new.body_b, new.normal_force)
    assert np.array_equal(old.tangential_force, new.tangential_force)


@pytest.fixture(scope="module")
def several():
    """A dataset with four objects."""
    return datasets.generate("scoop", trajectories=2, frames=4, seed=1)


def test_the_labels_of_at_least_one_object_are_loaded_as_they_were(several, tmp_path):
    several.save(tmp_path / "scoop.h5")
    loaded = datasets.load(tmp_path / "scoop.h5")
    assert loaded.digest() == several.digest()
    for old, new in zip(several.trajectories, loaded.trajectories, strict=True):
        assert np.array_equal(old.captured_any, new.captured_any)
        assert isinstance(new.success_any, bool) and old.success_any == new.success_any


def test_the_digest_tells_the_labels_of_at_least_one_object_apart(several):
    first, second = several.trajectories
    other = [
        replace(first, captured_any=~first.captured_any),
        replace(first, success_any=not first.success_any),
        replace(first, success_any=None),
    ]
    changed = [replace(several, trajectories=[one, second]).digest() for one in other]
    assert len({several.digest(), *changed}) == 4


DIGEST = "48d20fcdd02a4d6ee6added8a954e41337b309310814aac883c26dbc16917414"


def test_the_digests_are_those_by_which_files_of_scores_know_their_dataset():
    trajectory = Trajectory(
        times=np.array([0.0, 0.5]),
        states=np.arange(6.0).reshape(2, 3),
        contacts=[[], []],
        captured=np.array([True, False]),
        success=True,
        params={"friction": 0.25},
        seed=7,
    )
    dataset = datasets.Dataset("push", {"friction": None}, 0, [trajectory])
    assert dataset.digest() == DIGEST


def test_the_first_trajectories_are_the_same_however_many_follow(dataset):
    fewer = datasets.generate("push", trajectories=2, frames=4, seed=1)
    for one, other in zip(fewer.trajectories, dataset.trajectories, strict=False):
        assert np.array_equal(one.states, other.states)


def test_the_digest_tells_datasets_apart_by_a_single_bit(dataset):
    first, second, third = dataset.trajectories
    states = second.states.copy()
    states[2, 0] = np.nextafter(states[2, 0], 10)
    changed = replace(dataset, trajectories=[first, replace(second, states=states), third])
    assert changed.digest() != dataset.digest()


def test_states_are_numbered_through_all_trajectories(dataset):
    assert dataset.frames()[3:6] == [(0, 3), (1, 0), (1, 1)]
    problems = dataset.problems()
    assert len(problems) == 12
    assert np.array_equal(problems[5].state, dataset.trajectories[1].states[1])
    assert len(problems[5].contacts) == len(dataset.trajectories[1].contacts[1])


def test_progress_counts_every_trajectory():
    seen = []
    datasets.generate(
        "push", trajectories=3, frames=2, progress=lambda done, total: seen.append((done, total))
    )
    assert seen == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("wrong", [{"trajectories": 0}, {"frames": 1}, {"seed": -1}])
def test_numbers_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        datasets.generate("push", **wrong)


def test_a_dataset_without_a_trajectory_is_refused_before_it_replaces_a_file(dataset):
    with pytest.raises(ValueError, match="trajectories is empty"):
        replace(dataset, trajectories=[])


def test_a_dataset_is_pickled_before_and_after_its_problems_were_asked(dataset):
    before = pickle.dumps(dataset)
    dataset.problems([0])
    assert pickle.dumps(dataset) == before and pickle.loads(before).digest() == dataset.digest()


def test_a_file_that_is_not_hdf5_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("not a dataset")
    with pytest.raises(ValueError, match=r"notes\.txt is not a dataset"):
        datasets.load(tmp_path / "notes.txt")


def test_an_hdf5_file_of_something_else_is_refused(tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = [1, 2]
    with pytest.raises(ValueError, match=r"other\.h5 is not a dataset"):
        datasets.load(tmp_path / "other.h5")


def test_a_file_of_a_newer_version_is_refused_with_the_advice_to_update(saved):
    with h5py.File(saved, "a") as file:
        file.attrs["version"] = 99
    with pytest.raises(ValueError, match=r"version 99.*update"):
        datasets.load(saved)


@pytest.mark.parametrize("part", [0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused(saved, part):
    os.truncate(saved, int(part * saved.stat().st_size))
    with pytest.raises(ValueError, match=r"push\.h5 is damaged or cut short"):
        datasets.load(saved)


def test_a_file_that_lacks_a_part_is_refused(saved):
    with h5py.File(saved, "a") as file:
        del file["states"]
    with pytest.raises(ValueError, match=r"push\.h5 is damaged.*states"):
        datasets.load(saved)


def test_a_save_that_fails_leaves_the_old_file_and_nothing_else(dataset, saved):
    broken = datasets.Dataset("push", {"friction": object()}, 0, dataset.trajectories)
    with pytest.raises(TypeError):
        broken.save(saved)
    assert datasets.load(saved).digest() == dataset.digest()
    assert [path.name for path in saved.parent.iterdir()] == ["push.h5"]


def _change(name, index, value, field=None):
    """Changes one entry of a column."""

    def change(file):
        entry = file[name][index]
        if field is None:
            entry = value
        else:
            entry[field] = value
        file[name][index] = entry

    return change


@pytest.mark.parametrize(
    "damage",
    [
        _change("contact_counts", 1, -1),
        _change("contact_counts", 1, 100),
        _change("contacts", 0, 7, "body_b"),
        _change("captured_any", 1, 2),
        _change("captured_any", 1, 1),
        _change("params", 0, ord("?")),
        _change("trajectories", 1, -1, "frames"),
        _change("trajectories", 1, 3, "frames"),
        _change("trajectories", 1, 2**62, "width"),
        lambda file: _replace(file, "captured", np.ones(2, dtype=bool)),
        lambda file: _replace(file, "captured", np.full(12, np.nan)),
        lambda file: _replace(file, "states", np.zeros((9, 26))),
        lambda file: _replace(file, "bodies", [1.5]),
        lambda file: file["trajectories"].resize(2, axis=0),
        lambda file: file["trajectories"].resize(0, axis=0),
        lambda file: file.attrs.__setitem__("version", "new"),
        lambda file: file.attrs.__setitem__("parameters", "[]"),
    ],
)
def test_a_file_with_something_missing_or_odd_is_refused_by_its_name(saved, damage):
    with h5py.File(saved, "a") as file:
        damage(file)
    with pytest.raises(ValueError, match=r"push\.h5 is damaged"):
        datasets.load(saved)


def _replace(file, name, values):
    del file[name]
    file[name] = values


def test_a_seed_that_no_file_can_hold_is_refused_before_anything_is_computed():
    with pytest.raises(ValueError, match="seed is"):
        datasets.generate("push", seed=2**64)


def test_a_disk_that_has_changed_a_byte_is_found_out(dataset, saved):
    with h5py.File(saved, "r") as file:
        place = file["states"].id.get_chunk_info(0)
    with saved.open("r+b") as raw:
        raw.seek(place.byte_offset + place.size // 2)
        byte = raw.read(1)[0]
        raw.seek(-1, os.SEEK_CUR)
        raw.write(bytes([byte ^ 1]))
    with pytest.raises(ValueError, match=r"push\.h5 is damaged"):
        datasets.load(saved)


@pytest.mark.parametrize("version", [0, 1, 2])
def test_an_older_file_is_refused(dataset, tmp_path, version):
    dataset.save(tmp_path / "old.h5")
    with h5py.File(tmp_path / "old.h5", "a") as file:
        file.attrs["version"] = version
    words = f"has version {version} of the dataset format, and this energymargin reads version 3"
    with pytest.raises(ValueError, match=words):
        datasets.load(tmp_path / "old.h5")


def test_parameters_in_single_precision_are_saved(dataset, tmp_path):
    one = replace(dataset.trajectories[0], params={"friction": np.float32(0.25)})
    replace(dataset, trajectories=[one]).save(tmp_path / "single.h5")
    assert datasets.load(tmp_path / "single.h5").trajectories[0].params == {"friction": 0.25}
