"""What is legal and looks wrong is a warning, once for a scene; what is right is silent."""

import ast
import json
import math
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
from command_line import run_here
from made_tasks import MADE

import energymargin as em
from energymargin.base.plausibility import kept_warnings, warn

ROOT = Path(__file__).parents[3]
UPRIGHT, W_FIRST = (0, 0, 0, 1), (1, 0, 0, 0)
names = (f"cup {number}" for number in range(10**6))  # each test has a scene of its own


def problem(
    *, duration=0.2, radius=0.05, center=(0, 0), height=0.02, start=None, push=0.5, **changed
):
    """A small box on a table, changed."""
    name = next(names)
    scene = em.Scene(step=changed.pop("step", 1 / 240))
    scene.add_plane("table")
    for other, keywords in changed.pop("others", {}).items():
        scene.add_body(other, **keywords)
    body = {"shape": em.Box((0.1, 0.06, 0.04)), "mass": 0.2, "position": (0, 0, height)} | changed
    if "density" in body:
        del body["mass"]
    scene.add_body(name, role="object", **body)
    state = scene.pack(**({name: start} if start else {}))
    return em.Problem(
        scene,
        state,
        force=(push, push, 0),
        torque=(0, 0, 0.02 * push),
        duration=duration,
        captured=em.regions.Disc(name, center=center, radius=radius),
    )


def fixed(size, position):
    return {"shape": em.Box(size), "mass": 0, "position": position}


def untouchable():
    scene = em.Scene()
    inertial = em.Inertial(inertia=(1e-3,) * 3)
    scene.add_body(next(names), em.Compound([]), mass=1, inertial=inertial, role="effector")
    return em.World(scene)


def jointed(**limits):
    scene = em.Scene()
    scene.add_body("base", em.Box((0.1, 0.1, 0.1)), mass=0)
    scene.add_body("arm", em.Box((0.1, 0.1, 0.1)), mass=1)
    scene.add_joint(next(names), parent="base", child="arm", **limits)
    return em.World(scene)


def tetrahedron(tmp_path, size):
    corners = size * np.vstack([np.zeros(3), np.eye(3)])
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    faces = ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    path = tmp_path / f"{next(names)}.obj"
    path.write_text("\n".join(lines + faces))
    return path


# What its value and reason are, and how it comes to be.
WARNED = {
    r"yaw is 90 rad, beyond a full turn: .* math.radians\(90\)": lambda: problem(yaw=90.0),
    r"cup \d+: yaw is -45 rad, beyond a full turn": lambda: problem(start={"yaw": -45}),
    r"start_angle is 30 rad, beyond a full turn": lambda: em.regions.AnnularSector(
        "cup", (0, 0), radius=1, half_width=0.1, start_angle=30, sweep=1
    ),
    r"joint 'cup \d+': upper limit is 90 rad, .* in degrees": lambda: jointed(limits=(0, 90)),
    r"joint 'cup \d+': target is 30 rad, .* in degrees": lambda: jointed(target=30),
    r"body 'floor': its least extent is 40 m, .*0\.04 m that moves.*millimetres": lambda: problem(
        others={"floor": fixed((100, 60, 40), (0, 0, -30))}
    ),
    r"body 'cup \d+': its least extent is 40 m": lambda: problem(
        shape=em.Box((100, 60, 40)), height=20, mass=1e8
    ),
    r"mass is 200 kg, which makes 833333 kg/m\^3, .* in grams": lambda: problem(mass=200),
    r"mass is 2e-06 kg, which makes .*, lighter than air": lambda: problem(mass=2e-6, push=1e-5),
    r"density is 1 kg/m\^3, .* g/cm\^3\? Then write 1000": lambda: problem(density=1),
    r"duration is 200 s, .* milliseconds": lambda: problem(duration=200),
    r"horizon is 90 s, .* milliseconds": lambda: problem().replace(horizon=90.0),
    r"the plan's step is 4 s, .* milliseconds": lambda: planned(4.0),
    r"force is \(0, 2000, 0\) N, more than 1000 times .* 1\.962 N.* millinewtons": lambda: (
        problem().replace(force=(0, 2000, 0))
    ),
    r"captured is a set of 50 m .*, more than 10 times .* centimetres": lambda: problem(radius=50),
    r"body 'cup \d+': orientation is \(1, 0, 0, 0\), a half turn about x": lambda: problem(
        orientation=W_FIRST
    ),
    r"state: body 'cup \d+': orientation is \(1, 0, 0, 0\)": lambda: problem(
        start={"orientation": W_FIRST}
    ),
    r"nearest body, 'table', is 0\.05 m, .* falls": lambda: problem(height=0.07),
    r"'cup \d+' at \(0, 0, 0\.02\) is outside of captured, .*start_outside=True": lambda: problem(
        center=(0.3, 0)
    ),
    r"ratio of masses of 'block' and 'cup \d+' is 2000 kg to 0\.2 kg": lambda: problem(
        others={"block": {"shape": em.Box((1, 1, 1)), "mass": 2000, "position": (2, 0, 0.5)}}
    ),
    r"step is 0\.2 s, in which a body falls 0\.3924 m": lambda: problem(step=0.2),
    r"gap of loop 'hook' - 'cup \d+' is 0\.02 m, .*a fifth in each": lambda: hung(gap=0.02),
    r"gap of loop 'hook' - 'cup \d+' is [0-9.]+ m and 0\.03 rad": lambda: hung(
        tilt=0.03, gap=0, kind="weld"
    ),
    r"gap of loop 'hook' - 'cup \d+' is 0\.005 m and 0 rad, .*contradicts": lambda: hung(
        kind="weld", weld=0.005
    ),
    r"body 'cup \d+': torsional_friction is 0\.1 m, longer .* 0\.06164": lambda: twisted(
        torsional_friction=0.1
    ),
    r"body 'cup \d+': rolling_friction is 0\.07 m": lambda: twisted(rolling_friction=0.07),
    r"body 'table': torsional_friction is 0\.1 m": lambda: twisted(of_table=0.1),
    r"bodies 'table' and 'cup \d+': rolling_friction is 0\.1 m": lambda: twisted((0.01, 0.1)),
    r"ratio of masses of 'cup \d+' and 'foot' is 1\.2 kg to 0\.001 kg, .*contacts": lambda: (
        on_a_foot(1e-3)
    ),
    "the scene's collision shapes is none, so that no body touches": untouchable,
    r"overlap of 'table' and 'cup \d+' at the start is 0\.03 m, more than 0\.02 m": lambda: (
        simulated(height=-0.01)
    ),
}


def planned(step):
    """A tool that goes along a plan of two rows."""
    tool = {"shape": em.Sphere(0.02), "mass": 0.1, "position": (0, 0.2, 0.02), "role": "effector"}
    asked = problem(others={"tool": tool})
    return asked.replace(plan=em.Plan(step, wrenches={"tool": np.zeros((2, 6))}))


def on_a_foot(mass, shape=None):
    """A cup on a foot of that mass, which a joint turns."""
    scene, name = em.Scene(), next(names)
    scene.add_plane("floor")
    inertial = em.Inertial(inertia=(1e-7,) * 3)
    scene.add_body(name, em.Box((0.06,) * 3), mass=1.2, position=(0, 0, 0.08), role="object")
    scene.add_body("foot", shape or em.Box((0.05, 0.05, 0.02)), mass=mass, inertial=inertial)
    scene.add_joint("ankle", parent=name, child="foot", origin=(0, 0, -0.04))
    return em.World(scene)


def hung(gap=0.0, tilt=0.0, weld=0.0, kind="point"):
    """A bag that a loop hangs by `gap` beside a hook, and welds to another one if that is off."""
    scene, name = em.Scene(), next(names)
    scene.add_body("hook", em.Box((0.02,) * 3), mass=0, position=(0, 0, 0.15))
    turn = (math.sin(tilt / 2), 0, 0, math.cos(tilt / 2))
    scene.add_body(name, em.Box((0.1, 0.1, 0.2)), mass=0.5, orientation=turn, role="object")
    scene.add_loop("hook", name, type=kind, point_a=(gap, 0, 0), point_b=(0, 0, 0.15))
    if weld:
        scene.add_loop("hook", name, type="weld", point_a=(weld, 0, 0), point_b=(0, 0, 0.15))
    stays = em.regions.Ball(name, center=(0, 0, 0), radius=0.05)
    pull = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    return em.Problem(scene, scene.pack(), captured=stays, **pull)


def twisted(frictions=(0.0, 0.0), of_table=0.0, **surface):
    """A box on a table with torsional or rolling friction of its own, of the table or the pair."""
    scene, name = em.Scene(), next(names)
    scene.add_plane("table", surface=em.Surface(torsional_friction=of_table))
    box = {"mass": 0.2, "position": (0, 0, 0.02), "surface": em.Surface(**surface)}
    scene.add_body(name, em.Box((0.1, 0.06, 0.04)), **box)
    torsional, rolling = frictions
    turns = {"torsional_friction": torsional, "rolling_friction": rolling}
    scene.set_friction(name, "table", 0.5, **(turns if any(frictions) else {}))
    return em.World(scene)


def simulated(height):
    asked = problem()
    (name,) = (body.name for body in asked.scene.bodies if body.role == "object")
    state = asked.scene.pack(**{name: {"position": (0, 0, height)}})
    return em.World(asked.scene).simulate(state, steps=2)


@pytest.mark.parametrize("words", WARNED)
def test_what_looks_wrong_warns_with_its_value_and_how_to_say_that_it_is_meant(words):
    with pytest.warns(em.PlausibilityWarning, match=words) as caught:
        WARNED[words]()
    (warning,) = caught
    assert 'filterwarnings("ignore", category=em.PlausibilityWarning)' in str(warning.message)
    assert "\n" not in str(warning.message)
    assert warning.filename == __file__


@pytest.mark.parametrize(
    "host", ["gymnasium.wrappers", "cyclopts.bind", "energymargin_paper.evidence.act"]
)
def test_a_warning_points_behind_what_calls_the_package_for_the_user(host):
    between = {"__name__": host}
    exec("def call(function, *arguments): function(*arguments)", between)
    with pytest.warns(em.PlausibilityWarning) as caught:
        between["call"](warn, [("a", "looks wrong")], next(names))
    assert caught[0].filename == __file__


def test_a_command_s_warning_is_a_line_without_a_place_in_the_code(tmp_path):
    written = json.loads(problem().to_json()) | {"duration": 200.0}
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_text(json.dumps(written))
    done = run_here("rank", "a.json", "b.json", cwd=tmp_path)
    warned = [line for line in done.stderr.splitlines() if "warning" in line.lower()]
    assert len(warned) == 1 and warned[0].startswith("warning: duration is 200 s")
    assert ".py" not in done.stderr and "filterwarnings" not in done.stderr


def test_a_mesh_that_is_a_building_names_its_scale(tmp_path):
    with pytest.warns(em.PlausibilityWarning, match=r"scale is 1000, which makes .* 100 m long"):
        em.mesh(tetrahedron(tmp_path, 0.1), scale=1000)


RIGHT = {
    "a box on a table": problem,
    "a turn of 2 pi": lambda: problem(yaw=2 * math.pi),
    "a half turn about x that is written as one": lambda: problem(orientation=(-1, 0, 0, 0)),
    "a quarter turn about x": lambda: problem(
        height=0.03, orientation=(math.sqrt(0.5), 0, 0, math.sqrt(0.5))
    ),
    "a box that falls": lambda: problem(height=0.07, velocity=(0, 0, -0.5)),
    "a box that is held by a force": lambda: problem(height=0.07, force=(0, 0, 0.2 * 9.81)),
    "a box that cannot fall": lambda: problem(height=0.07, linear_factor=(1, 1, 0)),
    "a large thin floor": lambda: problem(
        others={"floor": fixed((100, 60, 0.1), (0, 0, -0.05))}, height=0.021
    ),
    "lead": lambda: problem(density=11_340),
    "foam": lambda: problem(density=20),
    "a light fingertip with the mass of an arm": lambda: problem(
        others={
            "tip": {
                "shape": em.Sphere(0.01),
                "mass": 3,
                "role": "effector",
                "position": (1, 0, 0.01),
            }
        }
    ),
    "a joint that turns twice either way": lambda: jointed(limits=(-4 * math.pi, 4 * math.pi)),
    "a joint without limits": jointed,
    "a bag that hangs at a hook": hung,
    "a loop that a simulation left open by half a millimetre": lambda: hung(gap=5e-4),
    "rubber": lambda: twisted((0.01, 0.001), torsional_friction=0.02),
    "a long rail": lambda: jointed(type="prismatic", limits=(0, 30)),
    "a foot that is light enough": lambda: on_a_foot(2e-3),
    "a link of a chain of coordinates that touches nothing": lambda: on_a_foot(
        1e-6, shape=em.Compound([])
    ),
    "a start that overlaps a little": lambda: simulated(height=0.01),
}


@pytest.mark.parametrize("name", RIGHT)
def test_what_is_right_does_not_warn(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        RIGHT[name]()


def test_a_start_outside_that_is_meant_does_not_warn(tmp_path):
    with pytest.warns(em.PlausibilityWarning, match="outside of captured"):
        outside = problem(center=(0.3, 0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        em.Problem(
            outside.scene,
            outside.state,
            force=(1, 0, 0),
            torque=(0, 0, 0),
            duration=0.2,
            captured=outside.captured,
            start_outside=True,
        )


def test_many_states_of_one_scene_warn_once_and_scoring_them_does_not():
    with pytest.warns(em.PlausibilityWarning) as caught:
        first = problem(mass=200)
        states = [first.state + np.eye(13)[0] * 1e-4 * i for i in range(20)]
        problems = [
            em.Problem(
                first.scene,
                state,
                force=(1, 0, 0),
                torque=(0, 0, 0),
                duration=0.1,
                captured=first.captured,
            )
            for state in states
        ]
        em.score(problems, ["capture"], nodes=5, threads=2)
    assert len(caught) == 1


def test_a_filter_that_makes_it_an_error_raises_each_time():
    with warnings.catch_warnings():
        warnings.simplefilter("error", em.PlausibilityWarning)
        for _ in range(2):
            with pytest.raises(em.PlausibilityWarning, match=r"yaw is 1234\.5 rad"):
                problem(yaw=1234.5)


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("yaw is 1e[+]06, expected at most 10000 rad", lambda: problem(yaw=1e6)),
        ("limits is 1e[+]06, expected angles of at most 10000", lambda: jointed(limits=(0, 1e6))),
        (
            r"orientation is 1\.57, expected a unit quaternion .* yaw=, an angle about z",
            lambda: problem(orientation=1.57),
        ),
        ("step is 2, expected at most 1 s", lambda: em.Scene(step=2)),
        ("extent is 2e[+]06 m, expected at most", lambda: problem(shape=em.Sphere(1e6))),
    ],
)
def test_what_cannot_be_meant_is_an_error(words, make):
    with pytest.raises(ValueError, match=words):
        make()


def test_golden_problems_tasks_and_robots_of_the_repository_do_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error", em.PlausibilityWarning)
        for path in (ROOT / "tests/golden").glob("problem-*.json"):
            em.Problem.load(path)
        for name in MADE:
            task = em.tasks.make(name)
            if type(task).__module__.startswith(("energymargin.", "energymargin_paper.")):
                trajectory = task.rollout(0)
                for state in trajectory.states:
                    task.problem(state, trajectory.params)
        for path in (ROOT / "data").glob("*.urdf"):
            em.World(em.scenes.from_urdf(path, role="effector"))


def test_calls_in_threads_leave_the_filters_of_warnings_as_they_are():
    """And a warning in another thread is seen while a call keeps its own."""
    before, begun, go_on = list(warnings.filters), threading.Event(), threading.Event()
    kept = []

    def keep():
        with kept_warnings() as own:
            em.World(problem(mass=1e6, start={"position": (0, 0, 0.02)}).scene)
            kept.append(list(own))
            begun.set()
            go_on.wait(60)

    threads = [threading.Thread(target=keep) for _ in range(4)]
    for thread in threads:
        thread.start()
    assert begun.wait(60)
    with pytest.warns(em.PlausibilityWarning):
        em.World(problem(shape=em.Box((50.0,) * 3), height=25.0).scene)
    go_on.set()
    for thread in threads:
        thread.join()
    assert all(kept) and list(warnings.filters) == before


BELIEVED = em.beliefs.Uncertainty(mass={"object": 0.1})


def test_particles_that_are_drawn_in_threads_leave_the_filters_as_they_are():
    import sliding

    before = list(warnings.filters)
    belief = em.Belief(sliding.problem(), uncertainty=BELIEVED)
    threads = [threading.Thread(target=belief.particles, args=(50 + k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert list(warnings.filters) == before


def test_no_module_changes_the_warnings_of_all_threads():
    found = [
        f"{file.name}:{node.lineno}"
        for file in sorted((ROOT / "python" / "energymargin").rglob("*.py"))
        for node in ast.walk(ast.parse(file.read_text()))
        if getattr(node, "attr", getattr(node, "id", "")) in ALL_THREADS
    ]
    assert found == []


ALL_THREADS = {"catch_warnings", "simplefilter", "filterwarnings", "resetwarnings"}
