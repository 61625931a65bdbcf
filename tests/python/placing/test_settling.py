"""What is at rest: closed forms, and scenes of others."""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
from command_line import run_here
from scipy import optimize
from scipy.spatial.transform import Rotation

import energymargin as em

REAL = os.environ.get("ENERGYMARGIN_REAL", "")
real = pytest.mark.skipif(not REAL, reason="ENERGYMARGIN_REAL is not set")
BRICK = (0.2, 0.1, 0.05)  # m


def harmonic(count, share, brick=BRICK):
    """A stack of bricks, each `share` of 1 / 2n of a brick's length beyond the one below it."""
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    x = 0.0
    for k in range(count):
        at = (x, 0, brick[2] * (k + 0.5))
        scene.add_body(f"brick{k}", em.Box(brick), mass=1.0, position=at, friction=0.7)
        x += share * brick[0] / 2 / (count - 1 - k) if k < count - 1 else 0.0
    return scene


@pytest.mark.parametrize("count", [2, 3, 5, 7])
def test_a_harmonic_stack_stands_below_its_limit_and_falls_above(count):
    assert em.settle(harmonic(count, 0.98)).stays
    fallen = em.settle(harmonic(count, 1.02))
    assert fallen.moved and fallen.at_rest
    assert fallen[f"brick{count - 1}"].verdict == "moved"


def what_it_does(angle, friction, size):
    """Whether a block on a slope, which goes down along x, begins to slide, to topple, or both."""
    turn = np.deg2rad(angle)
    scene = em.Scene(gravity=(9.81 * np.sin(turn), 0, -9.81 * np.cos(turn)), step=1 / 960)
    scene.add_plane("slope", friction=friction)
    scene.add_body("block", em.Box(size), mass=1.0, position=(0, 0, size[2] / 2), friction=1.0)
    found = em.settle(scene, time=0.05, still=1e-7, during=0.05)
    there = scene.unpack(found.state)["block"]
    edge = np.array([size[0] / 2, 0.0, -size[2] / 2])
    at = Rotation.from_quat(there["orientation"]).apply(edge) + there["position"]
    slides, topples = at[0] - edge[0] > 1e-6, found["block"].turned > 2e-4
    return {(0, 0): "stays", (1, 0): "slides", (0, 1): "topples", (1, 1): "both"}[slides, topples]


def least_friction_to_turn(angle, size):
    """Below it the edge about which a block begins to topple slides: F / N of the pivot."""
    turn, a, b = np.deg2rad(angle), size[0] / 2, size[2] / 2
    spin = (np.sin(turn) * b - np.cos(turn) * a) / (4 / 3 * (a * a + b * b))  # over g
    return (np.sin(turn) - spin * b) / (np.cos(turn) + spin * a)


FLAT, TALL = (0.1, 0.1, 0.05), (0.05, 0.1, 0.1)


def angle_of_both(friction):
    return optimize.brentq(lambda a: least_friction_to_turn(a, TALL) - friction, 27, 80)


@pytest.mark.parametrize(
    ("border", "friction", "size", "expected"),
    [
        (np.rad2deg(np.arctan(0.4)), 0.4, FLAT, ("stays", "slides")),
        (np.rad2deg(np.arctan(0.3)), 0.3, TALL, ("stays", "slides")),
        (np.rad2deg(np.arctan(0.5)), 0.9, TALL, ("stays", "topples")),
        (angle_of_both(0.55), 0.55, TALL, ("topples", "both")),
        (angle_of_both(0.6), 0.6, TALL, ("topples", "both")),
    ],
)
def test_a_block_on_a_slope_changes_what_it_does_at_the_angle_of_statics(
    border, friction, size, expected
):
    assert tuple(what_it_does(border + d, friction, size) for d in (-0.2, 0.2)) == expected


def test_a_steep_block_topples_as_it_slides_only_with_a_friction_above_w_over_h():
    border = TALL[0] / TALL[2]
    assert [what_it_does(50, border + d, TALL) for d in (-0.01, 0.01)] == ["slides", "both"]


@pytest.mark.parametrize(("size", "off"), [(0.01, 0.001), (0.1, 0.001), (1.0, 0.01), (10.0, 0.01)])
def test_a_box_that_stands_on_an_edge_falls_however_slowly_it_begins(size, off):
    lean, corner = np.deg2rad(45 - off), size / np.sqrt(2)
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    pose = {"position": (0, 0, corner * np.cos(np.deg2rad(off)))}
    pose["orientation"] = (0, np.sin(lean / 2), 0, np.cos(lean / 2))
    scene.add_body("box", em.Box((size,) * 3), density=500, friction=0.9, **pose)
    found = em.settle(scene, time=30)
    assert found["box"].verdict == "moved" and found.at_rest
    assert np.rad2deg(found["box"].turned) == pytest.approx(45, abs=0.2)


def test_nothing_is_said_of_a_scene_in_which_nothing_can_move():
    scene = em.Scene()
    scene.add_body("box", em.Box((1, 1, 1)), mass=0.0)
    with pytest.raises(ValueError, match="scene has no body that can move"):
        em.settle(scene)


def test_what_moves_is_told_with_its_way_its_time_and_its_place():
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    scene.add_body("ball", em.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.55))
    found = em.settle(scene)
    body = found["ball"]
    assert body.dropped == pytest.approx(0.5, abs=1e-4) and body.on == ("floor",)
    assert body.rest_at == pytest.approx(np.sqrt(2 * 0.5 / 9.81), abs=0.05)
    assert not found.stays and found.at_rest and found.time < 1.0
    again = em.settle(scene, found.state)
    assert again.stays and again.time == pytest.approx(0.25)


def test_what_falls_out_and_what_never_rests_are_told():
    scene = em.Scene()
    scene.add_body("table", em.Box((1, 1, 0.1)), mass=0.0)
    scene.add_body("cup", em.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.6, 0, 0.1))
    found = em.settle(scene)
    assert found["cup"].verdict == "fell out" and found.time < 2.0
    scene.add_body("roll", em.Sphere(0.05), mass=1.0, position=(0, 0, 0.1), velocity=(0.2, 0, 0))
    assert em.settle(scene, time=1.0)["roll"].verdict == "never at rest"


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_what_a_lift_carries_does_not_fall_out(speed):
    scene = em.Scene()
    lift = {"mass": 1.0, "kinematic": True, "velocity": (0, 0, speed), "position": (0, 0, 1)}
    scene.add_body("lift", em.Box((0.3, 0.3, 0.02)), **lift)
    at = {"position": (0, 0, 1.06), "velocity": (0, 0, speed)}
    scene.add_body("cup", em.Box((0.1, 0.1, 0.1)), mass=1.0, **at)
    found = em.settle(scene, time=1.0)
    assert found["cup"].verdict == "never at rest" and found["cup"].on == ("lift",)
    assert found["cup"].dropped == pytest.approx(-speed, abs=1e-3)


def test_a_body_without_a_shape_counts_as_a_point():
    scene = em.Scene()
    scene.add_plane("floor")
    inertial = em.Inertial((0, 0, 0), inertia=(1e-9, 1e-9, 1e-9))
    scene.add_body("frame", em.Compound([]), mass=1.0, inertial=inertial, position=(0, 0, 1))
    assert em.settle(scene, time=0.3)["frame"].dropped == pytest.approx(9.81 * 0.3**2 / 2, rel=0.02)


def test_overlaps_at_the_start_are_told():
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.047))
    ((one, other, depth),) = em.settle(scene).overlaps
    assert {one, other} == {"box", "floor"} and depth == pytest.approx(0.003)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time": 0.1}, "time is 0.1, expected at least during, 0.25"),
        ({"time": 0.0}, "time is 0"),
        ({"still": -1.0}, "still is -1"),
        ({"tolerance": np.nan}, "tolerance is nan"),
    ],
)
def test_bad_numbers_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        em.settle(harmonic(2, 0.5), **given)


def test_a_scene_without_gravity_is_refused():
    with pytest.raises(ValueError, match="without gravity"):
        em.settle(em.Scene(gravity=(0, 0, 0)))


def test_a_timeout_keeps_what_is_known():
    scene = harmonic(2, 0.5)
    scene.add_body("roll", em.Sphere(0.05), mass=1.0, position=(0, 5, 0.05), velocity=(0.2, 0, 0))
    found = em.settle(scene, time=1e5, timeout=0.3)
    assert not found.complete and found.time > 0.25 and found["brick0"].verdict == "stays"
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled):
        em.settle(scene, cancel=cancel)


XML = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
<body name="box" pos="0 0 {height}"><freejoint/><geom type="box" size=".05 .05 .05" mass="1"/>
</body></worldbody></mujoco>"""


def test_the_command_fails_if_something_moves(tmp_path):
    (tmp_path / "rest.xml").write_text(XML.format(height=0.05))
    (tmp_path / "hangs.xml").write_text(XML.format(height=0.06))
    done = run_here("settle", "rest.xml", cwd=tmp_path)
    assert done.returncode == 0 and "Nothing moves" in done.stdout, done.stderr
    done = run_here("settle", "hangs.xml", "-o", "moved.csv", cwd=tmp_path)
    assert done.returncode == 1 and "1 of 1 bodies move" in done.stdout
    (row,) = csv.DictReader((tmp_path / "moved.csv").open())
    assert row["name"] == "box" and float(row["dropped"]) == pytest.approx(0.01, abs=1e-4)
    assert run_here("settle", "rest.csv", cwd=tmp_path).returncode == 2


# Scenes of others


def bowl_scene():
    path = Path(REAL) / "libero_bowl"
    scene = em.scenes.from_mjcf(
        path / "bowl_on_ramekin.xml", ignore=("option/fluid", "joint.damping")
    )
    return scene, list(csv.DictReader((path / "init_states.csv").open()))


def placed(row, name):
    values = [[float(row[f"{name}_{k}"]) for k in keys] for keys in (["x", "y", "z"], QUATERNION)]
    return dict(zip(("position", "orientation"), values, strict=True))


QUATERNION = ["qx", "qy", "qz", "qw"]


@real
def test_the_stored_states_of_libero_are_not_at_rest():
    scene, rows = bowl_scene()
    for row in rows[:10]:
        found = em.settle(scene, scene.pack(**{n: placed(row, n) for n in ("bowl", "ramekin")}))
        assert found.moved == ("bowl", "ramekin") and found.at_rest
        assert found["bowl"].dropped > 0.1 and found["ramekin"].dropped > 0.05


@real
@pytest.mark.parametrize("height", [0.032, 0.045, 0.06])
def test_the_bowl_set_down_rests_on_the_ramekin(height):
    scene, rows = bowl_scene()
    away = {**placed(rows[0], "bowl"), "position": (5, 5, 0.95)}
    alone = em.settle(scene, scene.pack(bowl=away, ramekin=placed(rows[0], "ramekin"))).state
    ramekin = {k: scene.unpack(alone)["ramekin"][k] for k in ("position", "orientation")}
    bowl = {**away, "position": np.add(ramekin["position"], (0, 0, height))}
    found = em.settle(scene, scene.pack(bowl=bowl, ramekin=ramekin))
    there = scene.unpack(found.state)
    above = there["bowl"]["position"][2] - there["ramekin"]["position"][2]
    assert above == pytest.approx(0.0316, abs=0.001)
    assert np.rad2deg(found["bowl"].turned) < 1.0 and found["bowl"].on == ("ramekin",)


def solid(points, faces):
    """The hull of a convex block; of a frame, a prism along y, the hulls of its sides."""
    if len(points) < 16:
        return em.ConvexHull(points)
    depth = np.array([0.0, np.ptp(points[:, 1]), 0.0])
    front = [points[face] for face in faces if np.ptp(points[face][:, 1]) == 0]
    sides = [p for p in front if p[0, 1] == points[:, 1].min()]
    return em.Compound([em.Part(em.ConvexHull(np.concatenate([p, p + depth]))) for p in sides])


def assembly(name, *, friction, upside_down=False):
    """A file of blocks; its supports are fixed."""
    graph = json.loads((Path(REAL) / "block_assemblies" / f"{name}.json").read_text())
    graph = graph["data"]["graph"]
    nodes = graph.get("data", graph)["node"]
    supports = ("0", "1") if name == "A" or name.startswith("type") else ("0",)
    scene = em.Scene(friction_rule="max", gravity=(0, 0, 9.81 if upside_down else -9.81))
    for key in sorted(nodes, key=int):
        block = nodes[key]["block"].get("data", nodes[key]["block"])
        points = np.array([[p[axis] for axis in "xyz"] for p in block["vertex"].values()])
        center = points.mean(axis=0)
        heavy = {"mass": 0.0} if key in supports else {"density": 2000.0}
        faces = [
            [list(block["vertex"]).index(str(v)) for v in face] for face in block["face"].values()
        ]
        shape = solid(points - center, faces)
        scene.add_body(f"block{key}", shape, position=center, friction=friction, **heavy)
    return scene


@real
@pytest.mark.parametrize("friction", [0.6, 0.84, 1.5])
@pytest.mark.parametrize(
    ("name", "upside_down", "stands"),
    [
        ("A", False, False),
        ("cubes", False, True),
        ("shelf-stable", False, True),
        ("type-a", False, True),
        ("type-c", False, True),
        ("type-a", True, False),
        ("type-c", True, False),
    ],
)
def test_assemblies_of_blocks_stand_or_fall_as_they_should(name, upside_down, stands, friction):
    assert em.settle(assembly(name, friction=friction, upside_down=upside_down)).stays == stands
