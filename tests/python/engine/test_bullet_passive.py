"""What slows and stops in Bullet's engine: as documented, whatever the strength."""

import pytest

import energymargin as em

pytestmark = pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")


def end(scene: em.Scene, steps: int, **start: object) -> dict:
    last = em.World(scene).simulate(scene.pack(**start), steps).states[-1]
    return scene.unpack(last)


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("engine", ["native", "bullet"])
def test_damping_slows_a_body_with_links_and_without(engine: str, linked: bool) -> None:
    scene = em.Scene(gravity=(0, 0, 0), engine=engine)
    moving = {"velocity": (1, 0, 0), "linear_damping": 2.0, "angular_damping": 0.01}
    scene.add_body("base", em.Box((0.1,) * 3), mass=1.0, **moving)
    if linked:
        scene.add_body("bob", em.Sphere(0.02), mass=0.001)
        scene.add_joint("j", parent="base", child="bob", type="fixed", child_origin=(0, 0, 0.2))
    assert end(scene, 240)["base"]["velocity"][0] == pytest.approx(0.135, abs=0.003)


@pytest.mark.parametrize("engine", ["native", "bullet"])
def test_damping_of_any_strength_turns_nothing_round(engine: str) -> None:
    scene = em.Scene(gravity=(0, 0, 0), engine=engine)
    moving = {"velocity": (1, 0, 0), "angular_velocity": (1, 2, 3)}
    strong = {"linear_damping": 600.0, "angular_damping": 60.0}
    scene.add_body("box", em.Box((0.1, 0.2, 0.3)), mass=1.0, **moving, **strong)
    box = end(scene, 10)["box"]
    assert 0 <= box["velocity"][0] < 1e-4
    assert abs(box["angular_velocity"]).max() < 1e-4


@pytest.mark.parametrize("engine", ["native", "bullet"])
def test_a_joint_that_begins_beyond_its_stop_is_pushed_back(engine: str) -> None:
    scene = em.Scene(gravity=(0, 0, 0), engine=engine)
    scene.add_body("base", em.Box((0.05,) * 3), mass=0)
    scene.add_body("bob", em.Sphere(0.02), mass=0.5)
    hinge = {"axis": (0, 1, 0), "child_origin": (-0.5, 0, 0), "limits": (-0.3, 0.2)}
    scene.add_joint("j", parent="base", child="bob", **hinge)
    place = end(scene, 480, joints={"j": {"position": 0.6}})["joints"]["j"]["position"]
    assert -0.3 <= place < 0.202


def test_a_question_in_an_engine_that_cannot_do_it_is_refused() -> None:
    scene = em.Scene()
    scene.add_body("hook", em.Sphere(0.01), mass=0)
    scene.add_body("ball", em.Sphere(0.02), mass=1.0, role="object", position=(0, 0, -0.2))
    scene.add_loop("hook", "ball", point_b=(0, 0, 0.2))
    near = em.regions.Ball("ball", (0, 0, -0.2), 0.1)
    asked = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1, "horizon": 1.0}
    problem = em.Problem(scene, scene.pack(), captured=near, **asked)
    with pytest.raises(ValueError, match="'bullet', which has no loops"):
        problem.with_engine("bullet")
