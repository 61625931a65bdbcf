"""What a simulation returns is a state: whatever takes a state takes it."""

import json
import warnings

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import energymargin as em


def gripper(limit=0.3, grip=0.5, held=False, mimic=False, free=False):
    """Two fingers on hinges beside a box on a table, on a post or on a body that can move."""
    scene = em.Scene()
    scene.add_plane("table", friction=0.5)
    palm = em.Box((0.16, 0.04, 0.02))
    scene.add_body("palm", palm, mass=0.5 * free, position=(0, 0, 0.16), role="none")
    for side, name in ((-1, "left"), (1, "right")):
        scene.add_body(name, em.Box((0.01, 0.02, 0.1)), mass=0.05, role="effector", friction=0.8)
        scene.add_joint(
            f"{name} hinge",
            parent="palm",
            child=name,
            origin=(0.06 * side, 0, -0.01),
            child_origin=(0, 0, 0.055),
            axis=(0, side, 0),
            **({"limits": (-limit, limit)} if side < 0 or not mimic else {}),
            **({"mimic": em.Mimic("left hinge")} if side > 0 and mimic else {}),
            **({"target": grip, "stiffness": 1.0} if side < 0 or not mimic else {}),
        )
    scene.add_body("slider", em.Box((0.02, 0.02, 0.02)), mass=0.05, friction=0.5)
    scene.add_joint(
        "rail",
        type="prismatic",
        parent="palm",
        child="slider",
        origin=(0, 0.05, 0),
        axis=(0, 0, 1),
        limits=(-0.03, 0.03),
        held=held,
    )
    scene.add_body(
        "box", em.Box((0.06, 0.06, 0.06)), mass=0.1, position=(0, 0, 0.03), role="object"
    )
    return scene


def question(scene, state):
    return em.Problem(
        scene,
        state,
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.05,
        captured=em.regions.Ball("box", center=(0, 0, 0.03), radius=1.0),
        start_outside=True,
    )


def take(scene, state):
    """Everything that takes a state, takes it."""
    world = em.World(scene)
    unpacked = scene.unpack(state)
    moving = {
        name: {key: unpacked["joints"][name][key] for key in ("position", "velocity")}
        for name in (joint.name for joint in scene.joints if joint.mimic is None)
    }
    free = [
        body.name
        for body in scene.bodies
        if body.mass > 0 and body.name not in {joint.child for joint in scene.joints}
    ]
    bodies = {name: {k: v for k, v in unpacked[name].items() if k != "yaw"} for name in free}
    assert np.array_equal(scene.pack(joints=moving, **bodies), state)
    assert np.isfinite(world.energy(state))
    problem = question(scene, state)
    assert np.array_equal(problem.with_state(state).state, state)
    assert np.array_equal(em.Problem.from_json(problem.to_json()).state, state)
    world.rollout(state, np.zeros(6), 0.02)
    world.simulate(state, 2)


SPEEDS = st.floats(-20, 20)


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@settings(max_examples=40, deadline=None)
@given(
    scene=st.builds(
        gripper,
        limit=st.floats(0.05, 0.5),
        grip=st.floats(-2, 2),
        held=st.booleans(),
        mimic=st.booleans(),
        free=st.booleans(),
    ),
    speeds=st.tuples(SPEEDS, SPEEDS, st.floats(-2, 2)),
    push=st.tuples(*[st.floats(-5, 5)] * 3),
    steps=st.integers(1, 60),
)
def test_whatever_a_simulation_returns_is_taken(scene, speeds, push, steps):
    joints = {
        joint.name: {"velocity": speed}
        for joint, speed in zip(scene.joints, speeds, strict=True)
        if joint.mimic is None and not joint.held
    }
    world = em.World(scene)
    start = scene.pack(joints=joints)
    take(scene, world.rollout(start, (*push, 0, 0, 0), steps * scene.step).state)
    take(scene, world.simulate(start, steps, record=[steps]).states[0])


def beyond_limits(position):
    scene = gripper(limit=0.29)
    scene.disable_collisions("left", "box")
    state = scene.pack()
    state[scene.joint_slice("left hinge").start] = position
    return scene, state


WAYS = {
    "Problem": question,
    "with_state": lambda scene, state: question(scene, scene.pack()).with_state(state),
    "replace": lambda scene, state: question(scene, scene.pack()).replace(state=state),
    "rollout": lambda scene, state: em.World(scene).rollout(state, np.zeros(6), 0.01),
    "simulate": lambda scene, state: em.World(scene).simulate(state, 2),
    "pack": lambda scene, state: scene.pack(
        joints={"left hinge": state[scene.joint_slice("left hinge").start]}
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_joint_beyond_its_limits_warns_with_its_name_the_amount_and_the_limit(way):
    scene, state = beyond_limits(-0.49)
    scene.add_body(f"of {way}", em.Sphere(0.01), mass=0, position=(9, 0, 0))  # warns once a scene
    words = "joint 'left hinge': position is -0.49 rad, 0.2 rad beyond its lower limit of -0.29 rad"
    with pytest.warns(em.PlausibilityWarning, match=words) as caught:
        WAYS[way](scene, state)
    assert len(caught) == 1


def test_a_joint_that_yields_a_little_at_its_stop_does_not_warn():
    scene, state = beyond_limits(-0.33)
    with warnings.catch_warnings():
        warnings.simplefilter("error", em.PlausibilityWarning)
        for way in WAYS.values():
            way(scene, state)


def test_unpack_and_energy_of_a_joint_beyond_its_limits_do_not_warn():
    scene, state = beyond_limits(-0.49)
    with warnings.catch_warnings():
        warnings.simplefilter("error", em.PlausibilityWarning)
        assert scene.unpack(state)["joints"]["left hinge"]["position"] == -0.49
        assert np.isfinite(em.World(scene).energy(state))


def test_a_joint_starts_within_its_limits():
    with pytest.raises(ValueError, match=r"position is 1\.5, expected from -1 to 1"):
        scene = em.Scene()
        scene.add_body("post", em.Box((0.1, 0.1, 0.1)), mass=0)
        scene.add_body("arm", em.Box((0.1, 0.1, 0.1)), mass=1)
        scene.add_joint("hinge", parent="post", child="arm", limits=(-1, 1), start=1.5)
    with pytest.raises(ValueError, match="position is 9"):
        fields = json.loads(question(gripper(), gripper().pack()).to_json())
        fields["scene"]["joints"][0]["position"] = 9
        em.Problem.from_json(json.dumps(fields))
