"""Beliefs: what is drawn of them, and what it makes of a problem."""

import json

import numpy as np
import pytest
from boxes import HALF, problem, scene
from scipy import stats
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.beliefs import Uncertainty


def drawn(belief, count=64, seed=0):
    """The particles, and object and effector of each, unpacked."""
    particles = belief.particles(count, seed=seed)
    return particles, [one.scene.unpack(one.state) for one in particles.problems]


def values(particles, body, name):
    """A property of a body in each particle's scene."""
    found = [{b.name: b for b in one.scene.bodies}[body] for one in particles.problems]
    return np.array([getattr(one, name) for one in found])


def test_a_deviation_of_friction_or_mass_is_about_the_problems_own():
    particles, _ = drawn(em.Belief(problem(), friction=0.05, mass={"effector": 0.1}), 256)
    friction, mass = values(particles, "object", "friction"), values(particles, "effector", "mass")
    assert (friction.mean(), friction.std()) == pytest.approx((0.4, 0.05), abs=0.002)
    assert (mass.mean(), mass.std()) == pytest.approx((1.0, 0.1), abs=0.004)
    assert set(values(particles, "object", "mass")) == {0.5}
    assert set(values(particles, "floor", "friction")) == {0.6}


def test_a_distribution_of_friction_is_of_the_coefficient_itself():
    belief = em.Belief(problem(), friction={"floor": stats.uniform(0.2, 0.1)})
    particles, _ = drawn(belief, 128)
    friction = values(particles, "floor", "friction")
    assert np.abs(np.sort(friction) - np.linspace(0.2, 0.3, 128)).max() < 0.003
    assert particles.values(particles.sources[0])[:, 0] == pytest.approx(friction, abs=0)


def test_the_friction_of_a_surface_is_drawn_as_that_of_a_body():
    posed = problem()
    given = {"floor": stats.uniform(0.001, 0.002)}
    belief = em.Belief(posed, torsional_friction=given, rolling_friction={"object": 1e-4})
    assert [source.name for source in belief.sources] == [
        "torsional_friction of floor",
        "rolling_friction of object",
    ]
    particles = belief.particles(64)
    surfaces = [
        {body.name: body.surface for body in one.scene.bodies} for one in particles.problems
    ]
    torsional = np.array([of["floor"].torsional_friction for of in surfaces])
    assert torsional.min() >= 0.001
    assert torsional.max() <= 0.003
    assert np.mean(torsional) == pytest.approx(0.002, abs=1e-4)
    rolling = [of["object"].rolling_friction for of in surfaces]
    assert min(rolling) >= 0.0
    assert np.std(rolling) > 2e-5
    assert particles.redrawn > 10  # about 0, half of a normal distribution is below it


def paired(coefficient=0.3):
    own = scene()
    own.set_friction("floor", "object", coefficient)
    return problem().replace(scene=own)


def test_a_pair_with_a_coefficient_of_its_own_is_named_as_a_pair():
    for friction in ({"object": {"floor": 0.05}}, {"floor": {"object": stats.norm(0.3, 0.05)}}):
        belief = em.Belief(paired(), friction=friction)
        (source,) = belief.sources
        particles = belief.particles(256)
        pairs = [one.scene.pair_frictions[("floor", "object")] for one in particles.problems]
        assert (np.mean(pairs), np.std(pairs)) == pytest.approx((0.3, 0.05), abs=0.002)
        assert particles.values(source)[:, 0] == pytest.approx(pairs, abs=0)
        assert source.name == "friction of floor and object"
        assert set(values(particles, "object", "friction")) == {0.4}
        again = Uncertainty.from_json(belief.uncertainty.to_json())
        assert again == belief.uncertainty
    slides = em.Belief(paired(), friction={"floor": {"object": stats.uniform(0.0, 0.4)}})
    asked = [p.replace(force=(1, 0, 0), horizon=0.5) for p in slides.particles(16).problems]
    found = [em.capture_probability(one, rollouts=8).mean_time for one in asked]
    assert len(set(found)) > 1


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        (
            0.1,
            "friction names the body 'object', whose coefficient with 'floor' was set for",
        ),
        ({"floor": 0.1}, r"'floor', whose .* expected {'object': {'floor': ...}} too, 0 if that"),
        (
            {"effector": {"floor": 0.1}},
            "'effector' and 'floor', which has no coefficient",
        ),
        ({"object": {"floor": -0.1}}, r"friction\['object'\]\['floor'\] is -0.1"),
        (
            {"object": {"floor": 0.1}, "floor": {"object": 0.1}},
            "the pair 'floor' and 'object' twice, expected it once",
        ),
        ({"object": {"object": 0.1}}, "the pair 'object' and 'object', which has no coefficient"),
        ({"object": {}}, r"friction\['object'\] is {}, expected names of bodies"),
        ({"object": {"floor": {"wall": 1}}}, r"\['floor'\] is .*expected that of a pair"),
    ],
)
def test_a_friction_that_would_change_nothing_is_refused(friction, words):
    with pytest.raises(ValueError, match=words):
        em.Belief(paired(), friction=friction)


def test_a_body_whose_pair_is_named_may_have_a_friction_of_its_own():
    belief = em.Belief(paired(), friction={"floor": 0.1, "object": {"floor": 0}})
    assert [source.name for source in belief.sources] == ["friction of floor"]


def test_errors_of_a_pose_are_along_and_about_the_worlds_axes():
    start = scene().pack(object={"position": (0.3, 0, 1), "yaw": np.pi / 2, "velocity": (0, 0, 1)})
    deviations = (0.02, 0, 0, 0.1, 0, 0)
    particles, found = drawn(em.Belief(problem(state=start), pose=deviations), 128)
    errors = particles.values(particles.sources[0])
    assert errors.std(axis=0) == pytest.approx(deviations, rel=0.05)
    for state, error in zip(found, errors, strict=True):
        body = state["object"]
        assert body["position"] == pytest.approx((0.3 + error[0], 0, 1))
        turned = Rotation.from_rotvec(error[3:]) * Rotation.from_euler("z", np.pi / 2)
        assert (turned.inv() * Rotation.from_quat(body["orientation"])).magnitude() < 1e-9
    assert particles.separated == particles.redrawn == 0


def test_a_covariance_is_that_of_the_errors():
    root = np.random.default_rng(3).normal(size=(6, 3)) / 100
    particles, found = drawn(em.Belief(problem(), velocity={"effector": root @ root.T}), 1024)
    twists = [
        np.concatenate([s["effector"]["velocity"], s["effector"]["angular_velocity"]])
        for s in found
    ]
    assert np.cov(np.transpose(twists)) == pytest.approx(root @ root.T, abs=5e-6)
    assert len(particles.sources[0].inputs) == 3


def test_each_object_has_errors_of_its_own_unless_bodies_are_named():
    two = scene()
    two.add_body("cup", em.Sphere(0.05), mass=1, position=(0, 1, 0.05), role="object")
    posed = em.Problem(
        two,
        two.pack(),
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.2,
        captured=em.regions.Ball("cup", (0, 1, 0.05), 0.1),
    )
    assert [s.name for s in em.Belief(posed, friction=0.1).sources] == [
        "friction of object",
        "friction of cup",
    ]
    one = em.Belief(posed, friction={"floor": 0.1}, velocity={"effector": (0.1,) * 6})
    assert [s.name for s in one.sources] == ["friction of floor", "velocity of effector"]


def test_fewer_particles_are_the_first_of_more_and_a_seed_is_a_draw():
    belief = em.Belief(problem(), friction=0.1, pose=(0.01, 0.01, 0, 0, 0, 0.1))
    few, many, other = (belief.particles(n, seed=s) for n, s in ((5, 0), (40, 0), (5, 1)))
    assert [p.to_json() for p in few.problems] == [p.to_json() for p in many.problems[:5]]
    assert not np.isclose(few.points, other.points).any()


def test_what_is_known_exactly_is_the_problem_itself():
    own = problem()
    belief = em.Belief(own, friction=0, pose=(0,) * 6)
    assert belief.sources == []
    assert {p.to_json() for p in belief.particles(3).problems} == {own.to_json()}


def test_particles_that_overlap_are_parted_and_counted():
    belief = em.Belief(problem(wall=HALF + 0.005), pose=(0.01, 0, 0, 0, 0, 0))
    particles, found = drawn(belief)
    errors = particles.values(particles.sources[0])[:, 0]
    places = np.array([state["object"]["position"][0] for state in found])
    assert particles.separated == (errors > 0.005 + 0.01 * HALF).sum() > 10
    assert places.max() < 0.005 + 0.01 * HALF + 1e-9
    free = errors < 0.005
    assert places[free] == pytest.approx(errors[free]) and particles.redrawn == 0


def test_particles_without_a_place_are_drawn_again_and_counted():
    """The wall behind the object leaves room on one side alone, and it may not move off."""
    between = scene(wall=HALF + 0.002)
    between.add_body("post", em.Box((0.1, 1, 0.1)), mass=0, position=(-0.102, 0, 0.05))
    posed = problem().replace(scene=between)
    belief = em.Belief(posed, pose=(0.001, 0, 0, 0, 0, 0.1))
    particles, found = drawn(belief, 16)
    assert particles.redrawn > 0 and len(particles) == 16
    yaws = [abs(state["object"]["yaw"]) for state in found]
    assert max(yaws) < 0.06  # of a deviation of 0.1 rad
    with pytest.raises(ValueError, match="draws of the belief have no place"):
        em.Belief(posed, pose=(0, 0, 0, 0, 0, stats.uniform(0.5, 0.1))).particles(2)


def test_a_friction_below_zero_is_drawn_again_and_counted():
    particles, _ = drawn(em.Belief(problem(), friction=stats.norm(0.0, 0.1)))
    assert values(particles, "object", "friction").min() >= 0
    assert particles.redrawn == pytest.approx(64, abs=4)


def test_a_question_is_posed_about_each_particles_state():
    task = em.tasks.make("push", friction=0.3)
    state = task.rollout(seed=0).states[3]
    params = {"friction": 0.3}
    belief = em.Belief(
        task.problem(state, params),
        velocity={"effector": (0.1, 0.1, 0, 0, 0, 0)},
        friction={"table": 0.02},
        question=lambda own: task.problem(own, params),
    )
    for one in belief.particles(4).problems:
        own = task.problem(np.asarray(one.state), params)
        table = next(b.friction for b in one.scene.bodies if b.name == "table")
        assert json.loads(one.to_json())["captured"] == json.loads(own.to_json())["captured"]
        assert table != 0.3


UNCERTAINTIES = [
    {"friction": 0.1},
    {"friction": {"floor": stats.uniform(0.2, scale=0.3)}, "mass": stats.lognorm(0.1)},
    {"rolling_friction": 1e-4, "torsional_friction": {"floor": stats.uniform(0.0, 0.01)}},
    {"pose": [0.1, 0, 0, 0, 0, stats.norm(0, 0.2)], "velocity": np.eye(6)},
    {"pose": {"object": np.eye(6).tolist(), "effector": (0.1,) * 6}},
]


@pytest.mark.parametrize("given", UNCERTAINTIES)
def test_an_uncertainty_is_written_and_read(given):
    one = Uncertainty(**given)
    text = one.to_json()
    again = Uncertainty.from_json(text)
    assert again == one and hash(again) == hash(one) and again.to_json() == text
    assert again != Uncertainty(friction=0.2)
    drawn_of = [em.Belief(problem(), uncertainty=u).particles(4) for u in (one, again)]
    assert [p.to_json() for p in drawn_of[0].problems] == [
        p.to_json() for p in drawn_of[1].problems
    ]


class Steps(stats.rv_continuous):
    """A distribution of a user's own."""

    def _ppf(self, q):
        return np.where(q < 0.5, 0.2, 0.4)


@pytest.mark.parametrize(
    "friction",
    [
        Steps(name="norm")(),
        Steps()(),
        stats.rv_discrete(name="poisson", values=([0, 1], [0.5, 0.5]))(),
        stats.rv_histogram(np.histogram([0.2, 0.4], bins=2))(),
    ],
)
def test_a_distribution_of_ones_own_has_no_text_whatever_its_name(friction):
    one = Uncertainty(friction=friction)
    assert len(em.Belief(problem(), uncertainty=one).particles(4).problems) == 4
    with pytest.raises(ValueError, match=r"expected a frozen one of scipy.stats"):
        one.to_json()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "nothing is uncertain, expected one at least of friction, mass, pose, velocity"),
        ({"friction": -0.1}, "friction is -0.1, expected a finite number of at least 0"),
        ({"friction": "some"}, "a standard deviation, or a frozen distribution of scipy.stats"),
        ({"mass": {"object": np.nan}}, r"mass\['object'\] is nan"),
        ({"mass": {}}, "mass is {}, expected names of bodies"),
        ({"pose": 0.1}, "pose is 0.1, expected six standard deviations"),
        ({"pose": (0.1, 0, 0)}, "expected six standard deviations"),
        ({"velocity": (0, 0, 0, 0, -1, 0)}, "velocity, rate about y, is -1"),
        ({"pose": np.eye(3)}, r"expected a covariance \(6, 6\)"),
        ({"pose": -np.eye(6)}, "pose is no covariance, expected a symmetric matrix"),
        ({"pose": np.triu(np.ones((6, 6)))}, "pose is no covariance"),
    ],
)
def test_what_cannot_be_uncertain_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        em.Belief(problem(), **given)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"friction": {"cup": 0.1}},
            "friction names the body 'cup', expected one of floor, object",
        ),
        ({"mass": {"floor": 0.1}}, "mass names the body 'floor', which is fixed"),
        ({"pose": {"floor": (0.1,) * 6}}, "pose names the body 'floor', which is fixed"),
        ({"friction": 0.1, "uncertainty": Uncertainty(mass=0.1)}, "uncertainty and friction are"),
    ],
)
def test_bodies_and_arguments_that_do_not_fit_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        em.Belief(problem(), **given)


def test_pose_of_a_body_that_a_loop_ties_is_refused():
    scene = em.Scene()
    scene.add_body("post", em.Sphere(0.01), mass=0)
    scene.add_body("bag", em.Sphere(0.1), mass=1, position=(0, 0, -0.2), role="object")
    scene.add_loop("post", "bag", point_b=(0, 0, 0.2))
    around = em.regions.Ball("bag", center=(0, 0, -0.2), radius=0.1)
    wrench = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1}
    hanging = em.Problem(scene, scene.pack(), captured=around, **wrench)
    assert em.Belief(hanging, mass=0.1)
    for quantity in ("pose", "velocity"):
        with pytest.raises(ValueError, match=f"{quantity} names the body 'bag', which a loop ties"):
            em.Belief(hanging, **{quantity: (0.1,) * 6})


def test_other_bad_arguments_are_refused():
    with pytest.raises(ValueError, match="problem is 3, expected a Problem"):
        em.Belief(3, friction=0.1)
    belief = em.Belief(problem(), friction=0.1)
    with pytest.raises(ValueError, match="count is 0"):
        belief.particles(0)
    with pytest.raises(ValueError, match="seed is -1"):
        belief.particles(1, seed=-1)
    with pytest.raises(ValueError, match="expected a frozen one"):
        Uncertainty(mass=stats.rv_histogram(np.histogram([1, 2, 3]))).to_json()
    for text, words in (
        ("{", "expected JSON"),
        ('{"colour": 1}', "uncertainty has 'colour', expected some of friction"),
        ('{"mass": {"distribution": "nothing"}}', "distribution is 'nothing', expected the name"),
    ):
        with pytest.raises(ValueError, match=words):
            Uncertainty.from_json(text)
