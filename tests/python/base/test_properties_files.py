"""Whatever stands in a file: what it says, or a ValueError; never another kind of error."""

import contextlib
import copy
import xml.etree.ElementTree as ET

import h5py
import numpy as np
import pytest
from anything import damaged, finite
from hypothesis import HealthCheck, given, settings, strategies as st
from urdf_files import ARM

import energymargin as em
from energymargin import datasets
from energymargin.cli.options import parsed
from energymargin.scenes import from_urdf
from energymargin.store import ScoreStore, score_dataset

settings.register_profile(
    "one folder", suppress_health_check=[HealthCheck.function_scoped_fixture]
)  # each example writes its file anew
one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])

WORDS = st.sampled_from(
    [
        "",
        "0",
        "-1",
        "1e400",
        "1e308",
        "1_0",
        "٣",
        "nan",
        "0 0",
        "0 0 1",
        "0 0 0",
        "1 2 3 4",
        "a",
        "base",
        "arm",
        "shoulder",
        "fixed",
        "continuous",
        "prismatic",
        "floating",
        "x\x00y",
    ]
)
TAGS = st.sampled_from(
    [
        "link",
        "joint",
        "inertial",
        "mass",
        "inertia",
        "origin",
        "collision",
        "geometry",
        "box",
        "sphere",
        "mesh",
        "contact",
        "lateral_friction",
        "axis",
        "limit",
        "mimic",
        "transmission",
    ]
)


@st.composite
def robots(draw):
    """The text of a robot's file, with some changes."""
    root = ET.fromstring(ARM)
    for _ in range(draw(st.integers(1, 3))):
        elements = list(root.iter())
        element = draw(st.sampled_from(elements))
        other = draw(st.sampled_from(elements))
        change = draw(st.integers(0, 4))
        if change == 0:
            for parent in elements:
                if element in list(parent):
                    parent.remove(element)
        elif change == 1 and other not in list(element.iter()):
            other.append(copy.deepcopy(element))
        elif change == 2:
            element.tag = draw(TAGS)
        else:
            names = [*element.attrib, "name", "value", "rpy", "multiplier", "joint", "filename"]
            words = st.one_of(WORDS, st.text(max_size=5), st.floats().map(str))
            element.set(draw(st.sampled_from(names)), draw(words))
    return ET.tostring(root)


def require_scene_or_refusal(path, text):
    path.write_bytes(text)
    try:
        scene = from_urdf(path)
    except ValueError as error:
        assert str(error)
    except FileNotFoundError as error:  # of a mesh that the file names
        assert "which is none of these" in str(error)
    else:
        assert finite(scene.pack(), *(body.position for body in scene.bodies))


@one_folder
@given(robots())
def test_a_changed_robot_is_a_scene_or_refused(tmp_path, text):
    require_scene_or_refusal(tmp_path / "robot.urdf", text)


@one_folder
@given(damaged(ARM.encode()))
def test_a_damaged_robot_is_a_scene_or_refused(tmp_path, text):
    require_scene_or_refusal(tmp_path / "robot.urdf", text)


@pytest.fixture(scope="module")
def dataset():
    return datasets.generate("push", trajectories=1, frames=2, seed=1)


@pytest.fixture(scope="module")
def dataset_file(dataset, tmp_path_factory):
    path = tmp_path_factory.mktemp("datasets") / "push.h5"
    dataset.save(path)
    return path.read_bytes()


VALUES = st.one_of(
    st.floats(),
    st.integers(-(2**63), 2**63 - 1),
    st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), max_size=5),
    st.sampled_from(
        ["{}", "[]", '{"friction": 1e400}', "{" * 2000, "push", np.ones(2), h5py.Empty("f")]
    ),
)


@one_folder
@given(st.data())
def test_a_changed_dataset_is_loaded_or_refused(dataset_file, tmp_path, data):
    path = tmp_path / "push.h5"
    path.write_bytes(dataset_file)
    with h5py.File(path, "r+") as file:
        name = data.draw(st.sampled_from(sorted(file.attrs)))
        if data.draw(st.booleans()):
            file.attrs[name] = data.draw(VALUES)
        name = data.draw(st.sampled_from(sorted(file)))
        how = data.draw(st.sampled_from(["as it was", "another", "a byte"]))
        if how == "another":
            del file[name]
            file[name] = data.draw(VALUES)
        elif how == "a byte" and name != "bodies":
            column = file[name][()]
            raw = column.view(np.uint8)
            raw[data.draw(st.integers(0, raw.size - 1))] ^= data.draw(st.integers(1, 255))
            file[name][()] = column
    with contextlib.suppress(ValueError):
        assert isinstance(datasets.load(path), datasets.Dataset)


@pytest.fixture(scope="module")
def score_file(dataset, tmp_path_factory):
    path = tmp_path_factory.mktemp("scores") / "scores.db"
    score_dataset(dataset, path, metrics=["force"])
    return path.read_bytes()


@one_folder
@given(st.data())
def test_a_damaged_file_of_scores_is_read_or_refused(score_file, tmp_path, data):
    path = tmp_path / "scores.db"
    path.write_bytes(data.draw(damaged(score_file)))
    with contextlib.suppress(ValueError), ScoreStore(path) as store:
        for run in store.runs():
            run.labelled_scores()
            run.missing()


@given(st.lists(st.one_of(st.text(max_size=12), st.text(max_size=9).map("friction={}".format))))
def test_a_parameter_of_any_text_is_a_value_or_refused(texts):
    with contextlib.suppress(ValueError):
        parameters = parsed(texts)
        em.tasks.make("push", **parameters)
