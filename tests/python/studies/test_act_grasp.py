"""Acting on the margin: where and how hard a mallet is gripped."""

import numpy as np
import pytest

import energymargin as em
from energymargin._core import Cancel, World
from energymargin_paper.evidence.act_grasp import (
    DENSITIES,
    FRICTION,
    HANDLE,
    PAD,
    GraspDemo,
    joined,
)
from energymargin_paper.evidence.act_trials import ENGINES, run

WORLDS = {"bullet": 32, "mujoco": 4}


@pytest.fixture(scope="module")
def demo():
    return GraspDemo()


def ends(demo, values, world=None):
    """All bodies at the end of the undisturbed motion, by name."""
    problem = demo.problem(values, world)
    steps = round(problem.horizon / problem.scene.step)
    states = World(problem.scene, problem.plan).simulate(problem.state, steps, record=[steps])
    return problem.scene.unpack(states.states[-1])


def test_the_origin_is_the_meshes_centroid_and_the_center_of_mass_is_nearer_to_the_head(demo):
    (mallet,) = (b for b in demo.problem(demo.nominal).scene.bodies if b.role == "object")
    even = em.mass_properties(mallet.shape)
    assert even.center == pytest.approx(np.zeros(3), abs=1e-6)
    assert mallet.inertial.center[0] > 0.01
    assert DENSITIES[0] * even.volume < mallet.mass < DENSITIES[1] * even.volume


def test_inertia_of_parts_of_one_density_is_that_of_the_compound(demo):
    mass, center, inertia = joined(demo._parts, (700.0, 700.0))
    (mallet,) = (b for b in demo.problem(demo.nominal).scene.bodies if b.role == "object")
    whole = em.mass_properties(mallet.shape, mass)
    assert mass == pytest.approx(700.0 * whole.volume)
    assert center == pytest.approx(demo._centroid)
    assert sorted(np.linalg.eigvalsh(inertia)) == pytest.approx(sorted(whole.moments), rel=1e-6)


def test_pads_press_as_hard_as_said_so_that_friction_carries_the_weight_or_does_not(demo):
    weight = 9.81 * demo.problem(demo.nominal).scene.bodies[1].mass
    least = weight / (2 * FRICTION)
    slips, holds = (
        ends(demo, {**demo.nominal, "squeeze": share * least})["mallet"]["position"][2]
        for share in (0.7, 2.0)
    )
    assert slips < 0.03 and holds > 0.08


def test_the_wood_bears_less_where_the_pads_cover_less_of_it(demo):
    (margin,) = demo.constraints
    gentle = {**demo.nominal, "squeeze": 4.0}
    low, high = (margin({**gentle, "height": height}) for height in (0.021, 0.035))
    assert 0 < high < low
    assert margin({**gentle, "height": 0.035, "squeeze": 4.0 + 1.01 * high}) < 0


def test_pads_stay_on_the_handle_and_off_the_table(demo):
    longest = demo.parameters["along"][2] + demo._centroid[0] + PAD[0] / 2
    assert longest <= HANDLE[1][0]
    assert demo.parameters["height"][0] > PAD[2] / 2


@pytest.mark.parametrize("engine", ENGINES)
def test_a_grip_near_the_center_of_mass_is_lost_less_often_in_both_engines(demo, engine):
    near = {**demo.nominal, "along": 0.007, "squeeze": 16.0}
    away = {**demo.nominal, "along": demo.parameters["along"][0]}  # at the handle's end
    lost = [
        sum(run(demo, values, engine, world, Cancel()).lost for world in range(WORLDS[engine]))
        for values in (near, away)
    ]
    assert lost[0] < WORLDS[engine] / 2 < lost[1]
