"""Broken problem files: each is one precise error, in Python and from the executable."""

import json

import pytest
from problem_files import at_path, full_problem, planned_problem, run

import energymargin as em

CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


@pytest.fixture(scope="module")
def problem():
    return full_problem()


NAMES = (
    "table",
    "cup",
    "dice",
    "wall",
    "weight",
    "post",
    "slider",
    "upper",
    "lower",
    "thumb",
    "tip",
)
BODIES = "one of the bodies " + ", ".join(f"'{name}'" for name in NAMES)


def replaced(old, new):
    return lambda text: text.replace(old, new, 1)


def with_value(path, value):
    def change(text):
        changed = json.loads(text)
        at_path(changed, path[:-1])[path[-1]] = value
        return json.dumps(changed)

    return change


def without(*path):
    def change(text):
        changed = json.loads(text)
        del at_path(changed, path[:-1])[path[-1]]
        return json.dumps(changed)

    return change


def with_mesh(file):
    return with_value(("scene", "bodies", 1, "shape"), {"type": "mesh", "file": file})


CUP = ("scene", "bodies", 1)
JOINT = ("scene", "joints")
MESH = "scene.bodies[1].shape.file: mesh file '{folder}/"
BROKEN = {
    "empty": (lambda text: "", "it is empty, expected the JSON of a problem"),
    "not JSON": (
        lambda text: "<robot name='x'>",
        "not valid JSON at line 1, column 1: '<robot name='x'>'",
    ),
    "cut off": (
        lambda text: text[: text.index('"solid"')],
        "cut off at the end of line {line}, near scene.bodies[1].shape.parts",
    ),
    "NaN": (
        replaced('"duration": 0.1', '"duration": NaN'),
        "not valid JSON at line {line}, column 14, near duration: '\"duration\": NaN,'",
    ),
    "beyond all bounds": (
        replaced("-9.81", "1e999"),
        "scene.gravity[2] is 1e999, expected a number of at most 1.8e308 in size",
    ),
    "key twice": (
        replaced('"mass": 0.2', '"mass": 0.2, "mass": 0.3'),
        "scene.bodies[1].mass is given twice, expected once",
    ),
    "depth bomb": (
        lambda text: '{"captured": ' + "[" * 100_000,
        "captured[0][0][0][0][0][0][0][0][0][0][0][0][0][0][0][0][... has more than 256 levels of "
        "lists and objects",
    ),
    "region bomb": (
        with_value(("captured",), eval("{'type': 'not', 'of': [" * 65 + "1" + "]}" * 65)),
        "captured" + ".of[0]" * 65 + ' is 1, expected at most 64 levels of "and", "or", "not"',
    ),
    "a list": (lambda text: "[1, 2]", "problem is [1,2], expected an object { }"),
    "other format": (
        with_value(("format",), "urdf"),
        'it has no "format": "energymargin-problem", so it is no problem file',
    ),
    "newer version": (
        with_value(("version",), 7),
        "version is 7, expected at most 6; a newer energymargin wrote this file",
    ),
    "unknown key": (
        with_value((*CUP, "shape", "parts", 0, "posiiton"), 1),
        'scene.bodies[1].shape.parts[0] has an unknown "posiiton", expected only shape, position, '
        "orientation",
    ),
    "missing key": (without(*CUP, "mass"), 'scene.bodies[1] has no "mass", expected one'),
    "wrong type": (
        with_value((*CUP, "mass"), "1 kg"),
        'scene.bodies[1].mass is "1 kg", expected a number',
    ),
    "negative mass": (
        with_value((*CUP, "mass"), -1),
        "scene.bodies[1]: body 'cup': mass is -1, expected a finite number of at least 0",
    ),
    "non-unit quaternion": (
        with_value((*CUP, "orientation", 3), 0.9),
        "scene.bodies[1]: body 'cup': orientation is (0, 0, 0, 0.9), expected a unit quaternion "
        "(x, y, z, w)",
    ),
    "inertia that cannot be": (
        with_value(("scene", "bodies", 2, "inertial", "moments"), [1, 1, 3]),
        "scene.bodies[2]: body 'dice': inertial: moments is (1, 1, 3), expected three numbers "
        "above 0 of which none is greater than the sum of the others",
    ),
    "unknown body in a region": (
        with_value(("captured", "of", 1, "body"), "mug"),
        'captured.of[1].body is "mug", expected ' + BODIES,
    ),
    "captured by object": (
        with_value(("captured",), {"cup": {"type": "disc"}}),
        'captured has no "type", expected one',
    ),
    "mimic of a mimic": (
        with_value((*JOINT, 3, "mimic", "joint"), "follower"),
        "scene.joints[3]: joint 'echo': mimic is of 'follower', expected of a joint that moves, "
        "and follows no other",
    ),
    "missing mesh": (
        with_mesh("cup.obj"),
        MESH + "cup.obj' cannot be opened: No such file or directory",
    ),
    "mesh is a folder": (with_mesh("folder"), MESH + "folder' cannot be opened: Is a directory"),
    "mesh without parts": (
        with_mesh("bare.obj"),
        MESH + 'bare.obj\': line 1 is "v 0 0 0", expected a line "o name" before the points of '
        "each convex part",
    ),
    "flat part": (
        with_mesh("flat.obj"),
        MESH + 'flat.obj\': part "lid" of line 6: points is a flat set of points, expected points '
        "that span a volume",
    ),
    "mesh with NaN": (
        with_mesh("nan.obj"),
        MESH + 'nan.obj\': line 2 is "v 0 nan 0", expected three finite numbers after v',
    ),
    "state of another scene": (
        without("state", 0),
        "state is a vector of 42 numbers, expected 43 numbers, 13 for each free body and 2 for "
        "each joint",
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("broken")
    (made / "folder").mkdir()
    (made / "bare.obj").write_text(CORNER)
    (made / "flat.obj").write_text(f"o cup\n{CORNER}o lid\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n")
    (made / "nan.obj").write_text("o cup\nv 0 nan 0\n")
    return made


def line_of(text, word):
    """Of the word or, if there is none, the last one."""
    return str(text[: text.find(word)].count("\n") + 1)


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_one_precise_error_in_python_and_from_the_executable(
    problem, folder, name
):
    spoil, error = BROKEN[name]
    file = folder / f"{name.replace(' ', '_')}.json"
    text = spoil(problem.to_json())
    file.write_text(text)
    error = error.replace("{folder}", str(folder)).replace("{line}", line_of(text, "NaN"))
    with pytest.raises(ValueError, match=r"^problem file ") as refused:
        em.Problem.load(file)
    assert str(refused.value) == f"problem file '{file}': {error}"
    outcome = run(file)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"error: {refused.value}\n"


PLAN = ("plan",)
BROKEN_PLAN = {
    "older version": (
        with_value(("version",), 3),
        'scene has "friction_rule", expected only from "version": 5 on; this file says 3',
    ),
    "part of a step": (
        with_value(("horizon",), 0.001),
        "horizon is 0.001, expected whole steps of the scene, of 0.00416667 s, at most 1000000",
    ),
    "unknown key": (
        with_value((*PLAN, "wrench"), []),
        'plan has an unknown "wrench", expected only step, wrenches, targets, velocities, '
        "feedback, policy",
    ),
    "no rows": (
        without(*PLAN, "velocities", 1, "rows"),
        'plan.velocities[1] has no "rows", expected one',
    ),
    "rows of unequal number": (
        with_value((*PLAN, "targets", 0, "rows"), [0.1, 0.2]),
        "plan: targets['hinge'] is 2 rows, expected 9 rows, as the others of the plan",
    ),
    "row of another length": (
        with_value((*PLAN, "wrenches", 0, "rows"), [[1, 2, 3]]),
        "plan.wrenches[0].rows[0] is [1,2,3], expected a list of 6 numbers",
    ),
    "not finite": (
        with_value((*PLAN, "targets", 0, "rows"), "AAAAAAAA+H8="),
        'plan.targets[0].rows is "AAAAAAAA+H8=", expected finite numbers, also in row 0',
    ),
    "no base64": (
        with_value((*PLAN, "targets", 0, "rows"), "0.1 0.2"),
        'plan.targets[0].rows is "0.1 0.2", expected only digits of base64',
    ),
    "cut off": (
        with_value((*PLAN, "wrenches", 0, "rows"), "AAAAAAAA8D8="),
        'plan.wrenches[0].rows is "AAAAAAAA8D8=", expected rows of 6 numbers, 48 bytes each, and '
        "at least one; these are 8 bytes",
    ),
    "fixed body": (
        with_value((*PLAN, "wrenches", 0, "body"), "wall"),
        "plan: wrenches['wall'] is on a fixed body, expected a body that can move",
    ),
    "unknown joint": (
        with_value((*PLAN, "targets", 0, "joint"), "hip"),
        "plan.targets[0].joint is \"hip\", expected one of the joints 'rail', 'hinge', 'follower', "
        "'echo', 'weld'",
    ),
    "shorter than the horizon": (
        with_value(("horizon",), 0.2),
        "plan is 0.075 s, expected at least as long as the horizon, 0.2 s",
    ),
}


@pytest.mark.parametrize("name", BROKEN_PLAN)
def test_a_broken_plan_is_one_precise_error_in_python_and_from_the_executable(folder, name):
    spoil, error = BROKEN_PLAN[name]
    file = folder / "plan.json"
    file.write_text(spoil(planned_problem().to_json()))
    with pytest.raises(ValueError, match=r"^problem file ") as refused:
        em.Problem.load(file)
    assert str(refused.value) == f"problem file '{file}': {error}"
    outcome = run(file)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"error: {refused.value}\n"


def test_a_file_that_cannot_be_opened_is_an_oserror_that_names_it(folder):
    for file, reason in (("none.json", "No such file"), ("folder", "Is a directory")):
        with pytest.raises(OSError, match=f"problem file '.*/{file}' cannot be opened: {reason}"):
            em.Problem.load(folder / file)


def test_captured_for_one_of_two_objects_is_refused_with_the_others_name(problem):
    with pytest.raises(ValueError, match="captured has no 'dice', expected every object"):
        em.Problem(
            problem.scene,
            problem.state,
            force=(1, 0, 0),
            torque=(0, 0, 0),
            duration=0.1,
            captured={"cup": em.regions.Disc("cup", center=(0, 0), radius=1)},
        )
