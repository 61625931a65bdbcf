"""25 balls on a box that is pushed askew: friction is against the slip, in every direction alike.

The scene is that of Hwangbo and others (2018, RaiSim), whose answer is closed: balls of 1 kg on
which f acts roll on the box without slip, so that it gains 3.5 f / kg.
"""

import numpy as np
import pytest

import energymargin as em

BALLS, DURATION = 25, 4.0
PUSH = 150 * np.array([0.5, np.sqrt(0.75), 0.0])  # N
ON_BALL = (150 - 0.4 * (10 + BALLS) * 9.81) / (10 * 3.5 + BALLS)  # N


def pushed(step):
    scene = em.Scene(step=step)
    scene.add_plane("ground")
    scene.add_body("box", em.Box((20, 20, 1)), mass=10, position=(0, 0, 0.5), force=PUSH)
    scene.set_friction("box", "ground", 0.4)
    for k in range(BALLS):
        name, place = f"ball {k}", (2 * (k % 5 - 2), 2 * (k // 5 - 2), 1.5)
        scene.add_body(name, em.Sphere(0.5), mass=1, position=place, role="object")
        scene.set_friction(name, "box", 0.8)
    return scene


# As published for other engines at 1 ms: Bullet 5.7e-9, RaiSim 4.1e-7, MuJoCo 6.9e-3, ODE 3.14.
@pytest.mark.parametrize(("step", "most"), [(1e-3, 1e-11), (1 / 240, 1e-9)])
def test_the_velocities_of_the_balls_and_the_box_are_those_on_paper(step, most):
    scene = pushed(step)
    count = round(DURATION / step)
    done = em.World(scene).simulate(scene.pack(), count, record=range(1, count + 1))
    times, along = step * np.arange(1, count + 1)[:, None], PUSH / 150
    states = np.asarray(done.states)
    errors = []
    for body in scene.bodies[1:]:
        speeds = states[:, scene.slice(body.name)][:, 7:10]
        gain = ON_BALL * (3.5 if body.name == "box" else 1.0)
        errors.append(((speeds - gain * times * along) ** 2).sum(axis=1))
    assert np.mean(errors) < most  # m^2/s^2
    assert done.unconverged == 0
    assert done.lost_time == 0
