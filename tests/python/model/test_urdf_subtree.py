"""One link of a URDF file and what hangs on it, as a scene of its own."""

import math

import numpy as np
import pytest
from urdf_files import BOX, INERTIAL, body, built, chain, follower, joint, link, names

# Links a to d in a row, and e beside them.
ROW = (joint("ab", "a", "b"), joint("bc", "b", "c"), joint("cd", "c", "d"))
AB = np.array([0.3, 0, 0])  # from a to b
TREE = chain(*ROW, joint("be", "b", "e", at="0 0.5 0"), links="abcde")


def test_a_subtree_is_one_link_and_all_that_hangs_on_it(tmp_path):
    assert names(built(tmp_path, TREE, subtree="c"))[:2] == (["c", "d"], ["cd"])
    assert names(built(tmp_path, TREE, subtree="b"))[:2] == (list("bcde"), ["bc", "cd", "be"])
    assert names(built(tmp_path, TREE, subtree="e"))[:2] == (["e"], [])
    assert names(built(tmp_path, TREE, subtree="a")) == names(built(tmp_path, TREE))


def test_the_root_of_a_subtree_is_fixed_or_free_and_stands_where_it_is_put(tmp_path):
    pose = {"position": (1, 2, 3), "orientation": (0, 0, math.sqrt(0.5), math.sqrt(0.5))}
    scene = built(tmp_path, TREE, subtree="c", **pose)
    assert [b.fixed for b in scene.bodies] == [True, False]
    assert body(scene, "c").position == pytest.approx([1, 2, 3])
    assert body(scene, "d").position == pytest.approx([1, 2.3, 3])
    free = built(tmp_path, TREE, subtree="c", base="free", prefix="hand/")
    assert [(b.name, b.fixed) for b in free.bodies] == [("hand/c", False), ("hand/d", False)]


def test_links_of_a_subtree_are_to_each_other_as_in_the_whole(tmp_path):
    joints = {"bc": {"start": 0.3}, "cd": {"start": -0.7}}
    whole, part = (built(tmp_path, TREE, joints=joints, **o) for o in ({}, {"subtree": "b"}))
    for name in "bcde":
        ours, expected = body(part, name), body(whole, name)
        assert ours.position + AB == pytest.approx(expected.position, abs=1e-12)
        assert ours.orientation == pytest.approx(expected.orientation, abs=1e-12)
        assert name == "b" or ours.mass == expected.mass


def test_what_is_outside_of_a_subtree_is_not_read(tmp_path):
    """Neither a missing mesh there, nor a joint that is not simulated."""
    mesh = BOX.replace('<box size="0.1 0.1 0.1"/>', '<mesh filename="none.stl"/>')
    text = TREE.replace(link("a"), link("a", INERTIAL + mesh)).replace(
        'name="ab" type="revolute"', 'name="ab" type="floating"'
    )
    with pytest.raises(ValueError, match="'ab' is 'floating'"):
        built(tmp_path, text)
    assert names(built(tmp_path, text, subtree="b"))[0] == list("bcde")


@pytest.mark.parametrize(
    ("subtree", "message"),
    [
        ("f", "subtree is 'f', expected one of the links a, b, c, d, e"),
        ("", "subtree is '', expected one of the links a, b, c, d, e"),
        ("ab", "subtree is 'ab', expected one of the links a, b, c, d, e"),
    ],
)
def test_a_subtree_of_no_link_is_refused_with_the_links(tmp_path, subtree, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, TREE, subtree=subtree)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"roles": {"a": "effector"}}, "roles has 'a', expected one of c, d"),
        ({"joints": {"ab": {}}}, "joints has 'ab', expected one of cd"),
        ({"disable_collisions": [("c", "e")]}, "disable_collisions has 'e', expected one of c, d"),
    ],
)
def test_arguments_may_name_the_subtree_alone(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        built(tmp_path, TREE, subtree="c", **options)


def test_a_joint_that_follows_one_outside_of_the_subtree_is_refused_with_the_way_out(tmp_path):
    text = chain(
        joint("ab", "a", "b"), joint("bc", "b", "c", follower("ab", 1.0, 0.0)), links="abc"
    )
    message = "'bc' mimics 'ab', expected one .* below the root of a subtree; .*'joint/mimic'"
    with pytest.raises(ValueError, match=message):
        built(tmp_path, text, subtree="b")
    (free,) = built(tmp_path, text, subtree="b", ignore=("joint/mimic",)).joints
    assert free.mimic is None


def test_a_joint_of_a_link_that_is_nowhere_is_refused_with_a_subtree_too(tmp_path):
    text = TREE.replace('<parent link="c"/>', '<parent link="cc"/>')
    with pytest.raises(ValueError, match="'cd' has the parent 'cc', expected one of b, c, e"):
        built(tmp_path, text, subtree="b")


def test_a_loop_through_the_subtree_is_refused(tmp_path):
    text = chain(*ROW, joint("db", "d", "b"))
    with pytest.raises(ValueError, match="0 root links"):
        built(tmp_path, text, subtree="b")
