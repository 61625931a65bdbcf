"""Edges are sharp for all that meets them: what lies on one or rolls over it, and distances."""

from __future__ import annotations

import numpy as np
import pytest

import energymargin as em

GRAVITY = 9.81
FLAT = (0.0, 0.0, 0.0, 1.0)
ALONG_Y = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
EDGE_UP = (0.0, np.sin(np.pi / 8), 0.0, np.cos(np.pi / 8))
ROUND = {
    "ball": (em.Sphere(0.03), FLAT),
    "capsule": (em.Capsule(radius=0.03, length=0.1), ALONG_Y),
    "cylinder": (em.Cylinder(radius=0.03, length=0.1), ALONG_Y),
}


def after(scene: em.Scene, seconds: float, name: str) -> np.ndarray:
    """Position of a body after a time."""
    state = em.World(scene).simulate(scene.pack(), round(seconds / scene.step)).states[-1]
    return np.array(scene.unpack(state)[name]["position"])


@pytest.mark.parametrize("shape", ROUND)
@pytest.mark.parametrize("thickness", [0.02, 0.7])
@pytest.mark.parametrize("inside", [0.001, 0.004])
def test_what_is_round_rests_up_to_the_edge_of_a_table(
    shape: str, thickness: float, inside: float
) -> None:
    solid, orientation = ROUND[shape]
    scene = em.Scene()
    scene.add_body(
        "table", em.Box((1, 1, thickness)), mass=0, position=(-0.5, 0, -thickness / 2), friction=0.5
    )
    scene.add_body(
        "it", solid, mass=0.2, position=(-inside, 0, 0.03), orientation=orientation, friction=0.5
    )
    assert after(scene, 2.0, "it") == pytest.approx([-inside, 0, 0.03], abs=1e-4)


def slot(radius: float, half_gap: float, thickness: float) -> em.Scene:
    """A ball over a slot between two boards, on their edges."""
    scene = em.Scene()
    for side in (-1, 1):
        place = (side * (0.5 + half_gap), 0, -thickness / 2)
        scene.add_body(
            f"board{side}", em.Box((1, 1, thickness)), mass=0, position=place, friction=0
        )
    height = np.sqrt(radius**2 - half_gap**2)
    scene.add_body(
        "ball",
        em.Sphere(radius),
        mass=0.2,
        position=(0, 0, height),
        friction=0,
        role="object",
        linear_factor=(1, 0, 1),
        angular_factor=(0, 0, 0),
    )
    return scene


@pytest.mark.parametrize(
    ("radius", "half_gap"), [(0.03, 0.01), (0.03, 0.005), (0.02, 0.012), (0.005, 0.0)]
)
@pytest.mark.parametrize("thickness", [0.02, 0.5])
def test_a_ball_lies_in_a_slot_as_deep_as_its_edges_let_it(
    radius: float, half_gap: float, thickness: float
) -> None:
    scene = slot(radius, half_gap, thickness)
    assert after(scene, 2.0, "ball")[2] == pytest.approx(np.sqrt(radius**2 - half_gap**2), abs=2e-5)


def test_the_effort_out_of_a_slot_is_the_weight_times_its_depth_and_its_bound_is_no_higher() -> (
    None
):
    scene = slot(0.03, 0.01, 0.2)
    state = em.World(scene).simulate(scene.pack(), 240).states[-1]
    right = 0.2 * GRAVITY * (0.03 - np.sqrt(0.03**2 - 0.01**2))
    captured = em.regions.HalfSpace("ball", (1, 0, 0), 0.015)
    problem = em.Problem(
        scene, state, force=(2, 0, 2), torque=(0, 0, 0), duration=0.1, captured=captured
    )
    effort = em.escape_effort(problem, nodes=2000, search="improved", seed=0).effort
    bound = em.effort_lower_bound(problem).effort
    assert bound <= right * 1.001
    assert bound <= effort
    assert effort == pytest.approx(right, rel=0.15)


@pytest.mark.parametrize("shape", ROUND)
@pytest.mark.parametrize("step", [0.002, 0.01])
def test_what_is_round_climbs_a_step_by_the_law_of_the_lever(shape: str, step: float) -> None:
    solid, orientation = ROUND[shape]
    up = 0.03 - step
    needed = GRAVITY * 0.2 * np.sqrt(0.03**2 - up**2) / up
    for share, climbs in ((0.97, False), (1.03, True)):
        scene = em.Scene()
        scene.add_plane("floor", friction=1.0)
        scene.add_body(
            "step", em.Box((1, 1, 0.2)), mass=0, position=(0.5, 0, step - 0.1), friction=1.0
        )
        place = (-np.sqrt(0.03**2 - up**2), 0, 0.03)
        scene.add_body(
            "it",
            solid,
            mass=0.2,
            position=place,
            orientation=orientation,
            friction=1.0,
            force=(share * needed, 0, 0),
        )
        assert (after(scene, 0.5, "it")[2] > 0.03 + 0.5 * step) == climbs, share


def standing(
    floor: object, thing: object, height: float, orientation: tuple[float, ...]
) -> em.Scene:
    """A thing of 1 kg on a box or a plane, which does not turn."""
    scene = em.Scene()
    if floor == "plane":
        scene.add_plane("floor")
    else:
        scene.add_body("floor", floor, mass=0, position=(0, 0, -0.05))
    scene.add_body(
        "it",
        thing,
        mass=1,
        position=(0, 0, height),
        orientation=orientation,
        role="object",
        angular_factor=(0, 0, 0),
    )
    return scene


CAN_TILT = 0.5
CASES = {
    "box on its edge": (em.Box((0.1, 0.1, 0.1)), 0.05 * 2**0.5, EDGE_UP),
    "can on its rim": (
        em.Cylinder(radius=0.05, length=0.1),
        0.05 * np.sin(CAN_TILT) + 0.05 * np.cos(CAN_TILT),
        (0.0, np.sin(CAN_TILT / 2), 0.0, np.cos(CAN_TILT / 2)),
    ),
    "box on its corner": (
        em.Box((0.1, 0.1, 0.1)),
        0.05 * 3**0.5,
        (
            -np.sin(np.arctan(2**0.5) / 2) / 2**0.5,
            np.sin(np.arctan(2**0.5) / 2) / 2**0.5,
            0.0,
            np.cos(np.arctan(2**0.5) / 2),
        ),
    ),
}


@pytest.mark.parametrize("floor", ["plane", "box"])
@pytest.mark.parametrize("case", CASES)
def test_what_stands_on_an_edge_or_a_corner_touches_and_is_at_no_distance(
    floor: str, case: str
) -> None:
    thing, height, orientation = CASES[case]
    scene = standing(
        "plane" if floor == "plane" else em.Box((1, 1, 0.1)), thing, height, orientation
    )
    world, state = em.World(scene), scene.pack()
    assert world.distance(state, "floor", "it") == pytest.approx(0.0, abs=1e-7)
    later = world.simulate(state, 240).states[-1]
    assert scene.unpack(later)["it"]["position"][2] == pytest.approx(height, abs=2e-5)
    assert world.distance(later, "floor", "it") == pytest.approx(0.0, abs=2e-5)
    for touching in (
        em.regions.Touching("it", "floor"),
        em.regions.Touching("it", "floor", force=9.0),
    ):
        assert touching.contains(scene, later[None])[0]


def test_the_distance_of_a_ball_beside_a_corner_is_that_of_the_sharp_corner() -> None:
    scene = em.Scene()
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=1, role="object")
    scene.add_body("ball", em.Sphere(0.01), mass=1, position=(0.08, 0.08, 0.08))
    assert em.World(scene).distance(scene.pack(), "box", "ball") == pytest.approx(
        3**0.5 * 0.03 - 0.01, abs=1e-12
    )
