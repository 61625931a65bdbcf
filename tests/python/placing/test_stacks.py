"""What a stack can take: efforts, tilts and accelerations in closed form."""

from dataclasses import replace

import numpy as np
import pytest

import energymargin as em

G = 9.81


def on_a_tray(size, friction=0.8, shape=None, yaw=0.0):
    scene = em.Scene()
    scene.add_body("tray", em.Box((2, 2, 0.02)), mass=0.0, position=(0, 0, -0.01), friction=1.0)
    solid, at = shape or em.Box(size), (0, 0, size[2] / 2)
    heavy = {"mass": 0.4, "friction": friction, "role": "object"}
    scene.add_body("cup", solid, position=at, yaw=yaw, **heavy)
    return scene


def test_boxes_topple_with_the_work_of_the_closed_form():
    sizes = [*np.random.default_rng(5).uniform(0.04, 0.3, (10, 3)), (0.004, 0.006, 0.01), (1, 2, 3)]
    for size in sizes:
        found = em.stack_robustness(on_a_tray(size), support=())
        low = min(size[:2])
        expected = 0.4 * G * (np.hypot(low / 2, size[2] / 2) - size[2] / 2)
        assert found.weakest.effort == pytest.approx(expected, rel=0.02)
        assert found.weakest.way == "topples" and found.weakest.takes == ()


@pytest.mark.parametrize(
    ("width", "height", "gravity"), [(2, 0.4, 1.62), (0.3, 0.1, 0.1), (1, 3, 1.62), (10, 30, 9.81)]
)
def test_what_falls_slowly_has_the_time_to_fall(width, height, gravity):
    scene = em.Scene(gravity=(0, 0, -gravity))
    scene.add_plane("floor", friction=1.0)
    size, place = em.Box((width, width, height)), (0, 0, height / 2)
    scene.add_body("block", size, mass=100.0, position=place, friction=0.9, role="object")
    (push,) = em.stack_robustness(scene, support=()).pushes
    expected = 100.0 * gravity * (np.hypot(width / 2, height / 2) - height / 2)
    assert push.effort == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.1])
def test_a_cylinder_topples_with_the_same_work_for_any_yaw(yaw):
    shape = em.Cylinder(0.03, 0.14)
    found = em.stack_robustness(on_a_tray((0, 0, 0.14), shape=shape, yaw=yaw), support=())
    expected = 0.4 * G * (np.hypot(0.03, 0.07) - 0.07)
    assert found.weakest.effort == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("friction", "size"), [(0.3, (0.08, 0.08, 0.1)), (0.9, (0.05, 0.08, 0.12))]
)
def test_a_tray_may_lean_and_accelerate_as_statics_say(friction, size):
    """Until it slides by the radius within a second, or topples."""
    found = em.stack_robustness(on_a_tray(size, friction), bodies=[], radius=0.01)
    ratio = min(friction + 2 * 0.01 / G, size[0] / size[2])
    low, high = found.acceleration.interval()
    assert low * 0.99 <= G * ratio <= high * 1.01 and high - low < 0.02 * high
    assert found.tilt.value == pytest.approx(np.arctan(ratio), rel=0.01)
    assert found.complete and "m/s^2" in found.to_markdown()


@pytest.mark.parametrize("degrees", [22.5, 30.0, 77.0])
def test_the_worst_direction_is_across_an_edge_however_the_box_is_turned(degrees):
    size = (0.05, 0.1, 0.2)
    found = em.stack_robustness(on_a_tray(size, 0.9, yaw=np.deg2rad(degrees)), bodies=[])
    assert found.tilt.value == pytest.approx(np.arctan(0.25), rel=0.01)
    assert found.acceleration.value == pytest.approx(0.25 * G, rel=0.01)


def test_a_stack_that_is_not_at_rest_is_told():
    scene = on_a_tray((0.1, 0.1, 0.1))
    state = scene.pack(cup={"position": (0, 0, 0.5)})
    with pytest.warns(em.PlausibilityWarning, match="state is not at rest: cup moves by itself"):
        em.stack_robustness(scene, state, support=())


def test_the_weakest_of_a_stack_takes_along_what_it_carries():
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    sizes = {"base": (0.2, 0.2, 0.1), "post": (0.03, 0.03, 0.15), "plate": (0.05, 0.05, 0.02)}
    height = 0.0
    for name, size in sizes.items():
        at = (0, 0, height + size[2] / 2)
        scene.add_body(name, em.Box(size), density=500, position=at, friction=0.8, role="object")
        height += size[2]
    found = em.stack_robustness(scene, support=())
    efforts = {push.body: push.effort for push in found.pushes}
    assert efforts["base"] > 10 * efforts["post"] and found.complete
    assert found["post"].takes == ("plate",)
    post, plate = (500 * np.prod(sizes[name]) for name in ("post", "plate"))
    mass, center = post + plate, (post * 0.075 + plate * 0.16) / (post + plate)
    whole = mass * G * (np.hypot(0.015, center) - center)
    assert efforts["post"] <= 1.02 * whole


def test_knocks_lower_what_the_support_may_do():
    scene = on_a_tray((0.05, 0.05, 0.1))
    quiet, knocked = (
        em.stack_robustness(scene, bodies=[], support=("tilt",), knock=k).tilt for k in (0.0, 0.3)
    )
    assert knocked.high < quiet.low


def test_a_box_that_moves_in_a_plane_topples_in_it():
    """Its depth is less than its width, but no push turns it that way."""
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    in_plane = {"linear_factor": (1, 0, 1), "angular_factor": (0, 1, 0), "friction": 0.8}
    size, at = (0.1, 0.04, 0.2), (0, 0, 0.1)
    scene.add_body("box", em.Box(size), mass=0.4, position=at, role="object", **in_plane)
    found = em.stack_robustness(scene)
    expected = 0.4 * G * (np.hypot(0.05, 0.1) - 0.1)
    assert found.weakest.effort == pytest.approx(expected, rel=0.02)
    assert abs(found.weakest.direction[0]) == 1.0
    assert found.tilt.value == pytest.approx(np.arctan(0.5), rel=0.02)


def test_an_object_on_a_joint_is_not_pushed_but_has_to_stay():
    """The base slides with it beyond its friction, less what it may slip."""
    scene = em.Scene()
    scene.add_plane("floor", friction=1.0)
    base = {"mass": 1.0, "position": (0, 0, 0.05), "friction": 0.6}
    scene.add_body("base", em.Box((0.3, 0.3, 0.1)), **base)
    scene.add_body("door", em.Box((0.1, 0.02, 0.1)), mass=0.2, role="object")
    at = {"origin": (0, 0, 0.05), "child_origin": (0, 0, -0.06)}
    scene.add_joint("hinge", parent="base", child="door", held=True, **at)
    found = em.stack_robustness(scene, support=("acceleration",), horizon=1.0)
    assert found.complete and not found.pushes
    assert found.acceleration.value == pytest.approx(0.6 * G + 2 * 0.02, rel=0.01)


def test_what_cannot_be_asked_is_refused():
    scene = em.Scene()
    scene.add_plane("floor")
    scene.add_body("box", em.Box((1, 1, 1)), mass=1.0, position=(0, 0, 0.5))
    with pytest.raises(ValueError, match="scene has no object"):
        em.stack_robustness(scene)
    with pytest.raises(ValueError, match="support is 'shake'"):
        em.stack_robustness(on_a_tray((0.1, 0.1, 0.1)), support=("shake",))
    with pytest.raises(ValueError, match=r"support is 'tilt', expected a list of names"):
        em.stack_robustness(on_a_tray((0.1, 0.1, 0.1)), support="tilt")
    with pytest.raises(ValueError, match="probability is 95"):
        em.stack_robustness(on_a_tray((0.1, 0.1, 0.1)), probability=95)
    with pytest.raises(ValueError, match="bodies is 'tray'"):
        em.stack_robustness(on_a_tray((0.1, 0.1, 0.1)), bodies=["tray"])


def test_a_limit_keeps_the_bodies_that_are_done():
    scene, cancel = em.Scene(), em.Cancel()
    scene.add_plane("floor", friction=1.0)
    for k in range(5):
        at = (0.3 * k, 0, 0.1)
        scene.add_body(f"box{k}", em.Box((0.1, 0.1, 0.2)), mass=1.0, position=at, role="object")
    found = em.stack_robustness(
        scene, progress=lambda done, _: cancel.set() if done == 2 else None, cancel=cancel
    )
    assert not found.complete and len(found.pushes) == 2 and found.tilt is None


def test_a_limit_keeps_what_the_support_may_do_without_bodies():
    scene, cancel = on_a_tray((0.05, 0.05, 0.1)), em.Cancel()
    asked = {"bodies": [], "cancel": cancel}
    found = em.stack_robustness(scene, progress=lambda *_: cancel.set(), **asked)
    assert not found.complete and found.tilt.complete and found.acceleration is None


def test_what_has_a_critical_value_that_is_cut_off_is_not_complete(monkeypatch):
    search = em.critical_value

    def cut_off(*given, **asked):
        return replace(search(*given, **asked), complete=False)

    monkeypatch.setattr(em, "critical_value", cut_off)
    found = em.stack_robustness(on_a_tray((0.05, 0.05, 0.1)), support=("tilt",))
    assert len(found.pushes) == 1 and found.tilt is not None and not found.complete


def test_a_tray_that_is_carried_may_be_so_much_faster():
    """Its acceleration grows with the square of the speed; a block slides at mu g, less what it may
    slip: 2 r / t^2, where t is the shorter time."""
    friction, acceleration, seconds, radius = 0.3, 1.0, 0.6, 0.02
    scene = em.Scene()
    tray = {"mass": 1.0, "kinematic": True, "position": (0, 0, -0.01), "friction": 1.0}
    scene.add_body("tray", em.Box((2, 2, 0.02)), role="effector", **tray)
    block = {"mass": 0.4, "friction": friction, "role": "object", "position": (0, 0, 0.02)}
    scene.add_body("block", em.Box((0.1, 0.1, 0.04)), **block)
    rows = round(seconds * 240)
    speeds = np.zeros((rows, 6))
    speeds[:, 0] = acceleration * (np.arange(rows) + 0.5) / 240
    plan = em.Plan(1 / 240, velocities={"tray": speeds})
    found = em.stack_robustness(scene, support=(), bodies=[], plan=plan, radius=radius)
    # a s^2 - mu g = 2 r s^2 / T^2
    speed = np.sqrt(friction * G / (acceleration - 2 * radius / seconds**2))
    assert found.speed.side == "below" and found.complete
    assert found.speed.value == pytest.approx(speed, rel=0.03)
    assert "times as fast" in found.to_markdown()


@pytest.mark.parametrize("mu", [0.05, 0.2])
def test_a_slippery_box_slides_as_soon_as_its_friction_is_overcome(mu):
    scene = em.Scene()
    scene.add_plane("ground", friction=1.0)
    box = {"mass": 1.0, "position": (0, 0, 0.025), "friction": mu}
    scene.add_body("box", em.Box((0.1, 0.1, 0.05)), role="object", **box)
    found = em.stack_robustness(scene, bodies=[])
    late = 2 * 0.02 / 2.0**2  # until it has left its place
    assert found.acceleration.value == pytest.approx(mu * G + late, rel=0.01)
    assert found.tilt.value == pytest.approx(np.arctan(mu) + late / G, abs=np.deg2rad(0.1))


def test_bodies_may_come_one_after_the_other() -> None:
    scene = on_a_tray((0.1, 0.1, 0.1))
    (name,) = (body.name for body in scene.bodies if body.role == "object")
    asked = em.stack_robustness(scene, bodies=iter([name]), support=())
    assert [push.body for push in asked.pushes] == [name]
