"""What is commonly computed of a grasp, beside closed forms, and how scores are compared."""

import csv
import io

import numpy as np
import pytest
from sklearn.metrics import roc_auc_score

import energymargin as em
from energymargin import grasps
from energymargin.grasps.baselines import surface_of
from energymargin.grasps.comparison import learn

FRICTION = 0.5
SIZE = np.array([0.04, 0.04, 0.016])  # m, of the box that is gripped
HAND = grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02))
CASES = {"middle": (0, 0, 0), "aside": (0, 0.006, 0), "in it": (0.03, 0, 0), "missed": (0, 0.2, 0)}


def faces(half, across):
    """Contacts of two pads, squares of half a width, on faces that are so far from the middle."""
    corners = [
        (s, y, z) for s in (-half, half) for y in (-across, across) for z in (-across, across)
    ]
    return np.array(corners), np.array([(-np.sign(x), 0, 0) for x, _, _ in corners])


def shifts(offsets, **options):
    """Scores of grasps of the box, shifted along the hand's axes."""
    poses = np.tile(np.eye(4), (len(offsets), 1, 1))
    poses[:, :3, 3] = offsets
    thing = grasps.GraspObject(em.Box(SIZE), 0.1, FRICTION)
    return grasps.score(
        grasps.GraspSet(poses, names=tuple(options.pop("names", ()))),
        HAND,
        thing,
        options.pop("protocol", grasps.Protocol([grasps.Motion("hold", 0.1)])),
        rollouts=1,
        colliding="lost",
        threads=1,
        **options,
    )


@pytest.fixture(scope="module")
def boxes():
    with pytest.warns(em.PlausibilityWarning, match="was inside"):  # it starts in the box
        return shifts(list(CASES.values()), names=CASES)


@pytest.fixture(scope="module")
def table(boxes):
    found = grasps.baselines(boxes)
    return {case: {name: found[name][k] for name in found} for k, case in enumerate(CASES)}


@pytest.mark.parametrize("friction", [0.2, 1.0])
def test_a_box_between_two_faces_resists_least_a_turn_about_their_normal(friction):
    half, across = 0.02, 0.01
    points, normals = faces(half, across)
    radius = np.sqrt(3) * half
    shares = (1, np.sqrt(2) * across / radius, across / radius / friction + half / radius)
    found = grasps.wrench_space(points, normals, friction, radius=radius)
    assert found.epsilon == pytest.approx(friction * min(shares), abs=1e-4)


def test_a_wide_grip_of_a_thin_thing_resists_least_a_force_between_two_edges_of_a_cone():
    points, normals = faces(0.01, 1.0)
    found = grasps.wrench_space(points, normals, 0.3, radius=1.0)
    assert found.epsilon == pytest.approx(0.3 * np.cos(np.pi / 8), abs=1e-4)


def test_two_points_resist_no_torque_about_the_line_between_them():
    points, normals = faces(0.02, 0.0)
    assert grasps.wrench_space(points, normals, 1.0, radius=0.03) == (0, 0)


def test_without_friction_two_faces_resist_no_force_along_them():
    points, normals = faces(0.02, 0.01)
    assert grasps.wrench_space(points, normals, 0.0, radius=0.03) == (0, 0)


def test_one_side_alone_closes_no_grasp():
    points, normals = faces(0.02, 0.01)
    found = grasps.wrench_space(points[:4], normals[:4], 0.5, radius=0.03)
    assert found.epsilon == 0
    assert found.volume > 0


def test_volume_falls_with_the_cube_of_the_radius_and_grows_with_friction():
    points, normals = faces(0.02, 0.01)
    sizes = [
        grasps.wrench_space(points, normals, mu, radius=radius).volume
        for mu, radius in ((0.5, 0.03), (0.5, 0.06), (0.6, 0.03))
    ]
    assert sizes[1] == pytest.approx(sizes[0] / 8, rel=1e-3)
    assert sizes[2] > 1.2 * sizes[0]


def test_torques_are_about_the_center():
    points, normals = faces(0.02, 0.01)
    away = np.array([1.0, -2.0, 3.0])
    moved = grasps.wrench_space(points + away, normals, 0.5, center=away, radius=0.03)
    assert moved == pytest.approx(grasps.wrench_space(points, normals, 0.5, radius=0.03), rel=1e-3)


def test_epsilon_of_a_real_grip_is_the_closed_form_of_its_faces(table):
    half_y, half_z = 0.01, SIZE[2] / 2
    radius = np.linalg.norm(SIZE) / 2
    torsion = FRICTION * np.hypot(half_y, half_z) / radius
    assert table["middle"]["epsilon"] == pytest.approx(torsion, rel=0.08)  # of 8 edges
    assert table["aside"]["epsilon"] < table["middle"]["epsilon"]
    assert table["aside"]["volume"] > 0


def test_distances_and_the_surface_between_the_fingers_are_those_of_the_box(table):
    assert table["middle"]["clearance"] == pytest.approx((HAND.opening - SIZE[0]) / 2, abs=1e-4)
    assert table["in it"]["clearance"] < -0.005
    assert [table[case]["center_distance"] for case in CASES] == pytest.approx(
        [0, 0.006, 0.03, 0.2]
    )
    sides, ends = 2 * HAND.pad[0] * SIZE[2], 2 * HAND.pad[0] * SIZE[0]
    assert table["middle"]["between"] == pytest.approx(sides + ends, rel=0.06)
    assert table["missed"]["between"] == 0


def test_a_hand_that_does_not_close_on_it_has_no_grip_to_measure(table):
    for case in ("in it", "missed"):
        for name in ("epsilon", "volume", "force_score"):
            assert np.isnan(table[case][name]), (case, name)
        assert table[case]["undisturbed"] == 0
    assert table["middle"]["undisturbed"] == 1
    assert table["middle"]["force_score"] > 0


def test_the_table_of_scores_takes_baselines_as_columns(boxes):
    found = grasps.baselines(boxes)
    rows = list(csv.DictReader(io.StringIO(boxes.to_csv(found))))
    assert list(rows[0])[-len(found) :] == list(grasps.BASELINES) == list(found)
    (missed,) = (row for row in rows if row["name"] == "missed")
    assert missed["epsilon"] == ""
    assert float(missed["center_distance"]) == pytest.approx(0.2)
    with pytest.raises(ValueError, match="epsilon"):
        boxes.to_csv({"epsilon": [1.0]})


def test_surface_within_another_part_does_not_count():
    box = em.Box((0.1, 0.1, 0.1))
    shape = em.Compound([em.Part(box), em.Part(box, position=(0.05, 0, 0))])
    points, area = surface_of(shape)
    assert area * len(points) == pytest.approx(2 * 0.01 + 4 * 0.015, rel=0.05)


@pytest.fixture(scope="module")
def objects():
    """Grasps of three boxes, each farther aside than the last one."""
    offsets = [(0, y, 0) for y in np.linspace(0, 0.028, 8)]
    return {name: shifts(offsets, seed=seed) for seed, name in enumerate(("one", "two", "three"))}


@pytest.fixture(scope="module")
def columns(objects):
    return {name: grasps.baselines(one) for name, one in objects.items()}


def test_auc_and_pairs_are_those_of_scikit_learn(objects):
    random = np.random.default_rng(0)
    labels = {name: random.random(8) < 0.5 for name in objects}
    columns = {name: {"noise": random.random(8)} for name in objects}
    found = grasps.compare(objects, labels, columns=columns, learned=False, draws=50)
    truth, noise = (
        np.concatenate(list(each))
        for each in (labels.values(), [c["noise"] for c in columns.values()])
    )
    assert found.scores["noise"].cell.auc == pytest.approx(roc_auc_score(truth, noise))
    right = pairs = 0
    for name, label in labels.items():
        both = label.sum() * (~label).sum()
        right += both * roc_auc_score(label, columns[name]["noise"]) if both else 0
        pairs += both
    assert found.scores["noise"].within == pytest.approx(right / pairs)
    assert list(found.scores) == ["probability", "noise"]


def test_what_tells_objects_apart_alone_tells_nothing_within_them(objects):
    labels = {"one": [1] * 7 + [0], "two": [0] * 7 + [1], "three": [0] * 7 + [1]}
    columns = {name: {"object": [float(name == "one")] * 8} for name in objects}
    found = grasps.compare(objects, labels, columns=columns, learned=False, draws=50)
    assert found.scores["object"].cell.auc > 0.8
    assert found.scores["object"].within == 0.5


def test_baselines_rank_with_their_sign_and_what_is_missing_comes_last(objects, columns):
    labels = {name: [1] * 4 + [0] * 4 for name in objects}
    found = grasps.compare(objects, labels, columns=columns, draws=50)
    assert found.scores["center_distance"].cell.auc == 1
    assert found.scores["center_distance"].within == 1
    assert found.scores["center_distance"].ahead <= 0
    assert found.scores["learned"].within > 0.7
    assert (found.grasps, found.held, found.left_out) == (24, 12, 0)
    none = {name: {"half": [1.0] * 4 + [np.nan] * 4} for name in objects}
    assert grasps.compare(objects, labels, columns=none, draws=50).scores["half"].cell.auc == 1


def test_what_is_learned_is_of_other_objects_alone_and_the_same_in_other_units():
    random, groups = np.random.default_rng(1), np.repeat(np.arange(3), 20)
    feature = random.normal(size=60)
    held = feature + random.normal(size=60) > 0
    first = learn({"a": feature}, held, groups)
    assert roc_auc_score(held[:20], first[:20]) == roc_auc_score(held[:20], feature[:20])
    turned = np.where(groups == 0, ~held, held)
    np.testing.assert_array_equal(learn({"a": feature}, turned, groups)[:20], first[:20])
    other = feature * (1 + 9 * groups) + groups
    np.testing.assert_array_equal(learn({"a": other}, held, groups), first)


def test_a_grasp_without_a_label_is_left_out_and_one_kind_of_label_is_an_error(objects, columns):
    labels = {name: [1, 1, np.nan, 0, 0, 0, 0, 0] for name in objects}
    found = grasps.compare(objects, labels, columns=columns, draws=50)
    assert (found.grasps, found.held, found.left_out) == (21, 6, 3)
    with pytest.raises(ValueError, match="24 of 24 grasps"):
        grasps.compare(objects, {name: [1] * 8 for name in objects}, columns=columns)
    with pytest.raises(ValueError, match="0 of 0 grasps"):
        grasps.compare(objects, columns=columns)  # no labels in the file
    uneven = {"one": {"a": [0] * 8}, "two": {}, "three": {}}
    for wrong, why in (
        (uneven, "columns of 'two'"),
        ({"one": {}}, "nothing of 'two'"),
        ({name: {"a": [0] * 7} for name in objects}, "a of 'one'"),
    ):
        with pytest.raises(ValueError, match=why):
            grasps.compare(objects, labels, columns=wrong)


def test_one_object_has_intervals_of_its_grasps(objects):
    labels = {"one": [1, 1, 0, 1, 0, 0, 1, 0]}
    found = grasps.compare({"one": objects["one"]}, labels, draws=200)
    one = found.scores["center_distance"]
    low, high = one.cell.auc_interval
    assert low < one.cell.auc < high
    assert one.within == pytest.approx(one.cell.auc)
    assert "learned" not in found.scores


def test_a_comparison_is_a_table_for_people_and_for_programs(objects):
    labels = {name: [1] * 4 + [0] * 4 for name in objects}
    found = grasps.compare(objects, labels, draws=50)
    assert "12 of 24 grasps hold (one, two, three)" in found.to_markdown()
    assert "center_distance | 1.00/1.00" in found.to_markdown()
    rows = {row["score"]: row for row in csv.DictReader(io.StringIO(found.to_csv()))}
    assert set(rows) == {"probability", *grasps.BASELINES, "learned", "learned with probability"}
    assert float(rows["center_distance"]["auc"]) == 1
