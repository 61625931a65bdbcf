"""What a call with wrong arguments is told: a TypeError that names the argument, in one line."""

import ast
import inspect

import pytest

import energymargin as em
from energymargin import _core
from energymargin.evaluate import scores

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
SETS = "a Region, or a dict, each value a Region"

# Each call gets a scene and a problem of it.
WRONG = {
    f"captured is {{'object': 3}}, expected {SETS}": lambda s, p: em.Problem(
        s, p.state, **PUSH, captured={"object": 3}
    ),
    f"succeeded is 3, expected {SETS}": lambda s, p: em.Problem(
        s, p.state, **PUSH, captured=BALL, succeeded=3
    ),
    "contacts is [1], expected a list, each item a Contact": lambda s, p: em.Problem(
        s, p.state, **PUSH, captured=BALL, contacts=[1]
    ),
    "problem is Scene(bodies=['table', 'object'], joints=0, dimension=13), expected a Problem": (
        lambda s, p: em.capture_score(s)
    ),
    "planner is 3, expected a str": lambda s, p: em.escape_effort(p, planner=3),
    "shorten is 'no', expected True or False": lambda s, p: em.escape_effort(p, shorten="no"),
    "cancel is 3, expected a Cancel": lambda s, p: em.capture_score(p, cancel=3),
    "weights is 3, expected a ForceWeights": lambda s, p: em.force_score(p, weights=3),
    f"shape is 3, expected {SHAPES}": lambda s, p: s.add_body("x", 3, mass=1),
    f"shape is None, expected {SHAPES}": lambda s, p: em.mass_properties(None),
    "limits is (1, 2, 3), expected a tuple (a number, a number)": lambda s, p: s.add_joint(
        "x", parent="table", child="object", limits=(1, 2, 3)
    ),
    "scene is 3, expected a Scene": lambda s, p: em.World(3),
    "plan is 3, expected a Plan": lambda s, p: em.World(s, 3),
    "function is 3, expected a function": lambda s, p: em.regions.Predicate(3),
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
    way = words.endswith("(") or text.startswith(f"{words}: em.")
    assert text == words or (way and text.startswith(words)), text


NO_NUMBER = {
    "nodes is None, expected a whole number of at least 1": lambda s, p: em.escape_effort(
        p, nodes=None
    ),
    "limits[1] is None, expected a real number": lambda s, p: s.add_joint(
        "x", parent="table", child="object", limits=(0, None)
    ),
    "radius is None, expected a real number": lambda s, p: em.regions.Ball(
        "object", (0, 0, 0), None
    ),
    "size is None, expected an array of real numbers": lambda s, p: em.Box(None),
}


@pytest.mark.parametrize("words", NO_NUMBER)
def test_none_in_the_place_of_a_number_is_refused_by_the_name_of_the_argument(
    words, scene, problem
):
    with pytest.raises(ValueError) as error:
        NO_NUMBER[words](scene, problem)
    assert str(error.value) == words


NAMES = {
    "unexpected keyword argument 'node'": lambda s, p: em.force_score(p, node=3),
    r"^capture_probability\(\) .* 'rollout'; did you mean 'rollouts'\?$": (
        lambda s, p: em.capture_probability(p, rollout=30)
    ),
    r"^escape_effort\(\) takes problem, and by name planner, .*: too many": (
        lambda s, p: em.escape_effort(p, 30)
    ),
    r"^rank\(\) takes problems, plans: .* 'metrics'; did you mean 'metric'\?$": (
        lambda s, p: em.rank([p, p], metrics="effort")
    ),
    r"^ParallelGripper\(\) takes opening, .* 'widht'": (
        lambda s, p: em.grasps.ParallelGripper(widht=0.1)
    ),
    r"^simulate\(\) lacks steps: it needs state, steps$": (
        lambda s, p: em.World(s).simulate(p.state)
    ),
    r"^hold\(\) lacks duration: it needs scene, state, duration$": lambda s, p: em.Plan.hold(s, 1),
    r"^plan is \[\], expected a Plan: em\.Plan\(1 / 240, velocities=": (
        lambda s, p: p.replace(plan=[])
    ),
    "multiple values for argument 'problem'": lambda s, p: em.capture_score(p, problem=p),
    "missing 1 required positional argument: 'problem'": lambda s, p: em.escape_effort(),
    # Classes say which are missing, or which there are.
    r"Problem\(\) lacks captured: it needs scene, .*, duration": lambda s, p: em.Problem(
        s, p.state, **PUSH
    ),
    r"Box\(\) takes size: too many positional arguments": lambda s, p: em.Box(1, 2),
    r"Box\(\) takes size: got an unexpected .* 'sizes'": lambda s, p: em.Box(sizes=(1, 1, 1)),
}


@pytest.mark.parametrize("words", NAMES)
def test_a_call_with_a_wrong_name_shows_it_or_the_names_that_there_are(words, scene, problem):
    with pytest.raises(TypeError, match=f"(?s){words}"):
        NAMES[words](scene, problem)


SCORES = [name for name in scores.__all__ if callable(getattr(_core, name))]
HELPERS = ["mass_properties", "stream"]


@pytest.mark.parametrize("name", sorted({*SCORES} - {*HELPERS}))
def test_the_core_reads_every_keyword_of_a_score_and_no_other(name, problem):
    keywords = {
        name: parameter.default
        for name, parameter in inspect.signature(getattr(em, name)).parameters.items()
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY
    }
    if "threads" in keywords:
        keywords["threads"] = 1
    if "plan" in keywords:  # Python makes them a part of the problem, and a model
        del keywords["plan"]
        keywords["disturbance"] = em.disturbances.Uniform()
    with pytest.raises(TypeError, match=r"^unexpected keyword arguments \['other'\]$"):
        getattr(_core, name)(problem, **keywords, other=1)


@pytest.mark.parametrize("name", HELPERS)
def test_a_function_has_the_names_and_the_defaults_of_the_core(name):
    asked = inspect.signature(getattr(em, name))
    first = getattr(_core, name).__doc__.split("\n")[0]
    (core,) = ast.parse(f"def {first}: ...").body
    by_name = zip(core.args.kwonlyargs, core.args.kw_defaults, strict=True)
    names = [argument.arg for argument in (*core.args.args, *core.args.kwonlyargs)]
    assert list(asked.parameters) == names
    for argument, default in by_name:
        if argument.arg == "threads":  # None, which takes all cores
            continue
        shown = repr(asked.parameters[argument.arg].default)
        assert ast.unparse(default) in (shown, "...")


@pytest.mark.parametrize(
    "score", [em.capture_score, em.escape_effort, lambda p, **k: em.score([p], **k)]
)
def test_a_float_for_a_whole_number_is_told_how_to_write_it(score, problem):
    with pytest.raises(ValueError, match=r"^nodes is 1000\.0, expected a whole number, as 1000$"):
        score(problem, nodes=1e3)


@pytest.mark.parametrize(
    ("score", "count"), [(em.escape_effort, "nodes"), (em.rank, "rollouts"), (em.score, "threads")]
)
def test_a_truth_and_a_huge_number_are_no_counts_at_any_door(score, count, problem):
    asked = problem.replace(horizon=0.1)
    problems = {em.rank: {"a": asked}, em.score: [asked]}.get(score, asked)
    with pytest.raises(ValueError, match=f"^{count} is True, expected a whole number "):
        score(problems, **{count: True})
    with pytest.raises(
        ValueError, match=f"^{count} is 10{{30}}, .* whole number from 1 to 21474836"
    ):
        score(problems, **{count: 10**30})


@pytest.mark.parametrize("mass", [float("nan"), float("inf"), -1.0])
def test_mass_properties_are_of_a_mass_that_can_be(mass):
    with pytest.raises(ValueError, match=f"^mass is {mass:g}, expected a finite number of at le"):
        em.mass_properties(em.Sphere(0.1), mass)


@pytest.mark.parametrize("kind", [em.Scene, em.Problem, em.Box, em.Feedback, em.Cancel, em.World])
def test_an_object_that_was_never_made_is_refused_by_what_asks_it(kind):
    with pytest.raises(TypeError, match=r"made by __new__ alone holds nothing: call its class"):
        repr(kind.__new__(kind))


def test_a_type_error_of_the_users_own_function_stays_as_it_is(problem):
    def progress(nodes: int, total: int) -> None:
        raise TypeError("capture_score(): mine")

    with pytest.raises(TypeError, match=r"^capture_score\(\): mine$"):
        em.capture_score(problem, nodes=10, progress=progress)


def test_a_region_has_no_truth_so_that_none_is_dropped_by_and_or_or_not():
    for combined in (lambda: BALL and BALL, lambda: BALL or BALL, lambda: not BALL):
        with pytest.raises(TypeError, match=r"combine regions with &, \| and ~"):
            combined()
