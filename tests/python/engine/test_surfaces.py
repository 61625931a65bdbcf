"""How bodies meet beside Coulomb's friction, against closed forms."""

import math

import numpy as np
import pytest

import energymargin as em

G = 9.81
RADIUS, MASS = 0.05, 0.2
INERTIA = 0.4 * MASS * RADIUS**2


def ball_on_table(
    *, step=1 / 240, height=RADIUS, table_friction=1.0, table_velocity=(0, 0, 0), **ball
):
    scene = em.Scene(step=step)
    scene.add_plane("table", friction=table_friction, surface_velocity=table_velocity)
    ball = {"mass": MASS, "friction": 0.5, "position": (0, 0, height)} | ball
    scene.add_body("ball", em.Sphere(RADIUS), role="object", **ball)
    return scene


def motion(scene, duration):
    """Times [s], positions, velocities and spins of the ball, after each step."""
    steps = round(duration / scene.step)
    simulation = em.World(scene).simulate(scene.pack(), steps)
    assert simulation.unconverged == 0
    states = np.asarray(simulation.states)
    return np.ravel(simulation.times), states[:, :3], states[:, 7:10], states[:, 10:13]


def time_to_rest(times, speeds, share=1e-3):
    return times[np.argmax(np.abs(speeds) < share * np.abs(speeds[0]))]


@pytest.mark.parametrize("torsional", [0.002, 0.01])
def test_ball_spins_to_rest(torsional):
    start = 0.5 * torsional * MASS * G / INERTIA  # [rad/s], for half a second
    scene = ball_on_table(
        surface=em.Surface(torsional_friction=torsional), angular_velocity=(0, 0, start)
    )
    times, positions, _, spins = motion(scene, 0.7)
    assert time_to_rest(times, spins[:, 2]) == pytest.approx(0.5, rel=0.02)
    assert np.abs(positions[-1, :2]).max() < 1e-6


@pytest.mark.parametrize("rolling", [0.0005, 0.002])
def test_ball_rolls_to_rest(rolling):
    slowing = rolling * G / (RADIUS * 1.4)
    start = 1.0 * slowing
    scene = ball_on_table(
        surface=em.Surface(rolling_friction=rolling),
        velocity=(start, 0, 0),
        angular_velocity=(0, start / RADIUS, 0),
    )
    times, positions, velocities, _ = motion(scene, 1.3)
    assert time_to_rest(times, velocities[:, 0], 0.01) == pytest.approx(1.0, rel=0.02)
    assert positions[-1, 0] == pytest.approx(0.5 * start, rel=0.02)
    assert np.abs(velocities[-1]).max() < 1e-3 * start


def peaks(heights):
    """Heights of the tops of a bouncing ball's way."""
    rises = (heights[1:-1] >= heights[:-2]) & (heights[1:-1] > heights[2:])
    return heights[1:-1][rises] - RADIUS


@pytest.mark.parametrize("restitution", [0.5, 0.8, 1.0])
@pytest.mark.parametrize("ground", ["plane", "box"])
def test_ball_bounces(restitution, ground):
    drop = 0.6
    errors = []
    for step in (1 / 240, 1 / 480):
        scene = em.Scene(step=step)
        if ground == "plane":
            scene.add_plane("ground")
        else:
            scene.add_body("ground", em.Box((1, 1, 0.2)), mass=0, position=(0, 0, -0.1))
        surface = em.Surface(restitution=restitution)
        scene.add_body(
            "ball", em.Sphere(RADIUS), mass=MASS, position=(0, 0, RADIUS + drop), surface=surface
        )
        _, positions, _, _ = motion(scene, 2.0)
        tops = peaks(positions[:, 2])[:2]
        right = drop * restitution ** (2 * np.arange(1, len(tops) + 1))
        errors.append(np.abs(tops / right - 1).max())
        assert len(tops) == 2
    assert errors[0] < 2e-3  # 2 % would do
    assert errors[1] < 0.6 * errors[0] or errors[1] < 1e-3


@pytest.mark.parametrize("restitution", [0.9, 0.98, 1.0])
@pytest.mark.parametrize("solid", [em.Sphere(RADIUS), em.Box((2 * RADIUS,) * 3)])
def test_what_bounces_rises_as_high_from_any_height(solid, restitution):
    surface = em.Surface(restitution=restitution)
    for drop in np.linspace(0.1, 0.8, 30):
        scene = em.Scene()
        scene.add_plane("ground")
        place = (0, 0, RADIUS + drop)
        scene.add_body("body", solid, mass=MASS, position=place, surface=surface)
        _, positions, _, _ = motion(scene, 2.2 * math.sqrt(2 * drop / G))
        assert peaks(positions[:, 2])[0] == pytest.approx(restitution**2 * drop, rel=0.01)


@pytest.mark.parametrize("share", [0.003, 0.1])
@pytest.mark.parametrize("load", [0.5, 0.9, 1.5])
def test_a_ball_rests_on_a_slope_up_to_its_rolling_friction(share, load):
    slope = math.atan(load * share)
    scene = em.Scene(gravity=(G * math.sin(slope), 0, -G * math.cos(slope)))
    scene.add_plane("ground", friction=1.0)
    surface = em.Surface(rolling_friction=share * RADIUS)
    place = {"position": (0, 0, RADIUS), "surface": surface}
    scene.add_body("ball", em.Sphere(RADIUS), mass=MASS, friction=1.0, **place)
    _, positions, _, _ = motion(scene, 2.0)
    free = 2.0 * G * math.sin(slope) / 1.4
    right = max(0.0, 1.0 - 1.0 / load) * free
    assert positions[-1, 0] == pytest.approx(right, rel=0.05, abs=1e-4)


def test_ball_is_carried_by_a_belt():
    """Friction speeds it up at mu g until it rolls: then it goes at 2/7 of the belt's speed."""
    belt = 0.7
    times, _, velocities, spins = motion(ball_on_table(table_velocity=(belt, 0, 0)), 0.5)
    end = 2 / 7 * belt / (0.5 * G)
    slipping = times < 0.95 * end
    assert velocities[slipping, 0] == pytest.approx(0.5 * G * times[slipping], rel=0.02)
    assert velocities[-1, 0] == pytest.approx(2 / 7 * belt, rel=0.02)
    assert velocities[-1, 0] - spins[-1, 1] * RADIUS == pytest.approx(belt, rel=0.02)


def test_soft_ball_sinks_by_its_weight():
    stiffness = 2000.0
    damping = 2 * math.sqrt(stiffness * MASS)
    surface = em.Surface(stiffness=stiffness, damping=damping)
    _, positions, velocities, _ = motion(ball_on_table(surface=surface), 1.0)
    assert RADIUS - positions[-1, 2] == pytest.approx(MASS * G / stiffness, rel=0.01)
    assert np.abs(velocities[-1]).max() < 1e-6


def test_soft_ball_swings():
    stiffness = 200.0
    scene = ball_on_table(surface=em.Surface(stiffness=stiffness), height=RADIUS, step=1 / 2000)
    times, positions, _, _ = motion(scene, 0.45)
    depth = RADIUS - positions[:, 2]
    period = 2 * math.pi * math.sqrt(MASS / stiffness)
    lows = np.flatnonzero((depth[1:-1] > depth[:-2]) & (depth[1:-1] >= depth[2:])) + 1
    assert times[lows[1]] - times[lows[0]] == pytest.approx(period, rel=0.02)
    assert depth.max() == pytest.approx(2 * MASS * G / stiffness, rel=0.03)


@pytest.mark.parametrize("damping", [10.0, 1000.0])
def test_a_damper_does_nothing_before_the_touch(damping):
    ball = {"height": RADIUS + 0.05, "surface": em.Surface(stiffness=1e4, damping=damping)}
    times, positions, velocities, _ = motion(ball_on_table(**ball), 0.11)
    falls = positions[:, 2] > RADIUS
    assert 20 < np.count_nonzero(falls) < len(times) - 1
    np.testing.assert_allclose(velocities[falls, 2], -G * times[falls], atol=1e-9)


def blow_on_the_floor(solid, surface, *, others=0, **motion):
    """Mechanical energy [J] and velocity of a body that falls, after each step, far from others."""
    scene = em.Scene()
    scene.add_body("floor", em.Box((4, 4, 0.2)), mass=0, position=(0, 0, -0.1))
    for i in range(others):
        scene.add_body(f"other {i}", em.Sphere(0.01), mass=0.01, position=(9 + i, 0, 99))
    scene.add_body("body", solid, mass=0.3, surface=surface, **motion)
    world = em.World(scene)
    states = world.simulate(scene.pack(), steps=150).states
    return (
        np.array([world.energy(state) for state in states]),
        np.array([scene.unpack(state)["body"]["velocity"] for state in states]),
    )


@pytest.mark.parametrize("restitution", [0.3, 0.9])
def test_pieces_bounce_as_one_box_does_and_among_many_bodies(restitution):
    half = em.Box((0.04, 0.08, 0.08))
    pieces = em.Compound([em.Part(half, (side, 0, 0)) for side in (-0.02, 0.02)])

    def rebound(solid, others):
        surface = em.Surface(restitution=restitution)
        _, velocities = blow_on_the_floor(solid, surface, others=others, position=(0, 0, 0.34))
        return velocities[:, 2].max()

    whole = rebound(em.Box((0.08, 0.08, 0.08)), 0)
    assert whole == pytest.approx(restitution * math.sqrt(2 * G * 0.3), rel=0.03)
    assert rebound(pieces, 0) == pytest.approx(whole, rel=1e-3)
    assert rebound(pieces, 40) == pytest.approx(whole, rel=1e-3)


@pytest.mark.parametrize("surface", [{"stiffness": 1e4}, {"restitution": 0.9}])
@pytest.mark.parametrize("others", [0, 40])
def test_a_blow_that_is_cut_in_two_is_the_same(surface, others):
    scene = em.Scene()
    scene.add_plane("floor")
    for i in range(others):
        scene.add_body(f"other {i}", em.Sphere(0.01), mass=0.01, position=(9 + i, 0, 99))
    how = {"position": (0, 0, 0.2), "velocity": (0.3, 0, -3.0), "angular_velocity": (1, 2, 3)}
    box = em.Box((0.08, 0.06, 0.05))
    scene.add_body("body", box, mass=0.3, surface=em.Surface(**surface), **how)
    world = em.World(scene)
    states = world.simulate(scene.pack(), steps=40).states
    for cut in range(0, len(states) - 1, 3):
        resumed = world.simulate(states[cut], steps=1, record=[1]).states[0]
        np.testing.assert_allclose(resumed, states[cut + 1], atol=1e-9)


@pytest.mark.parametrize("surface", [{"stiffness": 1e4}, {"stiffness": 1e6}, {"restitution": 0.9}])
@pytest.mark.parametrize("kind", ["hull", "angle"])
def test_a_blow_gives_what_turns_no_energy(kind, surface):
    """Newton's law of impact alone gives up to 0.3 of it (Kane 1984)."""
    for seed in range(30):
        random = np.random.default_rng(seed)
        points = random.normal(size=(12, 3))
        solid = em.ConvexHull(0.05 * points / np.linalg.norm(points, axis=1)[:, None])
        if kind == "angle":
            legs = (em.Box((0.03, 0.03, 0.1)), em.Box((0.1, 0.03, 0.03)))
            solid = em.Compound([em.Part(legs[0]), em.Part(legs[1], (0.03, 0, -0.05))])
        energies, _ = blow_on_the_floor(
            solid,
            em.Surface(**surface),
            friction=1.0,
            position=(0, 0, 0.2),
            velocity=(*random.uniform(-1, 1, 2), -random.uniform(0.3, 5)),
            angular_velocity=8 * random.normal(size=3),
        )
        assert energies.max() < 1.01 * energies[0]


@pytest.mark.parametrize("solid", [em.Sphere(0.02), em.Box((0.04, 0.04, 0.04))])
@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0, 8.0])
def test_a_spring_far_stiffer_than_a_step_is_long_throws_nothing(solid, speed):
    for far in np.linspace(0.05, 0.1, 5):
        scene = em.Scene(gravity=(0, 0, 0))
        surface = em.Surface(stiffness=1e6)
        scene.add_body("wall", em.Box((0.02, 0.5, 0.5)), mass=0, surface=surface)
        place = {"position": (-far - 0.03, 0, 0), "velocity": (speed, 0, 0)}
        scene.add_body("body", solid, mass=0.1, **place)
        steps = round(2.0 * far / speed / scene.step)
        played = em.World(scene).simulate(scene.pack(), steps=steps)
        body = scene.unpack(played.states[-1])["body"]
        assert np.linalg.norm(body["velocity"]) < 0.02 * speed
        assert played.lost_time == 0.0


@pytest.mark.parametrize(
    "surface", [em.Surface(restitution=0.5), em.Surface(stiffness=1e4, damping=5.0)]
)
def test_bodies_that_are_apart_have_no_contacts(surface):
    def contacts(height):
        scene = em.Scene()
        scene.add_body("floor", em.Box((1, 1, 0.1)), mass=0, position=(0, 0, -0.05))
        place = {"position": (0, 0, 0.02 + height), "surface": surface}
        scene.add_body("cube", em.Box((0.04, 0.04, 0.04)), mass=0.1, role="object", **place)
        return em.World(scene).contacts(scene.pack())

    assert contacts(0.02) == [] and len(contacts(0.0)) == 4


def cube_in_fingertips(torque, torsional, force=20.0, friction=1.0):
    """A cube between two balls that press with a force; a torque turns it about their axis."""
    scene = em.Scene(gravity=(0, 0, 0))
    cube = em.Box((0.04,) * 3)
    scene.add_body("cube", cube, mass=0.1, friction=friction, role="object")
    for name, side in (("left", -1), ("right", 1)):
        scene.add_body(
            name,
            em.Sphere(0.01),
            mass=0.05,
            position=(side * 0.03, 0, 0),
            friction=1.0,
            linear_factor=(1, 0, 0),
            angular_factor=(0, 0, 0),
            force=(-side * force, 0, 0),
            surface=em.Surface(torsional_friction=torsional),
        )
    world = em.World(scene)
    drive = np.zeros((240, 6))
    drive[24:, 3] = torque
    state = np.asarray(world.simulate(scene.pack(), 240, drives={"cube": drive}).states)[-1]
    return np.linalg.norm(state[10:13])


def test_cube_turns_in_soft_fingertips_beyond_their_torsional_friction():
    most = 2 * 0.004 * 20.0
    assert cube_in_fingertips(0.98 * most, 0.004) < 1e-2
    assert cube_in_fingertips(1.02 * most, 0.004) > 1.0
    assert cube_in_fingertips(0.02 * most, 0.0) > 1.0


def spin_in_pads(torque, pad, torsional=0.004, force=20.0):
    """Spin [rad/s] of a cube that a torque turns between two hard fingers with soft pads."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("palm", em.Box((0.02,) * 3), mass=0, position=(0, 0, 0.2))
    scene.add_body("cube", em.Box((0.04,) * 3), mass=0.1, friction=1.0, role="object")
    soft = em.Surface(torsional_friction=torsional)
    for name, side in (("left", -1), ("right", 1)):
        closes = {"axis": (-side, 0, 0), "target": 1.0, "stiffness": 100, "torque_limit": force}
        at = (side * 0.05, 0, -0.2)
        scene.add_body(name, em.Box((0.02, 0.02, 0.06)), mass=0.05, friction=0.3)
        scene.add_joint(name, type="prismatic", parent="palm", child=name, origin=at, **closes)
        scene.add_body(f"{name} pad", pad, mass=1e-3, friction=1.0, surface=soft)
        tip = {"type": "fixed", "origin": (-side * 0.01, 0, 0)}
        scene.add_joint(f"{name} pad", parent=name, child=f"{name} pad", **tip)
    drive = np.zeros((360, 6))
    drive[120:, 3] = torque
    end = em.World(scene).simulate(scene.pack(), 360, drives={"cube": drive}).states[-1]
    return np.linalg.norm(scene.unpack(end)["cube"]["angular_velocity"])


@pytest.mark.parametrize(
    ("pad", "lever"),
    [
        (em.Sphere(0.01), 0.004),
        # A corner at r slides as it twists: its friction is on one ellipsoid.
        (em.Box((0.02, 0.01, 0.01)), math.hypot(0.005, 0.005, 0.004)),
    ],
    ids=["ball", "box"],
)
def test_pad_that_is_fixed_to_a_finger_has_friction_of_its_own(pad, lever):
    most = 2 * lever * 20.0
    assert spin_in_pads(0.98 * most, pad) < 1e-2
    assert spin_in_pads(1.02 * most, pad) > 1.0


def test_a_problem_file_keeps_surfaces_and_frictions(tmp_path):
    scene = ball_on_table(
        table_velocity=(0.1, 0, 0),
        surface=em.Surface(
            torsional_friction=0.01,
            rolling_friction=2e-3,
            restitution=0.4,
            stiffness=2e3,
            damping=3,
        ),
    )
    scene.add_body("cup", em.Box((0.1,) * 3), mass=0.1, position=(1, 0, 0.05))
    scene.set_friction("cup", "ball", 0.3, torsional_friction=0.02, rolling_friction=0)
    captured = em.regions.Ball("ball", center=(0, 0, RADIUS), radius=0.1)
    state = scene.pack()
    problem = em.Problem(
        scene, state, force=(1, 1, 1), torque=(0, 0, 0), duration=0.1, captured=captured
    )
    path = tmp_path / "ball.json"
    problem.save(path)
    read = em.Problem.load(path).scene
    for pair in (("ball", "table"), ("cup", "ball"), ("cup", "table")):
        before, after = (of.contact_surface(*pair) for of in (scene, read))
        names = ("torsional_friction", "rolling_friction", "restitution", "stiffness", "damping")
        assert [getattr(before, name) for name in names] == [getattr(after, name) for name in names]
    assert read.contact_surface("cup", "ball").rolling_friction == 0
    assert read.bodies[0].surface_velocity.tolist() == [0.1, 0, 0]
    runs = [np.asarray(em.World(of).simulate(state, 60).states) for of in (scene, read)]
    assert np.array_equal(*runs)


def test_a_pair_keeps_what_another_coefficient_says_nothing_of():
    """As a belief about the pair's sliding friction does."""
    scene = ball_on_table()
    scene.set_friction("ball", "table", 0.3, torsional_friction=0.02)
    captured = em.regions.Ball("ball", center=(0, 0, RADIUS), radius=0.1)
    bounds = {"force": (1, 1, 1), "torque": (0, 0, 0), "duration": 0.1, "captured": captured}
    problem = em.Problem(scene, scene.pack(), **bounds)
    belief = em.Belief(problem, friction={"ball": {"table": 0.1}})
    for particle in belief.particles(4, seed=0).problems:
        surface = particle.scene.contact_surface("ball", "table")
        assert surface.torsional_friction == 0.02
        assert particle.scene.contact_friction("ball", "table") != 0.3


@pytest.mark.parametrize(
    "ball",
    [
        {"height": 0.4, "surface": em.Surface(restitution=0.8)},
        {"surface": em.Surface(torsional_friction=0.01), "angular_velocity": (0, 0, 9)},
        {"height": 0.06, "surface": em.Surface(stiffness=2e3, damping=3)},
    ],
)
def test_a_rollout_in_two_halves_is_the_one_in_one_go(ball):
    scene = ball_on_table(**ball)
    world = em.World(scene)
    whole = np.asarray(world.simulate(scene.pack(), 200).states)
    rest = np.asarray(world.simulate(whole[99], 100).states)
    assert np.abs(whole[-1] - rest[-1]).max() < 1e-10


@pytest.mark.parametrize("count", [5, 40])
def test_many_balls_bounce_each_at_its_time(count):
    """Of up to 32 bodies all pairs are kept, of more those that are near."""
    scene = em.Scene()
    scene.add_plane("ground")
    drops = 0.3 + 0.5 * np.random.default_rng(0).random(count)
    surface = em.Surface(restitution=0.9)
    for i, drop in enumerate(drops):
        at = (0.3 * i, 0, RADIUS + drop)
        scene.add_body(f"ball {i}", em.Sphere(RADIUS), mass=MASS, position=at, surface=surface)
    states = np.asarray(em.World(scene).simulate(scene.pack(), 200).states)
    for i, drop in enumerate(drops):
        heights = states[:, scene.slice(f"ball {i}")][:, 2]
        assert heights.min() > RADIUS - 3e-4
        assert peaks(heights)[0] == pytest.approx(0.81 * drop, rel=0.006)


def test_bouncing_adds_no_energy():
    drop = 0.7
    scene = ball_on_table(height=RADIUS + drop, surface=em.Surface(restitution=1.0))
    _, positions, _, _ = motion(scene, 20.0)
    assert peaks(positions[:, 2]).max() < drop * (1 + 2e-4)


def test_two_balls_part_with_a_share_of_their_speed():
    scene = em.Scene(gravity=(0, 0, 0))
    for name, x, speed in (("a", -0.5, 2.0), ("b", 0.0, 0.0)):
        at = {"position": (x, 0, 0), "velocity": (speed, 0, 0), "friction": 0.0}
        surface = em.Surface(restitution=0.8)
        scene.add_body(name, em.Sphere(RADIUS), mass=MASS, surface=surface, **at)
    end = scene.unpack(np.asarray(em.World(scene).simulate(scene.pack(), 120).states)[-1])
    assert end["a"]["velocity"][0] == pytest.approx(0.2, rel=1e-3)
    assert end["b"]["velocity"][0] == pytest.approx(1.8, rel=1e-3)


def test_work_of_belts_and_of_friction_that_turns_is_in_the_audit():
    surface = em.Surface(torsional_friction=0.01, rolling_friction=0.002)
    scene = ball_on_table(
        table_velocity=(0.5, 0.2, 0), surface=surface, angular_velocity=(0, 0, 20)
    )
    audit = em.World(scene).rollout(scene.pack(), np.zeros(6), 30, audit=True).audit
    assert audit.friction < 0 < audit.plan
    assert abs(audit.leftover) < 1e-3 * audit.turnover


@pytest.mark.parametrize("mass", [0.1, 2.0])
def test_dry_friction_stops_a_hinge(mass):
    """A wheel on a hinge slows down evenly, and stays."""
    friction, radius = 0.05, 0.1
    inertia = 0.5 * mass * radius**2
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("post", em.Box((0.01,) * 3), mass=0)
    wheel = em.Cylinder(radius, 0.02)
    scene.add_body("wheel", wheel, mass=mass, role="effector")
    start = 0.5 * friction / inertia
    scene.add_joint("hinge", parent="post", child="wheel", friction=friction, start_velocity=start)
    states = np.asarray(em.World(scene).simulate(scene.pack(), 240).states)
    layout = [scene.unpack(state)["joints"]["hinge"] for state in states]
    speeds = np.array([joint["velocity"] for joint in layout])
    times = np.arange(1, 241) / 240
    assert time_to_rest(times, speeds) == pytest.approx(0.5, rel=0.02)
    assert speeds[:100] == pytest.approx(start - friction / inertia * times[:100], rel=1e-3)
    assert abs(layout[-1]["velocity"]) < 1e-9 * start


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ({"restitution": 1.2}, "restitution is 1.2, expected at most 1"),
        ({"damping": 3.0}, "stiffness is 0, expected a stiffness above 0"),
        ({"rolling_friction": -1.0}, "rolling_friction is -1"),
        ({"stiffness": math.nan}, "stiffness is nan"),
    ],
)
def test_a_surface_that_cannot_be_is_refused(surface, message):
    with pytest.raises(ValueError, match=message):
        ball_on_table(surface=em.Surface(**surface))


def test_what_a_proof_does_not_know_of_surfaces_it_tells():
    scene = ball_on_table(surface=em.Surface(stiffness=2e3))
    scene.add_body("wall", em.Box((0.01, 0.1, 0.1)), mass=0, position=(0.07, 0, 0.05))
    captured = em.regions.Ball("ball", center=(0, 0, RADIUS), radius=0.1)
    problem = em.Problem(
        scene, scene.pack(), force=(1, 1, 1), torque=(0, 0, 0), duration=0.1, captured=captured
    )
    assert "gives way" in em.effort_lower_bound(problem).reason


def test_a_robot_of_bullet_has_its_contacts(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(
        """<robot name="r"><link name="a"><contact><lateral_friction value="0.8"/>
        <spinning_friction value="0.02"/><rolling_friction value="0.001"/><restitution value="0.3"/>
        <stiffness value="1000"/><damping value="5"/></contact>
        <inertial><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
        <link name="b"><inertial><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
        <dynamics friction="0.4"/></joint></robot>"""
    )
    scene = em.scenes.from_urdf(path)
    surface = scene.bodies[0].surface
    assert scene.bodies[0].friction == 0.8 and scene.joints[0].friction == 0.4
    assert (surface.torsional_friction, surface.rolling_friction) == (0.02, 0.001)
    assert (surface.restitution, surface.stiffness, surface.damping) == (0.3, 1000, 5)


def test_mujoco_gets_what_turns_and_refuses_what_bounces():
    mujoco = pytest.importorskip("mujoco")
    rough = ball_on_table(surface=em.Surface(torsional_friction=0.01))
    model = mujoco.MjModel.from_xml_string(em.mujoco.to_mjcf(rough))
    assert model.pair_dim.tolist() == [4]
    assert model.pair_friction[0, 2] == 0.01
    with pytest.raises(ValueError, match="'ball' gives way, bounces or moves"):
        em.mujoco.to_mjcf(ball_on_table(surface=em.Surface(restitution=0.5)))
