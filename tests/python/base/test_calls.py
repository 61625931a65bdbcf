"""What a call of a compiled class or function lacks is said by its name."""

import pickle
import pydoc

import pytest

import energymargin as em
from energymargin.base.calls import signature_of


def scene():
    made = em.Scene()
    made.add_body("box", em.Sphere(0.1), mass=1, role="object")
    return made


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: em.Problem(scene()), r"^Problem\(\) lacks state, captured, force, torque, dur"),
        (
            lambda: em.Problem(
                scene(), scene().pack(), captured=em.regions.Ball("box", (0, 0, 0), 1)
            ),
            r"^Problem\(\) lacks force, torque, duration: it needs scene, state, captured, force",
        ),
        (em.Box, r"^Box\(\) lacks size: it needs size$"),
        (
            lambda: em.Box((1, 1, 1), depth=3),
            r"^Box\(\) takes size: got an unexpected keyword argument 'depth'",
        ),
        (lambda: em.Box((1, 1, 1), 2), r"^Box\(\) takes size: too many positional arguments"),
        (lambda: scene().add_body("cup"), r"^add_body\(\) lacks shape: it needs name, shape"),
        (lambda: em.regions.Ball("box"), r"^Ball\(\) lacks center, radius: it needs body, center"),
        (em.Plan, r"^Plan\(\) lacks step"),
        (em.World, r"^World\(\) lacks scene"),
    ],
)
def test_what_a_call_lacks_or_has_too_much_is_named(call, says):
    with pytest.raises(TypeError, match=says):
        call()


def test_a_bad_value_is_still_told_by_its_own_error():
    with pytest.raises(ValueError, match="size is"):
        em.Box((1, 1, -1))


@pytest.mark.parametrize("kind", [em.Problem, em.Plan, em.Box, em.Surface])
def test_help_of_a_constructor_says_what_each_argument_is(kind):
    text = pydoc.render_doc(kind.__init__, renderer=pydoc.plaintext)
    names = [name for name in signature_of(kind.__init__.__doc__).parameters if name != "self"]
    assert names and [name for name in names if f"{name}: " not in text.partition(" -> ")[2]] == []


@pytest.mark.parametrize(
    "name", [n for n in em.regions.__all__ if n not in ("Region", "Predicate")]
)
def test_help_of_a_region_says_what_each_argument_is(name):
    doc = getattr(em.regions, name).__doc__
    own = set(signature_of(doc).parameters) - {"frame"}  # which the module explains
    assert [one for one in own if f"\n{one}: " not in doc] == []
    assert "frame" in em.regions.__doc__


def test_a_problem_is_pickled_as_before():
    ball = em.regions.Ball("box", (0, 0, 0), 1)
    bounds = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1}
    problem = em.Problem(scene(), scene().pack(), captured=ball, **bounds)
    assert pickle.loads(pickle.dumps(problem)).to_json() == problem.to_json()


def test_a_scene_without_a_robot_has_nothing_to_hold_and_needs_no_plan():
    scene = em.Scene()
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=1, role="object")
    with pytest.raises(ValueError, match=r"robot can hold: .* horizon=0\.5 and no plan"):
        em.Plan.hold(scene, scene.pack(), 0.5)
