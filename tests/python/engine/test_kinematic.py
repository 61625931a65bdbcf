"""Kinematic bodies: motion that is prescribed, and that nothing stops."""

import json
import pickle
import re

import jsonschema
import numpy as np
import pytest

import energymargin as em

SPEED = 0.1  # m/s


def scene(**hand):
    """A block on a table in front of a hand that moves towards it, 2 mm away."""
    made = em.Scene()
    made.add_plane("table", friction=0.5)
    made.add_body(
        "block",
        em.Box((0.1, 0.1, 0.1)),
        mass=10,
        position=(0, 0.102, 0.05),
        friction=0.8,
        role="object",
    )
    keywords = {"mass": 0.5, "kinematic": True, "velocity": (0, SPEED, 0), "role": "effector"}
    keywords["friction"] = 0.0
    made.add_body("hand", em.Box((0.1, 0.1, 0.06)), position=(0, 0, 0.05), **keywords | hand)
    return made


def problem(made, **keywords):
    keywords = {"captured": em.regions.Ball("block", center=(0, 0.1, 0.05), radius=0.05)} | keywords
    return em.Problem(
        made, made.pack(), force=(1, 1, 0), torque=(0, 0, 0.1), duration=0.1, **keywords
    )


def ahead(rows=240):
    return np.tile([0, SPEED, 0, 0, 0, 0], (rows, 1))


def hand_after(world, made, seconds):
    return made.unpack(world.rollout(made.pack(), np.zeros(6), seconds).state)["hand"]


def test_a_hand_pushes_a_heavy_block_at_its_speed_with_a_plan_and_without():
    still = scene(velocity=(0, 0, 0))
    for made, world in (
        (scene(), em.World(scene())),
        (still, em.World(still, em.Plan(step=1 / 240, velocities={"hand": ahead()}))),
    ):
        hand = hand_after(world, made, 1.0)
        assert np.abs(hand["position"] - (0, SPEED, 0.05)).max() < 1e-9
        end = world.rollout(made.pack(), np.zeros(6), 1.0)
        block = made.unpack(end.state)["block"]
        assert block["velocity"][1] == pytest.approx(SPEED, abs=1e-3)
        assert world.rollout(made.pack(), np.zeros(6), 1.0).state.tobytes() == end.state.tobytes()


def test_a_motor_of_limited_force_is_stopped_where_a_kinematic_hand_is_not():
    made = scene(kinematic=False)
    plan = em.Plan(step=1 / 240, velocities={"hand": ahead()})
    assert hand_after(em.World(made, plan), made, 1.0)["position"][1] < 0.01


def test_the_work_of_the_hand_is_that_of_the_plan():
    made = scene()
    audit = em.World(made).rollout(made.pack(), np.zeros(6), 1.0, audit=True).audit
    way = SPEED - 0.002  # m
    assert audit.plan == pytest.approx(10 * 9.81 * 0.4 * way + 10 * SPEED**2, rel=0.01)
    assert abs(audit.leftover) < 1e-6 * audit.turnover


def test_escapes_and_probabilities_are_of_a_hand_that_goes_on():
    plan = em.Plan(step=1 / 240, velocities={"hand": ahead()})
    asked = problem(scene(), horizon=1.0, plan=plan)
    lost = em.capture_probability(asked, rollouts=5)
    assert lost.captured == 0
    assert lost.undisturbed is False
    assert lost.undisturbed_time == pytest.approx(0.052 / SPEED, abs=0.05)
    assert em.escape_effort(asked, nodes=5).effort == 0
    without = problem(scene())
    assert em.capture_score(without, nodes=20).undisturbed_exit is not None
    assert em.effort_lower_bound(without).reason == "'hand' is kinematic and moves, which does work"


def test_holding_keeps_the_twist_of_a_kinematic_hand_without_limits():
    made = scene()
    plan = em.Plan.hold(made, made.pack(), 0.5)
    assert plan.limits == {}
    assert np.array_equal(plan.velocities["hand"], ahead(120))


def test_files_and_pickles_keep_it():
    asked = problem(scene())
    text = asked.to_json()
    fields = json.loads(text)
    assert fields["version"] == 6
    assert fields["scene"]["bodies"][2]["kinematic"] is True
    assert "kinematic" not in fields["scene"]["bodies"][1]
    assert em.Problem.from_json(text).scene.bodies[2].kinematic is True
    assert pickle.loads(pickle.dumps(asked)).to_json() == text
    fields["version"] = 4
    words = 'scene.bodies[2] has "kinematic", expected only from "version": 5 on; this file says 4'
    with pytest.raises(ValueError, match=re.escape(words)):
        em.Problem.from_json(json.dumps(fields))
    assert not jsonschema.Draft7Validator(em.Problem.schema()).is_valid(fields)
    assert json.loads(problem(scene(kinematic=False)).to_json())["version"] == 6


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: scene(mass=0, velocity=(0, 0, 0)), "kinematic is true, expected false for a body"),
        (lambda: scene(role="object"), "kinematic is true, expected false for an object"),
        (lambda: scene(force=(0, 0, 1)), "force is (0, 0, 1), expected 0 for a kinematic body"),
        (
            lambda: em.World(scene(), em.Plan(step=1 / 240, wrenches={"hand": ahead()})),
            "wrenches['hand'] is on a kinematic body, expected `velocities`",
        ),
        (
            lambda: em.World(
                scene(),
                em.Plan(step=1 / 240, velocities={"hand": ahead()}, limits={"hand": (1, 1)}),
            ),
            "limits['hand'] is of a kinematic body, expected none",
        ),
    ],
)
def test_what_a_kinematic_body_cannot_be_is_refused_by_name(make, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        make()


def test_a_notebook_says_what_is_kinematic_and_how_friction_is_made():
    made = scene()
    shown = made._repr_html_()
    assert "kinematic" in shown and "friction by" not in shown
    ruled = em.Scene(friction_rule="max")
    ruled.add_plane("table")
    ruled.add_body("cup", em.Sphere(0.1), mass=1)
    ruled.set_friction("cup", "table", 0.1)
    assert (
        "friction by the max of two coefficients, coefficients of pairs: 1" in ruled._repr_html_()
    )


def test_its_scene_has_no_twin_in_mujoco():
    with pytest.raises(ValueError, match="body 'hand' is kinematic, expected none"):
        em.mujoco.to_mjcf(scene())
