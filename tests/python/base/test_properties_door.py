"""Whatever comes through the Python door: an answer of finite numbers, or a clear refusal."""

import contextlib
import json

import jsonschema
import numpy as np
import pytest
from anything import ANYTHING, NUMBERS, VECTORS, changed, finite
from hypothesis import assume, given, strategies as st
from problem_files import full_problem, planned_problem

import energymargin as em

PROBLEM = full_problem()
SCENE = PROBLEM.scene
TEXT = json.loads(PROBLEM.to_json())
PLANNED_TEXT = json.loads(planned_problem().to_json())
VALIDATOR = jsonschema.Draft7Validator(em.Problem.schema())
FREE, JOINTS = ("cup", "dice", "weight"), ("hinge", "rail")

REFUSED = (ValueError, TypeError)


def small(least=-5, most=5):
    return st.floats(least, most, allow_nan=False)


def unit(size):
    any_vector = st.lists(small(-1, 1), min_size=size, max_size=size).map(np.array)
    long = any_vector.filter(lambda v: np.linalg.norm(v) > 0.1)
    return long.map(lambda v: v / np.linalg.norm(v))


POSITION = st.tuples(small(), small(), small())
BODY = st.fixed_dictionaries(
    {},
    optional={
        "position": POSITION,
        "orientation": unit(4),
        "velocity": POSITION,
        "angular_velocity": POSITION,
    },
)
JOINT = st.fixed_dictionaries(
    {}, optional={"position": small(-0.1, 0.2), "velocity": st.just(0.0)}
) | small(-0.1, 0.2)
STATES = st.tuples(
    st.dictionaries(st.sampled_from(FREE), BODY), st.dictionaries(st.sampled_from(JOINTS), JOINT)
)


@given(STATES)
def test_packing_what_was_unpacked_gives_the_same_bits(state):
    bodies, joints = state
    packed = SCENE.pack(joints=joints, **bodies)
    unpacked = SCENE.unpack(packed)
    free = {name: {**unpacked[name]} for name in FREE}
    for body in free.values():
        del body["yaw"]
    moving = {name: unpacked["joints"][name] for name in JOINTS}
    assert SCENE.pack(joints=moving, **free).tobytes() == packed.tobytes()
    for name, body in bodies.items():
        for key, value in body.items():
            assert np.array_equal(unpacked[name][key], value)


@given(
    st.sampled_from([*FREE, "table", "tip", "nobody", "é" * 40]),
    st.sampled_from(
        ["position", "orientation", "yaw", "velocity", "angular_velocity", "e", "\ud800"]
    ),
    ANYTHING,
)
def test_a_state_of_anything_is_finite_or_refused(name, key, value):
    for bodies in ({name: {key: value}}, {name: value}):
        with contextlib.suppress(*REFUSED):
            assert finite(SCENE.pack(**bodies))
    for joints in ({name: value}, {"hinge": {key: value}}, {"hinge": value}, value):
        with contextlib.suppress(*REFUSED):
            assert finite(SCENE.pack(joints=joints))


@given(ANYTHING)
def test_a_name_of_anything_is_known_or_refused(value):
    for call in (SCENE.slice, SCENE.joint_slice, SCENE.unpack, em.Problem.from_json):
        with pytest.raises(REFUSED):
            call(value)
    if isinstance(value, str):
        with pytest.raises(REFUSED):
            SCENE.pack(**{value: {}})


BODY_KEYWORDS = (
    "mass",
    "density",
    "inertial",
    "position",
    "orientation",
    "yaw",
    "velocity",
    "angular_velocity",
    "friction",
    "role",
    "linear_factor",
    "angular_factor",
    "force",
    "kinematic",
)


@given(st.sampled_from(BODY_KEYWORDS), st.one_of(ANYTHING, VECTORS, NUMBERS))
def test_a_body_of_anything_is_finite_or_refused(keyword, value):
    scene = em.Scene()
    keywords = {"mass": 1.0, keyword: value}
    if keyword == "density":
        del keywords["mass"]
    try:
        scene.add_body("body", em.Box((1, 2, 3)), **keywords)
    except REFUSED:
        assert not scene.bodies
        return
    (body,) = scene.bodies
    assert finite(body.mass, body.friction, body.force, body.position, body.velocity)
    assert finite(scene.pack())


@given(
    st.sampled_from(["friction_rule", "body_a", "body_b", "friction"]), st.one_of(ANYTHING, NUMBERS)
)
def test_a_friction_of_anything_is_one_that_can_be_or_is_refused(keyword, value):
    keywords = {
        "friction_rule": "max",
        "body_a": "table",
        "body_b": "cup",
        "friction": 0.1,
        keyword: value,
    }
    with contextlib.suppress(*REFUSED):
        scene = em.Scene(friction_rule=keywords.pop("friction_rule"))
        scene.add_plane("table")
        scene.add_body("cup", em.Sphere(1), mass=1)
        scene.set_friction(**keywords)
        assert scene.contact_friction("cup", "table") == scene.pair_frictions["table", "cup"] >= 0


SHAPES = (
    em.Box,
    em.Sphere,
    lambda value: em.Cylinder(value, 0.1),
    lambda value: em.Capsule(0.1, value),
    em.ConvexHull,
    lambda value: em.ConvexHull(np.resize(value, (5, 3))),
    em.Compound,
    lambda value: em.Part(em.Sphere(0.1), position=value),
    lambda value: em.Inertial(center=(0, 0, 0), inertia=value),
)


@given(st.sampled_from(SHAPES), st.one_of(ANYTHING, VECTORS, NUMBERS))
def test_a_shape_of_anything_has_a_finite_mass_or_is_refused(make, value):
    with contextlib.suppress(*REFUSED):
        shape = make(value)
        if isinstance(shape, (em.Box, em.Sphere, em.Cylinder, em.Capsule, em.ConvexHull)):
            spread = em.mass_properties(shape)
            assert finite(spread.volume, spread.center, spread.moments, spread.axes)


REGIONS = (
    lambda value: em.regions.Ball("cup", center=value, radius=1),
    lambda value: em.regions.Ball("cup", center=(0, 0, 0), radius=value),
    lambda value: em.regions.Ball(value, center=(0, 0, 0), radius=1),
    lambda value: em.regions.Box("cup", center=(0, 0, 0), size=value),
    lambda value: em.regions.Disc("cup", center=value, radius=1),
    lambda value: em.regions.HalfSpace("cup", normal=value, offset=1),
    lambda value: em.regions.Tilt("cup", axis=(0, 0, 1), reference=(0, 0, 1), limit=value),
    lambda value: em.regions.Speed("cup", limit=1, point=value),
    lambda value: em.regions.Ball("cup", center=(0, 0, 0), radius=1, frame=value),
)


@given(st.sampled_from(REGIONS), st.one_of(ANYTHING, VECTORS, NUMBERS), STATES)
def test_a_region_of_anything_is_a_set_or_refused(make, value, state):
    states = np.stack([SCENE.pack(), SCENE.pack(joints=state[1], **state[0])])
    try:
        region = make(value)
        inside = region.contains(SCENE, states)
    except REFUSED:
        return
    assert inside.shape == (2,) and inside.dtype == bool
    assert np.array_equal((~region).contains(SCENE, states), ~inside)
    assert [region.contains(SCENE, state) for state in states] == inside.tolist()


@given(ANYTHING, st.integers(0, 2))
def test_a_rollout_of_anything_is_finite_or_refused(value, which):
    arguments = [SCENE.pack(), np.zeros((2, 6)), 0.01]
    arguments[which] = value
    assume(which != 2 or not isinstance(value, (int, float)) or abs(value) < 1 or value > 1e6)
    with contextlib.suppress(*REFUSED):
        rollout = em.World(SCENE).rollout(*arguments)
        assert finite(rollout.state, rollout.effort, rollout.work, rollout.energy)


@given(changed(TEXT) | changed(PLANNED_TEXT))
def test_a_changed_problem_fits_the_schema_and_is_written_as_it_is_read_or_is_refused(changed_text):
    try:
        problem = em.Problem.from_json(json.dumps(changed_text))
    except ValueError as error:
        assert str(error)
        return
    VALIDATOR.validate(changed_text)
    assert em.Problem.from_json(problem.to_json()).to_json() == problem.to_json()


@given(st.text())
def test_any_text_that_is_no_problem_is_refused(text):
    with pytest.raises(ValueError):
        em.Problem.from_json(text)
