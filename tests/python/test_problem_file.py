"""Problem files: Python, the executable and the schema agree on them, to the last bit."""

import copy
import itertools
import json
import subprocess
import sysconfig
from importlib import resources
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import energymargin as em

EXECUTABLE = Path(sysconfig.get_path("scripts")) / "energymargin_score"
SCHEMA = jsonschema.Draft7Validator(em.Problem.schema())
CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def brick(size, center=(0.0, 0.0, 0.0)):
    corners = list(itertools.product((-0.5, 0.5), repeat=3))
    return em.ConvexHull(np.array(corners) * size + center)


def arm(scene):
    """A held rail, a driven hinge, two joints that follow it, and a weld, on a fixed post."""
    scene.add_body("post", em.Box((0.04, 0.04, 0.04)), mass=0, position=(0.0, 0.4, 0.3))
    for name in ("slider", "upper", "lower", "thumb", "tip"):
        scene.add_body(name, em.Capsule(0.01, 0.05), mass=0.1 / 3, role="effector", friction=0.7)
    scene.add_joint("rail", type="prismatic", parent="post", child="slider", axis=(0.6, 0, 0.8),
                    limits=(-0.1, 0.2), held=True, start=0.1 / 3, orientation=(0.6, 0, 0, 0.8),
                    child_orientation=(0, 0.6, 0, 0.8))  # fmt: skip
    scene.add_joint("hinge", type="revolute", parent="slider", child="upper", origin=(0, 0, -0.05),
                    child_origin=(0, 0, 0.05), axis=(1, 0, 0), target=0.1, stiffness=1 / 3,
                    damping=0.01, torque_limit=0.7)  # fmt: skip
    scene.add_joint("follower", type="revolute", parent="upper", child="lower", axis=(1, 0, 0),
                    origin=(0, 0, -0.05), child_origin=(0, 0, 0.05),
                    mimic=em.Mimic("hinge", multiplier=-1 / 3, offset=0.1))  # fmt: skip
    scene.add_joint("echo", type="prismatic", parent="upper", child="thumb", axis=(0, 0, 1),
                    origin=(0.1, 0, 0), mimic=em.Mimic("hinge", multiplier=0.01))  # fmt: skip
    scene.add_joint("weld", type="fixed", parent="lower", child="tip", origin=(0, 0, -0.06))


def regions():
    """One of every type, true at the start."""
    r = em.regions
    return (
        r.Ball("cup", center=(0, 0, 0.03), radius=0.3)
        & r.Box("cup", center=(0, 0, 0), size=(np.inf, 1, np.inf), frame="table")
        & ~r.Disc("dice", center=(0, 0), radius=0.1, frame="cup")
        & r.HalfSpace("dice", normal=(0.6, 0, 0.8), offset=1)
        & r.Speed("dice", limit=1 / 3, point=(0.01, 0, 0))
        & r.Tilt("cup", axis=(0, 0, 1), reference=(0, 0, 1), limit=0.5)
        & (
            r.AnnularSector("cup", center=(0.5, 0), radius=0.5, half_width=0.2,
                            start_angle=2, sweep=2, frame="tip")
            | r.Swept("cup", by="tip", half_width=0.1, behind=0.1, ahead=0.5, least_speed=0.01,
                      disc_radius=2)
        )
    )  # fmt: skip


@pytest.fixture(scope="module")
def problem():
    """Everything that a problem file can hold, in one that can be scored."""
    scene = em.Scene(gravity=(0.01, 0, -9.81))
    scene.add_plane("table", friction=0.5)
    mug = em.Compound(
        [brick((0.06, 0.06, 0.02), (0, 0, 0.01)), brick((0.02, 0.06, 0.06), (0.1 / 3, 0, 0.05))],
        solid=em.mass_properties(em.Cylinder(0.03, 0.06)),
    )
    scene.add_body("cup", mug, mass=0.2, position=(0, 0, 0), friction=0.6, role="object")
    dice = em.Compound([
        em.Part(em.Box((0.03, 0.03, 0.03)), position=(0, 0, 0.02)),
        em.Part(em.Sphere(0.01), position=(0.01, 0, 0.04), orientation=(0, 0, 0.6, 0.8)),
    ])  # fmt: skip
    scene.add_body("dice", dice, mass=0.1, position=(0.2, 0, -0.005), friction=0.4, role="object",
                   inertial=em.Inertial(center=(0, 0, 0.02), inertia=(1e-5, 1.1e-5, 4e-5 / 3)))  # fmt: skip
    scene.add_body("wall", em.Cylinder(0.1, 0.2), mass=0, position=(0.5, 0.5, 0.1))
    scene.add_body("weight", brick((0.02, 0.03, 0.04)), mass=0.05, position=(-0.4, 0, 0.02))
    arm(scene)
    scene.add_spring("weight", "tip", stiffness=0.5, rest_length=0.1, damping=0.01,
                     point_a=(0.01, 0, 0.1 / 3))  # fmt: skip
    scene.disable_collisions("weight", "tip")
    contact = em.Contact(body_a="cup", body_b="tip", position=(0, 0.03, 0.02), normal=(0, 1, 0), distance=-1e-4,
                         normal_force=1 / 3, tangential_force=(0.1, 0, 0), friction=0.42)  # fmt: skip
    near = {
        "cup": em.regions.Ball("cup", center=(0, 0, 0), radius=0.002),
        "dice": em.regions.Ball("dice", center=(0.2, 0, -0.005), radius=0.002),
    }
    return em.Problem(
        scene, scene.pack(cup=dict(velocity=(0, 0.01, 0))), force=(1, 0.5, 1 / 3),
        torque=(0, 0, 0.01), duration=0.1, captured=near, succeeded=regions(),
        within=em.regions.Ball("cup", center=(0, 0, 0), radius=2), rate=1 / 3,
        force_weights=em.ForceWeights(0.1, 1 / 3, 7, 0.01, 0.02), contacts=[contact],
    )  # fmt: skip


def run(*arguments):
    command = [EXECUTABLE, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def scored(*arguments):
    outcome = run(*arguments, "--nodes", 80, "--seed", 7)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads(outcome.stdout)


def fields(score, names):
    return {name: getattr(score, name) for name in names}


CAPTURE = [f"{name}{more}" for name in ("capture", "success", "capture_any", "success_any")
           for more in ("", "_stderr")]  # fmt: skip


@pytest.mark.parametrize("meshes", ["embedded", "files"])
def test_the_executable_has_pythons_numbers_of_each_metric_to_the_last_bit(problem, meshes, tmp_path):
    file = tmp_path / "problem.json"
    problem.save(file, meshes=meshes)
    capture = em.capture_score(problem, nodes=80, seed=7, trees=2)
    assert scored(file, "--trees", 2) == fields(capture, CAPTURE)
    for planner, captured in itertools.product(("est", "rrt"), ("all", "any")):
        effort = em.escape_effort(problem, planner=planner, nodes=80, seed=7, captured=captured)
        printed = scored(file, "--metric", "effort", "--planner", planner, "--captured", captured)
        assert printed["effort"] == (effort.effort if np.isfinite(effort.effort) else None)
        assert [(at["nodes"], at["effort"]) for at in printed["history"]] == effort.history
    assert scored(file, "--metric", "force")["force"] == em.force_score(problem).force


def test_the_effort_that_is_compared_is_one(problem):
    assert np.isfinite(em.escape_effort(problem, nodes=80, seed=7, captured="any").effort)


@pytest.mark.parametrize("meshes", ["embedded", "files"])
def test_the_executable_writes_the_same_bytes_as_python(problem, meshes, tmp_path):
    for folder in ("python", "executable"):
        (tmp_path / folder).mkdir()
    problem.save(tmp_path / "python" / "p.json", meshes=meshes)
    other = "files" if meshes == "embedded" else "embedded"
    problem.save(tmp_path / "from.json", meshes=other)
    assert run(tmp_path / "from.json", "--save", tmp_path / "executable" / "p.json",
               "--meshes", meshes).returncode == 0  # fmt: skip
    written = sorted(path.name for path in (tmp_path / "python").iterdir())
    assert written == ["p.json"] if meshes == "embedded" else ["p-cup.obj", "p.json"]
    assert written == sorted(path.name for path in (tmp_path / "executable").iterdir())
    for name in written:
        own = (tmp_path / "python" / name).read_bytes()
        assert own == (tmp_path / "executable" / name).read_bytes()


def test_a_problem_is_the_same_after_a_file_with_or_without_meshes(problem, tmp_path):
    for meshes in ("embedded", "files"):
        problem.save(tmp_path / f"{meshes}.json", meshes=meshes)
        assert em.Problem.load(tmp_path / f"{meshes}.json").to_json() == problem.to_json()
    assert '"type": "mesh"' in (tmp_path / "files.json").read_text()
    text = (tmp_path / "files.json").read_text()
    assert em.Problem.from_json(text, folder=tmp_path).to_json() == problem.to_json()
    with pytest.raises(ValueError, match="an absolute path, or the folder that it is relative to"):
        em.Problem.from_json(text)
    with pytest.raises(ValueError, match="meshes is 'apart', expected 'embedded' or 'files'"):
        problem.save(tmp_path / "p.json", meshes="apart")


def test_the_schema_is_the_one_that_is_shipped_and_a_valid_one():
    jsonschema.Draft7Validator.check_schema(em.Problem.schema())
    shipped = resources.files("energymargin").joinpath("problem.schema.json").read_text()
    assert json.loads(shipped) == em.Problem.schema()
    assert run("--schema").stdout == shipped


def test_the_schema_says_what_each_value_is():
    def nodes(schema):
        yield schema
        for key in ("properties", "definitions"):
            for part in schema.get(key, {}).values():
                yield from nodes(part)

    definitions = em.Problem.schema()["definitions"]
    for node in nodes(em.Problem.schema()):
        for name, part in node.get("properties", {}).items():
            meant = definitions.get(part.get("$ref", "").rpartition("/")[2], {})
            assert "const" in part or "description" in part | meant, (node["title"], name)


@pytest.mark.parametrize("name", em.tasks.names())
def test_the_problem_of_every_task_fits_the_schema(name):
    task = em.tasks.make(name)
    trajectory = task.rollout(0)
    made = task.problem(trajectory.states[0], params=trajectory.params)
    SCHEMA.validate(json.loads(made.to_json()))


def test_everything_that_a_file_can_hold_fits_the_schema(problem, tmp_path):
    SCHEMA.validate(json.loads(problem.to_json()))
    problem.save(tmp_path / "p.json", meshes="files")
    SCHEMA.validate(json.loads((tmp_path / "p.json").read_text()))


def places(json_value, at=(), kind=""):
    """(path, kind) of each value; two of a kind have the same keys on the way to them."""
    yield at, kind
    if isinstance(json_value, dict):
        for key, value in json_value.items():
            yield from places(value, (*at, key), f"{kind}:{json_value.get('type')}/{key}")
    if isinstance(json_value, list):
        for index, value in enumerate(json_value):
            yield from places(value, (*at, index), f"{kind}[]")


def at_path(json_value, path):
    for key in path:
        json_value = json_value[key]
    return json_value


def spoiled(given):
    """The file, with one value of each kind replaced by one of another type, or a key added."""
    one_of_a_kind = {kind: path for path, kind in places(given)}
    for path in one_of_a_kind.values():
        own = at_path(given, path)
        if isinstance(own, dict):
            changed = copy.deepcopy(given)
            at_path(changed, path)["colour"] = "red"
            yield path, changed
        if path:
            changed = copy.deepcopy(given)
            at_path(changed, path[:-1])[path[-1]] = 7 if isinstance(own, dict | list) else {}
            yield path, changed


def test_the_reader_refuses_what_the_schema_refuses_and_has_the_better_words(problem):
    for path, changed in spoiled(json.loads(problem.to_json())):
        assert not SCHEMA.is_valid(changed), path
        with pytest.raises(ValueError, match=r"expected") as refused:
            em.Problem.from_json(json.dumps(changed))
        assert "does not fit the schema" not in str(refused.value), path


# ---- broken files

BODIES = "one of the bodies 'table', 'cup', 'dice', 'wall', 'weight', 'post', 'slider', 'upper', 'lower', 'thumb', 'tip'"


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
        with_value(("version",), 4),
        "version is 4, expected at most 3; a newer energymargin wrote this file",
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
        "scene.joints[3]: joint 'echo': mimic is of 'follower', expected of a joint that moves, and "
        "follows no other",
    ),
    "missing mesh": (
        with_mesh("cup.obj"),
        MESH + "cup.obj' cannot be opened: No such file or directory",
    ),
    "mesh is a folder": (with_mesh("folder"), MESH + "folder' cannot be opened: Is a directory"),
    "mesh without parts": (
        with_mesh("bare.obj"),
        MESH + "bare.obj': line 1 is \"v 0 0 0\", expected a line \"o name\" before the points of "
        "each convex part",
    ),
    "flat part": (
        with_mesh("flat.obj"),
        MESH + "flat.obj': part \"lid\" of line 6: points is a flat set of points, expected points "
        "that span a volume",
    ),
    "mesh with NaN": (
        with_mesh("nan.obj"),
        MESH + "nan.obj': line 2 is \"v 0 nan 0\", expected three finite numbers after v",
    ),
    "state of another scene": (
        without("state", 0),
        "state is a vector of 42 numbers, expected 43 numbers, 13 for each free body and 2 for each "
        "joint",
    ),
}  # fmt: skip


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
def test_a_broken_file_is_one_precise_error_in_python_and_from_the_executable(problem, folder, name):
    spoil, error = BROKEN[name]
    file = folder / f"{name.replace(' ', '_')}.json"
    text = spoil(problem.to_json())
    file.write_text(text)
    error = error.replace("{folder}", str(folder)).replace("{line}", line_of(text, "NaN"))
    with pytest.raises(ValueError, match="^problem file ") as refused:
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
        em.Problem(problem.scene, problem.state, force=(1, 0, 0), torque=(0, 0, 0), duration=0.1,
                   captured={"cup": em.regions.Disc("cup", center=(0, 0), radius=1)})  # fmt: skip
