"""Datasets of any size: open files that are read in blocks."""

import gc
import math
from dataclasses import replace

import h5py
import numpy as np
import pytest

from energymargin import Contact, datasets
from energymargin.records.datasets import columns
from energymargin.tasks import Trajectory


@pytest.fixture(scope="module", params=["topple", "scoop"])
def whole(request):
    return datasets.generate(request.param, trajectories=6, frames=5, seed=2)


@pytest.fixture
def opened(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(columns, "BLOCK_STATES", 7)  # many blocks: 2 trajectories each
    whole.save(tmp_path / "open.h5")
    with datasets.open(tmp_path / "open.h5") as opened:
        yield opened


def test_an_open_file_is_the_dataset_that_was_saved(whole, opened, tmp_path):
    loaded = datasets.load(tmp_path / "open.h5")
    for one in (opened, loaded):
        assert one.digest() == whole.digest()
        assert one.lengths.tolist() == [5] * 6 and one.size == 30
        assert one.successes.tolist() == [t.success for t in whole.trajectories]
        assert one.frames() == whole.frames()
        for first, last in [(0, 30), (3, 4), (4, 16), (7, 7), (30, 30)]:
            assert one.labels(first, last) == whole.labels(first, last)
    assert len(opened.trajectories) == 6
    assert np.array_equal(opened.trajectories[-1].states, whole.trajectories[5].states)
    with pytest.raises(IndexError):
        opened.trajectories[6]


def test_labels_are_those_of_the_trajectories(whole, opened):
    rows = opened.labels(0, 30)
    for (t, k), row in zip(whole.frames(), rows, strict=True):
        trajectory = whole.trajectories[t]
        some = trajectory.captured_any
        expected = (t, k, bool(trajectory.captured[k]), trajectory.success)
        assert row == (*expected, None if some is None else bool(some[k]), trajectory.success_any)
        assert all(type(value) in (int, bool, type(None)) for value in row)
    with pytest.raises(ValueError, match="first and last are 0 and 31, expected 0 <= first"):
        opened.labels(0, 31)


def test_the_problems_asked_for_are_those_of_all(whole, opened):
    everything, numbers = whole.problems(), [0, 4, 5, 17, 29]
    for number, problem in zip(numbers, opened.problems(numbers), strict=True):
        expected = everything[number]
        assert np.array_equal(problem.state, expected.state)
        assert [c.body_a for c in problem.contacts] == [c.body_a for c in expected.contacts]
        for name in ("position", "normal", "normal_force", "tangential_force", "friction"):
            got, wanted = ([getattr(c, name) for c in p.contacts] for p in (problem, expected))
            assert np.array_equal(got, wanted)
    assert len(opened.problems()) == 30


@pytest.mark.parametrize("numbers", [[3, 3], [5, 4], [-1], [30]])
def test_numbers_of_states_that_do_not_rise_or_are_not_there_are_refused(opened, numbers):
    with pytest.raises(ValueError, match=r"numbers has .*, expected numbers of states that rise"):
        opened.problems(numbers)


@pytest.mark.parametrize("numbers", [[1.9], [True], ["1"], [math.nan]])
def test_numbers_of_states_that_are_not_whole_are_refused(opened, numbers):
    with pytest.raises(ValueError, match=r"numbers are .*, expected whole numbers of states"):
        opened.problems(numbers)


def test_a_state_without_a_problem_is_named_by_trajectory_and_frame(whole, tmp_path):
    states = whole.trajectories[2].states.copy()
    states[3] = np.nan
    broken = [*whole.trajectories[:2], replace(whole.trajectories[2], states=states)]
    replace(whole, trajectories=broken).save(tmp_path / "broken.h5")
    with datasets.open(tmp_path / "broken.h5") as opened:
        assert len(opened.problems(range(13))) == 13
        with pytest.raises(ValueError, match=r"^trajectory 2, frame 3: "):
            opened.problems([2, 13])


def test_a_closed_file_says_so(whole, opened):
    opened.close()
    with pytest.raises(ValueError, match=r"open\.h5 is closed"):
        opened.trajectories[0]


def open_files():
    return h5py.h5f.get_obj_count(h5py.h5f.OBJ_ALL, h5py.h5f.OBJ_FILE)


def test_a_dataset_that_nobody_has_any_more_has_closed_its_file(whole, tmp_path):
    whole.save(tmp_path / "open.h5")
    before = open_files()
    forgotten = datasets.open(tmp_path / "open.h5")
    assert len(forgotten.trajectories[0]) == 5 and open_files() == before + 1
    del forgotten
    gc.collect()
    assert open_files() == before


def contact(body, force):
    return Contact(
        body_a=body, body_b="floor", position=(0, 1, 2), normal=(0, 0, 1), distance=-1e-3,
        normal_force=force, tangential_force=(0.5, 0, -0.0), friction=0.25,
    )  # fmt: skip


def trajectory(width, contacts, seed):
    frames = len(contacts)
    return Trajectory(
        times=np.arange(frames) / 10,
        states=np.random.default_rng(seed).normal(size=(frames, width)),
        contacts=contacts,
        captured=np.arange(frames) % 2 == 0,
        success=frames > 2,
        params={"mass": 0.1 + seed, "lid": 1},
        seed=seed,
    )


@pytest.fixture
def uneven():
    """Other numbers of objects, frames and contacts in each, and bodies that come late."""
    return datasets.Dataset(
        "bins",
        {},
        0,
        [
            trajectory(13, [[], [contact("b", 1.0)], []], 1),
            trajectory(26, [[contact("c", 2.0), contact("a", 3.0)]], 2),
            trajectory(13, [[], []], 2**63 - 1),
            trajectory(39, [[contact("a", np.inf)] * 3] * 4, 4),
        ],
    )


def test_trajectories_of_one_file_may_have_states_of_different_lengths(uneven, tmp_path):
    uneven.save(tmp_path / "bins.h5")
    with datasets.open(tmp_path / "bins.h5") as opened:
        assert opened.digest() == uneven.digest()
        for old, new in zip(uneven.trajectories, opened.trajectories, strict=True):
            assert np.array_equal(old.states, new.states) and old.params == new.params
            assert old.seed == new.seed
            forces = [[[c.normal_force for c in f] for f in t.contacts] for t in (old, new)]
            assert forces[0] == forces[1]


def test_digest_and_bytes_do_not_depend_on_the_blocks(uneven, tmp_path, monkeypatch):
    files, digests = [], []
    uneven.save(tmp_path / "bins.h5")
    for states in (1, 3, 100):
        monkeypatch.setattr(columns, "BLOCK_STATES", states)
        with datasets.open(tmp_path / "bins.h5") as opened:
            digests.append(opened.digest())
            opened.save(tmp_path / "again.h5")
        files.append((tmp_path / "again.h5").read_bytes())
    assert len(set(digests)) == 1 and set(files) == {(tmp_path / "bins.h5").read_bytes()}


@pytest.mark.parametrize("field", ["body_a", "normal_force", "friction", "tangential_force"])
def test_the_digest_sees_every_part_of_a_contact(uneven, field):
    other = {"body_a": "z", "normal_force": 1.5, "friction": 0.3, "tangential_force": (0.5, 0, 0)}
    names = ["body_a", "body_b", "position", "normal", "distance", *list(other)[1:]]
    one = contact("b", 1.0)
    changed = Contact(**{name: getattr(one, name) for name in names} | {field: other[field]})
    first = replace(uneven.trajectories[0], contacts=[[], [changed], []])
    moved = replace(uneven.trajectories[0], contacts=[[one], [], []])
    digests = {
        replace(uneven, trajectories=[t, *uneven.trajectories[1:]]).digest()
        for t in (uneven.trajectories[0], first, moved)
    }
    assert len(digests) == 3
