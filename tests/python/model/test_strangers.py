"""Files of strangers reach no other file, and no more memory than they have bytes for."""

import json
import os

import h5py
import numpy as np
import pytest

from energymargin import datasets, grasps, recordings
from energymargin.base import hdf5
from energymargin.meshes import mesh

POSES = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (3, 1, 1))


@pytest.fixture
def private(tmp_path):
    path = tmp_path / "private.txt"
    path.write_bytes(b"PRIVATE KEY 1234567890")
    return path


def external(file, private):
    file.create_dataset("grasps/secret", (3,), "S7", external=[(str(private), 0, 21)])


def linked(file, private):
    with h5py.File(private.with_suffix(".h5"), "w") as other:
        other["secret"] = np.arange(3.0)
    file["grasps/secret"] = h5py.ExternalLink(str(private.with_suffix(".h5")), "secret")


def linked_group(file, private):
    linked(file, private)
    file["object"] = h5py.ExternalLink(str(private.with_suffix(".h5")), "/")


def virtual(file, private):
    linked(file, private)
    del file["grasps/secret"]
    layout = h5py.VirtualLayout((3,), float)
    layout[:] = h5py.VirtualSource(str(private.with_suffix(".h5")), "secret", (3,))
    file.create_virtual_dataset("grasps/secret", layout)


def unstored(file, _private):
    file.create_dataset("grasps/secret", (3, 10**12), "f8", chunks=(1, 1024))


def deep(file, _private):
    for _ in range(100):
        file = file.create_group("a")


REACHES = {
    external: "'grasps/secret' has its data in another file",
    linked: r"'grasps/secret' is a link to '.*private\.h5'",
    linked_group: r" is a link to '.*private\.h5'",
    virtual: "'grasps/secret' is put together from other files",
    unstored: r"'grasps/secret' says that it has 24000000000000 bytes, of which 0 are stored",
    deep: "is nested deeper than 32 groups",
}


def open_alone(path):
    with hdf5.opened(path):
        pass


@pytest.mark.parametrize("make", REACHES)
@pytest.mark.parametrize("read", [grasps.read, datasets.open, open_alone])
def test_an_hdf5_file_that_reaches_out_of_itself_is_refused_by_name(tmp_path, private, make, read):
    path = tmp_path / "grasps.h5"
    with h5py.File(path, "w") as file:
        file["grasps/transforms"] = POSES
        make(file, private)
    with pytest.raises(ValueError, match=REACHES[make]):
        read(path)


def test_texts_that_many_places_share_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(hdf5, "MOST_TEXT", 1000)
    with h5py.File(tmp_path / "grasps.h5", "w") as file:
        file["grasps/transforms"] = POSES
        file["grasps/name"] = ["a" * 400] * 3
    with pytest.raises(ValueError, match="'/grasps/name' has more than 1000 bytes of text"):
        grasps.read(tmp_path / "grasps.h5")


def test_an_hdf5_file_with_soft_and_hard_links_in_itself_is_read(tmp_path):
    with h5py.File(tmp_path / "grasps.h5", "w") as file:
        file["grasps/transforms"] = POSES
        file["grasps/width"] = np.arange(3.0)
        file["grasps/soft"] = h5py.SoftLink("/grasps/width")
        file["grasps/round"] = file["grasps"]
        file["grasps/gzip"] = np.zeros(3)
    read = grasps.read(tmp_path / "grasps.h5")
    assert set(read.columns) == {"gzip", "width"}


def lerobot_folder(tmp_path, shape=(1,)):
    folder = tmp_path / "stranger"
    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    features = {"timestamp": {"shape": list(shape), "names": None}}
    info = {"codebase_version": "v3.0", "fps": 10, "features": features}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    return folder


def test_a_link_out_of_a_folder_of_lerobot_is_refused_by_name(tmp_path, private):
    folder = lerobot_folder(tmp_path)
    (folder / "data" / "chunk-000" / "secret.parquet").symlink_to(private)
    with pytest.raises(
        ValueError, match=r"secret\.parquet is a link to '.*private\.txt', which is"
    ):
        recordings.read_lerobot(folder)


def test_a_link_out_of_a_folder_of_a_bag_is_refused_by_name(tmp_path, private):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "a.mcap").symlink_to(private)
    with pytest.raises(ValueError, match=r"a\.mcap is a link to '.*private\.txt', which is not in"):
        recordings.bag_topics(tmp_path / "bag")


def test_a_pipe_in_a_folder_of_a_stranger_is_refused_by_name(tmp_path):
    folder = lerobot_folder(tmp_path)
    os.mkfifo(folder / "data" / "chunk-000" / "file-000.parquet")
    with pytest.raises(ValueError, match="is neither a file nor a folder"):
        recordings.read_lerobot(folder)


@pytest.mark.parametrize("shape", [(10**9,), (-1,), (0.5,), ("a",)])
def test_the_shape_of_a_feature_is_bounded_before_it_is_used(tmp_path, shape):
    folder = lerobot_folder(tmp_path, shape)
    with pytest.raises(ValueError, match=r"'timestamp' has the shape .*, expected whole numbers"):
        recordings.read_lerobot(folder)


def test_mappings_that_take_in_others_are_refused_in_yaml(tmp_path):
    levels = [f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}" for k in range(1, 60)]
    text = "\n".join(["format: isaac_grasp", "a0: &a0 {x: 1}", *levels, "grasps: {}"])
    (tmp_path / "grasps.yaml").write_text(text)
    with pytest.raises(ValueError, match="has a mapping with <<"):
        grasps.read(tmp_path / "grasps.yaml", frame="grasp")


def collada(more, doctype=""):
    return (
        f'<?xml version="1.0"?>{doctype}<COLLADA xmlns="http://www.collada.org/2005/11/'
        f'COLLADASchema" version="1.4.1"><asset/>{more}</COLLADA>'
    )


DOUBLED = "".join(
    f'<node id="n{k}"><instance_node url="#n{k - 1}"/><instance_node url="#n{k - 1}"/></node>'
    for k in range(1, 40)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (collada("", '<!DOCTYPE x [<!ENTITY a "0 1 2 ">]>'), "it declares a DOCTYPE"),
        (collada('<float_array count="4000000000">0</float_array>'), "has the count 4000000000"),
        (collada(f'<node id="n0"><instance_geometry url="#g"/></node>{DOUBLED}'), "stand for more"),
        (collada('<node id="a"><instance_node url="#a"/></node>'), "its node 'a' holds itself"),
        ("PK\x03\x04", "it is no XML, expected a DAE file that is not packed"),
        (collada("<a>"), "it is no whole XML"),
    ],
)
def test_a_dae_file_stays_as_small_as_it_is(tmp_path, text, message):
    (tmp_path / "m.dae").write_text(text)
    with pytest.raises(ValueError, match=message):
        mesh(tmp_path / "m.dae")
