"""Bodies with a locked axis: the surface that they lie on bears what the lock would, and rubs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import energymargin as em

PLANAR: dict[str, Any] = {"linear_factor": (1, 1, 0), "angular_factor": (0, 0, 1)}
FREE: dict[str, Any] = {}
G = 9.81


def scene_of(kind: dict[str, Any], *, speed: float = 1.0, **changed: Any) -> em.Scene:
    """A box of 0.3 kg that slides over a table, friction 0.4."""
    scene = em.Scene(step=changed.pop("step", 1 / 240))
    scene.add_plane("table", friction=1.0)
    settings = {
        "shape": em.Box((0.1, 0.1, 0.04)),
        "mass": 0.3,
        "position": (0, 0, 0.02),
        "velocity": (speed, 0, 0),
        "friction": 0.4,
        "role": "object",
    }
    scene.add_body("box", **settings | kind | changed)
    return scene


def end_of(scene: em.Scene, name: str = "box", seconds: float = 1.0) -> dict[str, Any]:
    steps = round(seconds / scene.step)
    return scene.unpack(em.World(scene).simulate(scene.pack(), steps).states[-1])[name]


@pytest.mark.parametrize("step", [1 / 240, 1 / 960])
def test_a_planar_body_slides_over_a_table_as_far_as_coulomb_says(step: float) -> None:
    way = end_of(scene_of(PLANAR, step=step))["position"][0]
    assert way == pytest.approx(1.0 / (2 * 0.4 * G), rel=4 * step)


@pytest.mark.parametrize("up", [2.0, -3.0])
def test_a_force_along_the_locked_axis_makes_the_friction_less_or_more(up: float) -> None:
    way = end_of(scene_of(PLANAR, force=(0, 0, up)))["position"][0]
    assert way == pytest.approx(0.3 / (2 * 0.4 * (0.3 * G - up)), abs=0.6 / 240)


def test_what_is_lifted_along_its_locked_axis_has_no_friction() -> None:
    assert end_of(scene_of(PLANAR, force=(0, 0, 4.0)))["position"][0] == pytest.approx(1.0)


@pytest.mark.parametrize("shape", [em.Cylinder(0.05, 0.04), em.Sphere(0.02)], ids=["can", "ball"])
def test_other_shapes_without_a_tilt_slide_as_far(shape: em.Shape) -> None:
    assert end_of(scene_of(PLANAR, shape=shape))["position"][0] == pytest.approx(0.127, rel=0.02)


@pytest.mark.parametrize("height", [0.019, 0.0199, 0.0201, 0.0205])
def test_an_overlap_or_a_gap_below_a_millimetre_changes_no_friction(height: float) -> None:
    way = end_of(scene_of(PLANAR, position=(0, 0, height)))["position"][0]
    assert way == pytest.approx(end_of(scene_of(PLANAR))["position"][0], rel=1e-6)


def test_a_planar_body_that_spins_stops_as_a_free_one() -> None:
    ends = [
        end_of(scene_of(kind, speed=0.3, angular_velocity=(0, 0, 10))) for kind in (PLANAR, FREE)
    ]
    assert ends[0]["position"][0] == pytest.approx(ends[1]["position"][0], rel=0.02)
    assert ends[0]["orientation"][2] == pytest.approx(ends[1]["orientation"][2], rel=0.02)


@pytest.mark.parametrize("on_top", [PLANAR, FREE], ids=["planar", "free"])
def test_a_stack_presses_on_the_table_with_its_whole_weight(on_top: dict[str, Any]) -> None:
    scene = scene_of(PLANAR)
    top = {"mass": 0.6, "position": (0, 0, 0.06), "velocity": (1, 0, 0), "friction": 1.0}
    scene.add_body("top", em.Box((0.1, 0.1, 0.04)), **top | on_top)
    world = em.World(scene)
    state = world.simulate(scene.pack(), 12).states[-1]
    deceleration = (1.0 - scene.unpack(state)["box"]["velocity"][0]) / (12 / 240)
    assert deceleration == pytest.approx(0.4 * G, rel=0.01)
    assert end_of(scene)["position"][0] == pytest.approx(0.127, rel=0.02)


def test_a_planar_pusher_and_its_box_share_their_momentum_and_rub_both() -> None:
    ends = []
    for kind in (PLANAR, FREE):
        scene = scene_of(kind)
        side = {"mass": 0.3, "position": (0.1001, 0, 0.02), "friction": 0.4}
        scene.add_body("side", em.Box((0.1, 0.1, 0.04)), **side | kind)
        ends.append(end_of(scene, "side")["position"][0])
    assert ends[0] == pytest.approx(ends[1], abs=5e-4)


def test_between_two_plates_only_the_weight_counts() -> None:
    scene = scene_of(PLANAR)
    lid = {"mass": 0, "position": (0, 0, 0.09), "friction": 1.0}
    scene.add_body("lid", em.Box((3, 3, 0.1)), **lid)
    assert end_of(scene)["position"][0] == pytest.approx(0.127, rel=0.02)


def test_gravity_along_the_plane_of_motion_makes_no_friction_of_the_floor() -> None:
    scene = em.Scene(gravity=(0, -G, 0))
    scene.add_body("board", em.Box((4, 4, 0.1)), mass=0, position=(0, 0, -0.07), friction=1.0)
    box = {"mass": 0.3, "friction": 1.0, "role": "object"}
    scene.add_body("box", em.Box((0.1, 0.1, 0.04)), **box | PLANAR)
    assert end_of(scene, seconds=0.5)["velocity"][1] == pytest.approx(-0.5 * G)


def test_an_effort_counts_the_friction_of_a_planar_body_as_of_a_free_one() -> None:
    efforts = []
    for kind in (PLANAR, FREE):
        scene = scene_of(kind, speed=0.0)
        leaves = em.regions.Disc("box", (0, 0), 0.05)
        push = {"force": (3, 3, 0), "torque": (0, 0, 0), "duration": 0.2}
        problem = em.Problem(scene, scene.pack(), captured=leaves, **push)
        efforts.append(em.escape_effort(problem, nodes=300).effort)
    least = 0.4 * 0.3 * G * 0.05
    assert min(efforts) > least
    assert efforts[0] == pytest.approx(efforts[1], rel=0.5)


def test_the_energy_of_a_planar_body_is_spent_on_friction() -> None:
    scene = scene_of(PLANAR)
    rollout = em.World(scene).rollout(scene.pack(), wrench=np.zeros(6), duration=0.1, audit=True)
    assert rollout.audit is not None
    assert rollout.audit.friction == pytest.approx(rollout.audit.energy_change, rel=1e-3)
