"""What a call with wrong arguments is told: a TypeError that names the argument, in one line."""

import ast
import inspect

import numpy as np
import pytest

import energymargin as em
from energymargin import _core

BALL = em.regions.Ball("object", center=(0, 0, 0.05), radius=0.5)
PUSH = {"force": (1, 1, 0), "torque": (0, 0, 0.1), "duration": 0.5}


@pytest.fixture(scope="module")
def scene():
    scene = em.Scene()
    scene.add_plane("table")
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1, position=(0, 0, 0.05), role="object")
    return scene


@pytest.fixture(scope="module")
def problem(scene):
    return em.Problem(scene, scene.pack(), **PUSH, captured=BALL)


SHAPES = "a Plane, a Box, a Sphere, a Cylinder, a Capsule, a ConvexHull or a Compound"

# Each call gets a scene and a problem of it.
WRONG = {
    "captured is not given, expected a Region, or a dict, each value a Region": lambda s, p: (
        em.Problem(s, p.state, **PUSH)
    ),
    "captured['object'] is 3, expected a Region": lambda s, p: em.Problem(
        s, p.state, **PUSH, captured={"object": 3}
    ),
    "contacts[0] is 1, expected a Contact": lambda s, p: em.Problem(
        s, p.state, **PUSH, captured=BALL, contacts=[1]
    ),
    "Problem is given 3 arguments by position, expected at most 2 (scene, state), and by name "
    "force, torque, duration, captured, succeeded, within, effector, rate, force_weights, "
    "contacts, horizon, plan, check, dwell, start_outside": lambda s, p: em.Problem(
        s, p.state, (1, 1, 0)
    ),
    "problem is Scene(bodies=['table', 'object'], joints=0, dimension=13), expected a Problem": (
        lambda s, p: em.capture_score(s)
    ),
    "node is not an argument of force_score, expected one of problem, weights": lambda s, p: (
        em.force_score(p, node=3)
    ),
    "nodes is None, expected a whole number": lambda s, p: em.escape_effort(p, nodes=None),
    "problem is given twice, by its position and by its name, expected once": lambda s, p: (
        em.capture_score(p, problem=p)
    ),
    "planner is 3, expected a str": lambda s, p: em.escape_effort(p, planner=3),
    "shorten is 'no', expected True or False or None": lambda s, p: em.escape_effort(
        p, shorten="no"
    ),
    "progress is 3, expected a function or None": lambda s, p: em.capture_score(p, progress=3),
    f"shape is 3, expected {SHAPES}": lambda s, p: s.add_body("x", 3, mass=1),
    "limits[1] is None, expected a number": lambda s, p: s.add_joint(
        "x", parent="table", child="object", limits=(0, None)
    ),
    "limits is (1, 2, 3), expected a tuple (a number, a number)": lambda s, p: s.add_joint(
        "x", parent="table", child="object", limits=(1, 2, 3)
    ),
    "size is not given, expected an array of numbers": lambda s, p: em.Box(),
    "Cancel is given 1 argument by position, expected at most 0": lambda s, p: em.Cancel(3),
    "scene is 3, expected a Scene": lambda s, p: BALL.contains(3, p.state),
    "radius is None, expected a number": lambda s, p: em.regions.Ball("object", (0, 0, 0), None),
    "function is 3, expected a function": lambda s, p: em.regions.Predicate(3),
    "a key of drives is 3, expected a str": lambda s, p: em.World(s).simulate(
        p.state, 1, drives={3: np.zeros((1, 6))}
    ),
    "text is 3, expected a str": lambda s, p: em.Problem.from_json(3),
    "path is 3, expected a str or a pathlib.Path": lambda s, p: p.save(3),
    "problems is Problem(": lambda s, p: em.score(p),
    "problems is {1: 2}, expected a list of Problems": lambda s, p: em.score({1: 2}),
}


@pytest.mark.parametrize("words", WRONG)
def test_a_call_with_a_wrong_argument_names_it_and_what_was_expected(words, scene, problem):
    with pytest.raises(TypeError) as error:
        WRONG[words](scene, problem)
    text = str(error.value)
    assert text == words or (words.endswith("(") and text.startswith(words)), text


@pytest.mark.parametrize(
    "score", [em.capture_score, em.escape_effort, lambda p, **k: em.score([p], **k)]
)
def test_a_float_for_a_whole_number_is_told_how_to_write_it(score, problem):
    with pytest.raises(ValueError, match=r"^nodes is 1000\.0, expected a whole number, as 1000$"):
        score(problem, nodes=1e3)


def test_a_type_error_of_the_users_own_function_stays_as_it_is(problem):
    def progress(nodes: int) -> None:
        raise TypeError("capture_score(): mine")

    with pytest.raises(TypeError, match=r"^capture_score\(\): mine$"):
        em.capture_score(problem, nodes=10, progress=progress)


def functions():
    """Every function and method of the compiled module that takes named arguments."""
    for owner in (_core, _core.regions, *filter(inspect.isclass, vars(_core).values())):
        for name, value in vars(owner).items():
            function = getattr(owner, name) if isinstance(value, staticmethod) else value
            first = (getattr(function, "__doc__", None) or "").split("\n")[0]
            if first.startswith(f"{name}(") and not name.startswith("__"):
                yield pytest.param(function, first, id=f"{owner.__name__}.{name}")
        if owner in vars(_core).values() and isinstance(owner, type) and "__init__" in vars(owner):
            first = owner.__init__.__doc__.split("\n")[0]
            if first.startswith("__init__("):
                yield pytest.param(owner, first, id=owner.__name__)


@pytest.mark.parametrize(("function", "signature"), list(functions()))
def test_every_function_names_an_argument_that_it_does_not_have(function, signature):
    (definition,) = ast.parse(f"def {signature}: ...").body
    if definition.args.kwarg is not None:  # Scene.pack, whose keywords are bodies
        return
    method = definition.args.args[:1] and definition.args.args[0].arg == "self"
    owner = None if isinstance(function, type) or not method else object()
    arguments = [] if owner is None else [owner]
    with pytest.raises(TypeError, match=r"^nothing is not an argument of \w+, expected "):
        function(*arguments, nothing=1)


def test_a_region_has_no_truth_so_that_none_is_dropped_by_and_or_or_not():
    for combined in (lambda: BALL and BALL, lambda: BALL or BALL, lambda: not BALL):
        with pytest.raises(TypeError, match=r"combine regions with &, \| and ~"):
            combined()
