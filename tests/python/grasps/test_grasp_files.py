"""Files of grasps of others are read, into one frame, and written so that their tools read them."""

import io
import json
import os
import tarfile
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from energymargin import grasps

GIVEN = os.environ.get("ENERGYMARGIN_GRASPS")
needs_data = pytest.mark.skipif(GIVEN is None, reason="ENERGYMARGIN_GRASPS names no folder")
FRAME = {"frame": "franka_panda"}
SUFFIXES = {".h5": {}, ".json": FRAME, ".yaml": FRAME, ".csv": {}}


def poses(n=5, seed=0):
    """Random ones, within 0.2 m of the origin."""
    draws = np.random.default_rng(seed)
    made = np.tile(np.eye(4), (n, 1, 1))
    made[:, :3, :3] = Rotation.from_quat(draws.normal(size=(n, 4))).as_matrix()
    made[:, :3, 3] = draws.uniform(-0.2, 0.2, (n, 3))
    return made


def quaternions(made):
    return Rotation.from_matrix(made[:, :3, :3]).as_quat()


def csv_file(path, made, header="x,y,z,qx,qy,qz,qw", extra=()):
    rows = np.concatenate([made[:, :3, 3], quaternions(made)], axis=1).tolist()
    lines = [[*row, *(column[k] for column in extra)] for k, row in enumerate(rows)]
    path.write_text("\n".join([header, *(",".join(map(str, line)) for line in lines)]))
    return path


def acronym_file(path, made, labels):
    """A file with what ACRONYM's have."""
    with h5py.File(path, "w") as file:
        file["grasps/transforms"] = made
        file["grasps/qualities/flex/object_in_gripper"] = np.asarray(labels, np.int64)
        file["grasps/qualities/flex/object_motion_during_closing_linear"] = np.arange(len(made)) / 9
        file["grasps/planner"] = "antipodal"
        file["gripper/type"] = "panda"
        file["gripper/configuration"] = [0.04]
        file["object/file"] = "meshes/Cup/cup.obj"
        file["object/scale"] = 0.001
        file["object/mass"] = 0.2
        file["object/com"] = [0.0, 0.01, 0.02]
        file["object/inertia"] = np.eye(3) * 1e-4
        file["object/friction"] = 0.7
    return path


def graspgen_text(made, labels):
    held = {"transforms": made.tolist(), "object_in_gripper": labels}
    return json.dumps({"object": {"file": "cup.obj", "scale": 0.5}, "grasps": held})


def isaac_file(path, made):
    w_first = np.roll(quaternions(made), 1, axis=1).tolist()
    entries = {
        f"grasp_{k}": {
            "confidence": k / 10,
            "position": pose[:3, 3].tolist(),
            "orientation": {"w": w_first[k][0], "xyz": w_first[k][1:]},
            "cspace_position": {"panda_finger_joint1": 0.01 * k},
            "pregrasp_cspace_position": {"panda_finger_joint1": 0.04},
        }
        for k, pose in enumerate(made)
    }
    head = {"format": "isaac_grasp", "format_version": 1.0, "gripper_frame": "/World/panda_hand"}
    path.write_text(yaml.safe_dump({**head, "grasps": entries}, sort_keys=False))
    return path


def shift(z):
    moved = np.eye(4)
    moved[2, 3] = z
    return moved


# What is read


def test_acronym_poses_move_from_the_panda_hand_to_the_middle_of_its_pads(tmp_path):
    made = poses()
    read = grasps.read(acronym_file(tmp_path / "a.h5", made, [1, 0, 1, 1, 0]))
    assert np.allclose(read.poses, made @ shift(0.1034), atol=1e-15)
    assert read.labels.tolist() == [1, 0, 1, 1, 0]
    assert np.isnan(read.openings).all()
    assert list(read.columns) == ["flex/object_motion_during_closing_linear"]


def test_acronym_says_what_its_object_is_and_where_its_mesh_is(tmp_path):
    path = acronym_file(tmp_path / "a.h5", poses(), [1] * 5)
    told = grasps.read(path).object
    assert (told.mesh, told.scale, told.mass) == (Path("meshes/Cup/cup.obj"), 0.001, 0.2)
    assert (told.com, told.friction) == ((0.0, 0.01, 0.02), 0.7)
    assert told.inertia[1] == (0.0, 1e-4, 0.0)
    (tmp_path / "cup.obj").touch()
    assert grasps.read(path).object.mesh == tmp_path / "cup.obj"


def test_graspgen_is_read_from_json(tmp_path):
    made, labels = poses(3), [True, False, True]
    path = tmp_path / "file"  # the content tells the format
    path.write_text(graspgen_text(made, labels))
    read = grasps.read(path, **FRAME)
    assert np.allclose(read.poses, made @ shift(0.1034), atol=1e-15)
    assert read.labels.tolist() == [1, 0, 1]
    assert (read.object.mesh, read.object.scale) == (Path("cup.obj"), 0.5)


@pytest.mark.parametrize("kind", ["", "gz", "bz2", "xz"])
def test_a_tar_file_says_that_it_is_to_be_unpacked(tmp_path, kind):
    text = graspgen_text(poses(3), [True, False, True]).encode()
    with tarfile.open(tmp_path / "shard.tar", f"w:{kind}") as file:
        member = tarfile.TarInfo("mug.grasps.json")
        member.size = len(text)
        file.addfile(member, io.BytesIO(text))
    with pytest.raises(ValueError, match="unpack it"):
        grasps.read(tmp_path / "shard.tar", **FRAME)


def test_isaac_grasp_is_read_with_its_joints(tmp_path):
    made = poses(4)
    read = grasps.read(isaac_file(tmp_path / "i.yaml", made), frame=0.05)
    assert np.allclose(read.poses, made @ shift(0.05), atol=1e-12)
    assert read.labels.tolist() == [0, 0.1, 0.2, 0.3]
    assert read.names == ("grasp_0", "grasp_1", "grasp_2", "grasp_3")
    assert read.columns["cspace_position/panda_finger_joint1"].tolist() == [0, 0.01, 0.02, 0.03]


@pytest.mark.parametrize("frame", ["panda_hand", [0, 0, 0.1034, 0, 0, 0.5**0.5, 0.5**0.5]])
def test_fingers_that_open_along_y_open_along_x_of_the_grasp(tmp_path, frame):
    read = grasps.read(isaac_file(tmp_path / "i.yaml", poses(1)), frame=frame)
    assert np.allclose(read.poses[0, :3, 0], poses(1)[0, :3, 1])
    assert np.allclose(read.poses[0, :3, 2], poses(1)[0, :3, 2])


@pytest.mark.parametrize(
    "header",
    [
        "x,y,z,qx,qy,qz,qw",
        "pos_x,pos_y,pos_z,quat_x,quat_y,quat_z,quat_w",
        "PX,PY,PZ,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w",
    ],
)
def test_columns_of_a_table_are_known_by_their_usual_names(tmp_path, header):
    extra = ([0.08, 0.05, ""], ["yes", "no", ""], ["a b", "c", "d"], [3, 4, 5])
    names = f"{header},width,success,object,layout"
    read = grasps.read(csv_file(tmp_path / "t.txt", poses(3), names, extra))
    assert np.allclose(read.poses, poses(3))
    assert np.array_equal(read.openings, [0.08, 0.05, np.nan], equal_nan=True)
    assert np.array_equal(read.labels, [1, 0, np.nan], equal_nan=True)
    assert read.columns["layout"].tolist() == [3, 4, 5]
    assert read.columns["object"].tolist() == ["a b", "c", "d"]


@pytest.mark.parametrize("sign", [" ", ",", ";", "\t"])
def test_rows_of_a_matrix_need_no_header(tmp_path, sign):
    rows = poses(3).reshape(3, 16).tolist()
    (tmp_path / "m").write_text("\n".join(sign.join(map(repr, row)) for row in rows))
    assert np.array_equal(grasps.read(tmp_path / "m").poses, poses(3))


def test_where_chooses_rows_and_keeps_their_numbers(tmp_path):
    extra = (["cup", "cup", "box", "cup"], [0, 1, 1, 1])
    path = csv_file(tmp_path / "t.csv", poses(4), "x,y,z,qx,qy,qz,qw,object,layout", extra)
    assert grasps.read(path, where={"object": "cup", "layout": 1}).names == ("1", "3")
    assert grasps.read(path, where={"object": ["box", "cup"]}).names == ("0", "1", "2", "3")
    with pytest.raises(
        ValueError, match="where has 'scene', expected a column: name, object, layout"
    ):
        grasps.read(path, where={"scene": 3})
    with pytest.raises(
        ValueError, match=r"'pan' for 'object', and no such row; it is one of \['cup', 'box'\]"
    ):
        grasps.read(path, where={"object": "pan"})


def test_poses_on_a_board_become_those_in_the_frame_of_each_object(tmp_path):
    stands = poses(2, seed=1)
    extra = (["cup", "box"], ["cup.stl", "box.stl"])
    names = "x,y,z,qx,qy,qz,qw,object,mesh"
    objects = csv_file(tmp_path / "o.csv", stands, names, extra)
    which = np.array([0, 1, 1])
    path = csv_file(
        tmp_path / "t.csv",
        stands[which] @ poses(3),
        "x,y,z,qx,qy,qz,qw,object",
        (["cup", "box", "box"],),
    )
    read = grasps.read(path, object=objects)
    assert np.allclose(read.poses, poses(3))
    assert np.allclose(read.object_poses, stands[which])
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/box.stl").touch()
    box = grasps.read(path, object=objects, where={"object": "box"}).object
    assert box.mesh == tmp_path / "meshes/box.stl"
    one = grasps.read(path, object=stands[0], where={"object": "cup"})
    assert np.allclose(one.poses, poses(3)[:1])
    csv_file(objects, stands[:1], names, (["cup"], ["cup.stl"]))
    with pytest.raises(ValueError, match=r"no row has \('box',\) among object, which"):
        grasps.read(path, object=objects)


def test_a_number_a_mask_numbers_or_a_slice_choose_grasps(tmp_path):
    read = grasps.read(acronym_file(tmp_path / "a.h5", poses(), [1, 0, 1, 1, 0]))
    assert read[-1].names == ("4",)
    assert read[read.labels == 0].names == ("1", "4")
    assert read[1:3].columns["flex/object_motion_during_closing_linear"].tolist() == [1 / 9, 2 / 9]
    assert [one.names[0] for one in read] == list("01234")
    assert len(repr(read)) < 900
    with pytest.raises(ValueError, match="there are no grasps"):
        read[:0]


# What is written


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_what_is_written_is_read_again(tmp_path_factory, suffix, data):
    n = data.draw(st.integers(1, 4))
    unit = st.floats(0, 1)
    labels = data.draw(st.lists(st.one_of(unit, st.just(np.nan)), min_size=n, max_size=n))
    if suffix == ".json":  # has true and false alone
        labels = [float(data.draw(st.booleans())) for _ in range(n)]
    made = grasps.GraspSet(
        poses(n, seed=data.draw(st.integers(0, 99))),
        labels=np.array(labels),
        openings=np.array(data.draw(st.lists(st.floats(0, 0.2), min_size=n, max_size=n))),
        object=grasps.ObjectFacts(Path("cup.obj"), 0.5),
    )
    path = tmp_path_factory.mktemp("again") / f"g{suffix}"
    frame = SUFFIXES[suffix]
    scores = data.draw(st.none() | st.lists(unit, min_size=n, max_size=n))
    grasps.write(path, made, scores, **frame)
    read = grasps.read(path, **frame)
    assert np.allclose(read.poses, made.poses, rtol=0, atol=1e-9)
    found = read.columns.get("energymargin/recorded", read.labels)
    if not np.isnan(made.labels).all():
        assert np.array_equal(np.asarray(found, float), made.labels, equal_nan=True)
    if scores is not None:
        assert read.columns["energymargin/probability"].tolist() == scores
    if suffix != ".csv":
        assert read.object == made.object
    again = path.with_name(f"again{suffix}")
    grasps.write(again, read)
    assert np.allclose(grasps.read(again, **frame).poses, read.poses, rtol=0, atol=1e-12)


def test_a_file_of_acronym_has_all_of_it_again_and_the_scores_beside_flex(tmp_path):
    path = acronym_file(tmp_path / "a.h5", poses(), [1, 0, 1, 1, 0])
    read = grasps.read(path)[[0, 3]]
    grasps.write(tmp_path / "b.h5", read, {"probability": [0.5, 0.25], "effort": [1.0, 2.0]})
    with h5py.File(path) as old, h5py.File(tmp_path / "b.h5") as new:
        names = []
        old.visititems(lambda name, thing: names.append((name, thing)))
        for name, thing in names:
            if isinstance(thing, h5py.Dataset):
                assert new[name].dtype == thing.dtype
                values = thing[()][[0, 3]] if thing.shape[:1] == (5,) else thing[()]
                near = np.allclose if thing.dtype.kind == "f" else np.array_equal
                assert near(new[name][()], values)
        assert new["grasps/qualities/energymargin/effort"][()].tolist() == [1, 2]


def test_graspgen_finds_a_mask_of_true_and_false_which_the_scores_make(tmp_path):
    (tmp_path / "a.json").write_text(graspgen_text(poses(3), [1, 0, 1]))
    read = grasps.read(tmp_path / "a.json", **FRAME)
    grasps.write(tmp_path / "b.json", read)
    assert json.loads((tmp_path / "b.json").read_text())["grasps"]["object_in_gripper"] == [
        *(True, False, True)
    ]
    grasps.write(tmp_path / "b.json", read, [0.4, 0.5, 0.9], overwrite=True)
    whole = json.loads((tmp_path / "b.json").read_text())
    assert whole["grasps"]["object_in_gripper"] == [False, True, True]
    assert whole["grasps"]["energymargin"] == {
        "probability": [0.4, 0.5, 0.9],
        "recorded": [1, 0, 1],
    }
    assert whole["object"] == {"file": "cup.obj", "scale": 0.5}
    assert np.allclose(whole["grasps"]["transforms"], poses(3), rtol=0, atol=1e-12)


def test_isaac_sim_finds_its_joints_and_the_scores_as_confidence(tmp_path):
    path = isaac_file(tmp_path / "a.yaml", poses(3))
    grasps.write(tmp_path / "b.yaml", grasps.read(path, frame=0.1), [0.5, 0.25, 1.0])
    old, new = (yaml.safe_load((tmp_path / f"{name}.yaml").read_text()) for name in "ab")
    for name, grasp in old["grasps"].items():
        written = new["grasps"].pop(name)
        assert written.pop("energymargin")["recorded"] == grasp.pop("confidence")
        assert written.pop("confidence") in (0.5, 0.25, 1.0)
        ours, theirs = written.pop("orientation"), grasp.pop("orientation")
        sign = np.sign(ours["w"] * theirs["w"])
        assert np.allclose(
            [ours["w"], *ours["xyz"]], sign * np.array([theirs["w"], *theirs["xyz"]])
        )
        assert np.allclose(written.pop("position"), grasp.pop("position"))
        assert written == grasp
    assert {**new, "grasps": 0} == {**old, "grasps": 0}


def test_a_table_keeps_its_columns_and_gets_those_of_the_scores(tmp_path):
    header = "planner,px,py,pz,qx,qy,qz,qw,held"
    made = poses(2)
    rows = np.concatenate([made[:, :3, 3], quaternions(made)], axis=1).tolist()
    lines = [header, *(",".join(map(str, ["gpd", *row, k])) for k, row in enumerate(rows))]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    read = grasps.read(tmp_path / "a.csv", scale=0.5, frame="panda_tcp", object=poses(1, 7)[0])
    grasps.write(tmp_path / "b.csv", read, [0.5, 0.25])
    first, *others = (tmp_path / "b.csv").read_text().splitlines()
    assert first == f"{header},energymargin/probability"
    for k, line in enumerate(others):
        planner, *numbers = line.split(",")
        values = np.array(numbers, float)
        values[3:7] *= np.sign(values[6] * rows[k][6])
        assert planner == "gpd"
        assert np.allclose(values, [*rows[k], k, [0.5, 0.25][k]])


def test_a_column_of_which_nothing_is_known_stays_and_none_takes_the_place_of_a_pose(tmp_path):
    path = csv_file(tmp_path / "a.csv", poses(2), "x,y,z,qx,qy,qz,qw,label", (["", ""],))
    grasps.write(tmp_path / "b.csv", grasps.read(path))
    assert (tmp_path / "b.csv").read_text().splitlines()[0] == "x,y,z,qx,qy,qz,qw,label"
    assert np.isnan(grasps.read(tmp_path / "b.csv").labels).all()
    made = grasps.GraspSet(poses(2), columns={"x": np.array([7.0, 8.0])})
    grasps.write(tmp_path / "c.csv", made)
    assert np.allclose(grasps.read(tmp_path / "c.csv").poses, made.poses)


def test_a_file_that_is_there_stays_unless_it_may_be_replaced(tmp_path):
    path = csv_file(tmp_path / "t.csv", poses(2))
    read, text = grasps.read(path), path.read_text()
    with pytest.raises(ValueError, match="exists: choose another path, or give overwrite=True"):
        grasps.write(path, read)
    assert path.read_text() == text
    grasps.write(path, read, [0.1, 0.2], overwrite=True)
    assert "energymargin/probability" in grasps.read(path).columns
    with pytest.raises(ValueError, match=r"expected a name with \.h5 or "):
        grasps.write(tmp_path / "t.npy", read)
    with pytest.raises(ValueError, match=r"scores 'probability' is .*shape \(2,\)"):
        grasps.write(tmp_path / "u.csv", read, [0.1])


def test_graspgen_has_no_label_that_is_not_known(tmp_path):
    made = grasps.GraspSet(poses(2), labels=[1, np.nan])
    with pytest.raises(ValueError, match=r"write grasps\[~np.isnan\(grasps.labels\)\], or give"):
        grasps.write(tmp_path / "a.json", made, **FRAME)
    assert not list(tmp_path.iterdir())
    grasps.write(tmp_path / "a.json", made, [0.1, 0.9], **FRAME)
    assert grasps.read(tmp_path / "a.json", **FRAME).labels.tolist() == [0, 1]


# What is wrong


def changed(k, change):
    made = poses(3)
    change(made[k])
    return made


def scaled(pose):
    pose[:3, :3] *= 2


def mirrored(pose):
    pose[:3, 0] *= -1


def unknown(pose):
    pose[0, 3] = np.nan


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (changed(1, scaled), "determinant of the pose of grasp '1' is 8.* expected a rotation"),
        (changed(2, mirrored), "grasp '2' is -1.*left-handed"),
        (changed(0, unknown), "the pose of grasp '0' is nan, expected finite numbers"),
        (poses(3).transpose(0, 2, 1), r"grasp '0' is .* \(as are 2 more\).*transposed"),
        (poses(3) @ shift(500), "m from the object's frame.*scale=0.001"),
        (poses(3)[:, :3], r"the poses have the shape \(3, 3, 4\), expected \(n, 4, 4\)"),
        (poses(3)[:0], "there are no grasps"),
    ],
)
def test_poses_that_are_none_are_told_with_the_way_out(tmp_path, made, text):
    path = acronym_file(tmp_path / "a.h5", made, [1] * len(made))
    with pytest.raises(ValueError, match=text) as error:
        grasps.read(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize(
    ("header", "extra", "text"),
    [
        ("x,y,z,qw,qx,qy,qz,width", ([0.1, -0.1],), "opening of grasp '1' is -0.1, expected 0 to"),
        ("x,y,z,qx,qy,qz,qw,width", ([80, 50],), r"'0' is 80.0 \(as are 1 more\).*scale=0.001"),
        ("x,y,z,qx,qy,qz,qw,label", ([1, 2],), "the label of grasp '1' is 2.0, expected 0"),
        ("x,y,z,qx,qy,qz,qw,label", ([1, "so"],), "label is 'so' in row 2, expected a number"),
        ("x,y,z,a,qx,qy,qz,qw", ([0, 1],), "quaternion of grasp 1 is .* with the norm"),
        (
            "x,y,z,roll,pitch,yaw,a",
            (),
            "first line is x, .*expected a table.*roll, pitch, yaw are not read",
        ),
        ("x,px,y,z,qx,qy,qz,qw", ([0, 1],), "the header has 'x' and 'px', expected one x"),
        ("x,y,z,qx,qy,qz,qw,a,a", ([0, 1], [0, 1]), "the header has 'a' 2 times"),
        ("0,0,0,1,0,0,0", (), "has 7 numbers in its first line.*x,y,z,qw,qx,qy,qz"),
        ("x,y,z,qx,qy,qz,qw,a", (), "row 1 has 7 cells, expected 8"),
    ],
)
def test_tables_that_are_none_are_told_with_the_way_out(tmp_path, header, extra, text):
    with pytest.raises(ValueError, match=text):
        grasps.read(csv_file(tmp_path / "t.csv", poses(2), header, extra))


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "first line is missing, expected a table.*ACRONYM.*GraspGen.*isaac_grasp"),
        (b"a picture \xff\xfe\x00", "is no text in UTF-8, expected a table.*ACRONYM"),
        (b"solid\nfacet", "first line is solid, expected a table.*ACRONYM"),
        (b'{"grasps": [', "is no whole JSON file"),
        (b"[" * 100_000, "is no whole JSON file"),
        (b'{"scene": 1}', "JSON file of something else, expected GraspGen's"),
        (b"grasps: [", "is no whole YAML file"),
        (b"format: other\ngrasps: {}", "YAML file of something else"),
        (b"format: isaac_grasp\nformat_version: 2.0\ngrasps: {}", "format_version is 2.0"),
        (b"grasps: {a: {position: [0, 0, 0]}}", "grasp 'a' is .*expected position"),
        (b"grasps: {a: {position: [0, 0], orientation: {w: 1, xyz: [0, 0, 0, 0]}}}", "grasp 'a'"),
        (b'{"grasps": {"transforms": [1, 2], "object_in_gripper": [1]}}', "not a list of 2 values"),
        (b"grasps: !!python/object/apply:os.system ['true']", "is no whole YAML file"),
    ],
)
def test_files_of_something_else_are_told(tmp_path, content, text):
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(ValueError, match=text):
        grasps.read(tmp_path / "file", **FRAME)


def test_a_file_of_hdf5_that_is_cut_off_or_of_something_else_is_told(tmp_path):
    whole = acronym_file(tmp_path / "a.h5", poses(500), [1] * 500).read_bytes()
    (tmp_path / "a.h5").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match="damaged or cut off, expected a whole HDF5 file"):
        grasps.read(tmp_path / "a.h5")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["images"] = [1]
    with pytest.raises(ValueError, match="has images, expected grasps/transforms"):
        grasps.read(tmp_path / "b.h5")


def test_aliases_that_stand_for_billions_of_entries_are_refused_at_once(tmp_path):
    lines = ["grasps: {}", "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    (tmp_path / "bomb").write_text("\n".join(lines))
    with pytest.raises(ValueError, match="more than 20 million entries"):
        grasps.read(tmp_path / "bomb", **FRAME)
    (tmp_path / "loop").write_text("grasps: &a {b: *a}")
    with pytest.raises(ValueError, match="more than 20 million entries"):
        grasps.read(tmp_path / "loop", **FRAME)


def test_a_frame_that_no_one_can_know_is_asked_for(tmp_path):
    path = isaac_file(tmp_path / "i.yaml", poses(2))
    with pytest.raises(
        ValueError, match=r"of any hand \(here '/World/panda_hand'\); expected 'gra"
    ):
        grasps.read(path)
    for wrong in ("panda", [1, 2], np.zeros((4, 4)), "0.1"):
        with pytest.raises(ValueError, match="frame"):
            grasps.read(path, frame=wrong)
    with pytest.raises(FileNotFoundError, match="there is no such file"):
        grasps.read(tmp_path / "none.h5")


@pytest.mark.long
def test_a_hundred_thousand_grasps_of_json_take_seconds(tmp_path):
    many = 100_000
    (tmp_path / "a.json").write_text(graspgen_text(poses(many), [True] * many))
    start = time.perf_counter()
    assert len(grasps.read(tmp_path / "a.json", **FRAME)) == many
    assert time.perf_counter() - start < 20  # of 2 s


# Files of others


def touched(read, mesh, scale, center, half):
    """Share of the grasps with a point of the mesh in a box of the grasp frame."""
    points = np.c_[mesh.vertices * scale, np.ones(len(mesh.vertices))]
    here = np.einsum("nij,pj->npi", np.linalg.inv(read.poses), points)[..., :3]
    return (np.abs(here - center) < half).all(2).any(1).mean()


def fingers(read, mesh, scale, axis):
    """Share of fingers in the mesh, of a Panda hand that is open along an axis."""
    center, half = np.zeros(3), np.full(3, 0.009)
    center[axis], half[axis] = 0.047, 0.007
    return np.mean([touched(read, mesh, scale, side * center, half) for side in (1, -1)])


BETWEEN = (0.04, 0.01, 0.01)  # m, half the room between the pads


@needs_data
def test_acronyms_mug_is_between_the_pads_and_in_no_finger():
    import trimesh

    read = grasps.read(Path(GIVEN) / "acronym/mug.h5")
    assert (len(read), round(read.labels.mean(), 2)) == (2000, 0.64)
    mesh = trimesh.load(read.object.mesh, force="mesh").subdivide()
    held = read[read.labels == 1][:200]
    assert touched(held, mesh, read.object.scale, 0, BETWEEN) > 0.98
    assert fingers(held, mesh, read.object.scale, 0) == 0
    assert fingers(held, mesh, read.object.scale, 1) > 0.2


@needs_data
def test_grasps_of_a_real_panda_have_the_objects_between_their_pads():
    import trimesh

    folder = Path(GIVEN) / "graspa"
    objects = folder / "objects.csv"
    every = grasps.read(folder / "grasps.csv", object=objects)
    assert np.isin(every.labels, (0, 1)).all()
    assert {"planner", "layout", "object", "stability"} == set(every.columns)
    with pytest.raises(ValueError, match="object is None, and GRASPA has poses in the frame of a"):
        grasps.read(folder / "grasps.csv")
    rows = []
    for name in np.unique(every.columns["object"]):
        read = grasps.read(folder / "grasps.csv", object=objects, where={"object": name})
        mesh, held = trimesh.load(read.object.mesh).subdivide(), read[read.labels == 1]
        axes = [fingers(held, mesh, 1.0, axis) for axis in (0, 1)]
        rows.append([touched(held, mesh, 1.0, 0, BETWEEN), *axes])
    between, along_x, along_y = np.mean(rows, axis=0)
    assert between > 0.95
    assert along_x < along_y / 2
