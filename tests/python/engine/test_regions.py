"""Sets of states that are large, deep or both: they work or are refused, and none ends Python."""

import json
import math

import numpy as np
import pytest

import energymargin as em


@pytest.fixture
def problem():
    scene = em.Scene()
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1.0, role="object")
    disc = em.regions.Disc("object", (0, 0), 0.5)
    return em.Problem(
        scene, scene.pack(), force=(1, 1, 0), torque=(0, 0, 0), duration=0.1, captured=disc
    )


def as_problem(problem, region):
    return em.Problem(
        problem.scene,
        problem.state,
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured=region,
    )


def nested(levels):
    region = em.regions.Disc("object", (0, 0), 0.5)
    for level in range(levels):
        far = em.regions.Ball("object", (9, 0, 0), 0.1 + level)
        region = region | far if level % 2 else region & ~far
    return region


def test_a_complement_of_a_complement_is_the_region_itself_however_often(problem):
    region = problem.captured
    for _ in range(100_000):
        region = ~region
    assert region.contains(problem.scene, problem.state)
    assert as_problem(problem, region).to_json() == problem.to_json()


def test_as_many_levels_as_a_file_has_are_evaluated_written_and_read(problem):
    deep = as_problem(problem, nested(63))
    again = em.Problem.from_json(deep.to_json())
    assert again.to_json() == deep.to_json()
    for x in (0.0, 3.0, 100.0):
        state = problem.scene.pack(object={"position": (x, 0, 0)})
        contains = [p.captured.contains(problem.scene, state) for p in (deep, again)]
        assert contains[0] == contains[1]


def test_more_levels_are_refused_as_they_are_built():
    with pytest.raises(ValueError, match=r"region is of 65 levels of & \| ~, expected at most 64"):
        nested(100_000)


def test_a_file_of_more_levels_is_refused_by_its_place(problem):
    file = json.loads(problem.to_json())
    for _ in range(65):
        file["captured"] = {"type": "not", "of": [file["captured"]]}
    with pytest.raises(
        ValueError, match=r'captured(\.of\[0\]){65} is .*at most 64 levels of "and"'
    ):
        em.Problem.from_json(json.dumps(file))


@pytest.mark.parametrize("operator", ["__and__", "__or__"])
def test_a_long_chain_is_one_level_and_is_evaluated_written_and_read(problem, operator):
    chain = problem.captured
    for _ in range(3000):
        chain = getattr(chain, operator)(problem.captured)
    saved = as_problem(problem, chain)
    assert len(json.loads(saved.to_json())["captured"]["of"]) == 3001
    again = em.Problem.from_json(saved.to_json())
    assert again.captured.contains(problem.scene, problem.state)
    assert em.capture_score(again, nodes=5).capture == em.capture_score(problem, nodes=5).capture


def test_a_region_that_doubles_with_each_step_is_refused_before_it_fills_the_memory(problem):
    region = problem.captured
    with pytest.raises(ValueError, match="made of 16384 primitives, expected at most 10000"):
        for _ in range(60):
            region = region & region


def test_predicates_that_ask_one_another_too_deep_are_refused(problem):
    regions = [problem.captured]
    for _ in range(100_000):
        regions.append(
            em.regions.Predicate(lambda states, of=regions[-1]: of.contains(problem.scene, states))
        )
    assert regions[64].contains(problem.scene, problem.state)
    for deeper in (65, 100_000):
        with pytest.raises(RuntimeError, match="ask one another 65 levels deep, expected at most"):
            regions[deeper].contains(problem.scene, problem.state)
    assert regions[64].contains(problem.scene, problem.state)


# The point whose position counts

CENTER = (0.0, 0.0, 0.2)  # of mass, in the frame of the hammer


def hammer():
    """A head at the end of a shaft: its frame is where the hand holds it."""
    scene = em.Scene(gravity=(0, 0, 0))
    inertial = em.Inertial(CENTER, inertia=np.diag([0.01, 0.01, 0.002]))
    shaft = em.Cylinder(radius=0.01, length=0.3)
    scene.add_body("hammer", shaft, mass=0.5, inertial=inertial, role="object")
    scene.add_body("post", em.Box((0.1, 0.1, 0.1)), mass=0, position=(9, 0, 0))
    return scene


def positional(**options):
    """Regions about a position, each of which holds it at (0, 0, 0) and not at (0, 0, 0.2)."""
    return [
        em.regions.Ball("hammer", (0, 0, 0), 0.1, **options),
        em.regions.Box("hammer", (0, 0, 0), (1, 1, 0.2), **options),
        em.regions.HalfSpace("hammer", (0, 0, 1), 0.1, **options)
        & em.regions.HalfSpace("hammer", (0, 0, -1), 0.1, **options),
    ]


def in_plane(**options):
    """The same where the hammer lies along x."""
    swept = {"half_width": 0.1, "behind": 0.1, "ahead": 1, "least_speed": 1, "disc_radius": 0.1}
    still = {"position": (0, 0), "velocity": (0, 0), "yaw_rate": 0}
    return [
        em.regions.Disc("hammer", (0, 0), 0.1, **options),
        em.regions.AnnularSector("hammer", (-1, 0), 1.0, 0.1, -1, 2, **options),
        em.regions.Swept("hammer", "post", **swept, at=still, **options),
    ]


@pytest.mark.parametrize("number", range(6))
def test_a_region_is_about_the_origin_or_the_centre_of_mass(number):
    scene = hammer()
    turn = {} if number < 3 else {"orientation": (0, math.sqrt(0.5), 0, math.sqrt(0.5))}
    along = np.array([0, 0, 0.2]) if number < 3 else np.array([0.2, 0, 0])
    there, before = (
        scene.pack(hammer={"position": place, **turn}) for place in ((0, 0, 0), -along)
    )
    default, origin, center = (
        (positional(**options) + in_plane(**options))[number]
        for options in ({}, {"point": "origin"}, {"point": "center_of_mass"})
    )
    for region, expected in ((default, [True, False]), (origin, [True, False])):
        assert [bool(region.contains(scene, state)) for state in (there, before)] == expected
    assert [bool(center.contains(scene, state)) for state in (there, before)] == [False, True]


def test_the_point_is_written_where_it_is_not_the_origin_and_read_again():
    scene = hammer()
    center = {"point": "center_of_mass"}
    half = em.regions.HalfSpace("hammer", (0, 0, 1), 0.1, **center)
    for region in (*positional(**center)[:2], half, *in_plane(**center)):
        problem = em.Problem(
            scene,
            scene.pack(),
            force=(1, 1, 0),
            torque=(0, 0, 0),
            duration=0.1,
            captured=region | em.regions.Ball("hammer", (0, 0, 0), 5.0),
        )
        of = json.loads(problem.to_json())["captured"]["of"]
        assert (of[0]["point"], "point" in of[1]) == ("center_of_mass", False)
        assert em.Problem.from_json(problem.to_json()).to_json() == problem.to_json()
    of[0]["point"] = "middle"
    file = json.loads(problem.to_json()) | {"captured": {"type": "or", "of": of}}
    with pytest.raises(ValueError, match=r'captured\.of\[0\].*"origin"'):
        em.Problem.from_json(json.dumps(file))


def test_a_push_that_turns_a_body_about_its_centre_of_mass_leaves_the_ball_about_its_origin():
    scene = hammer()
    state = scene.pack(hammer={"angular_velocity": (5, 0, 0), "velocity": (0, 1, 0)})
    end = em.World(scene).rollout(state, np.zeros(6), 0.3).state
    path = np.array(scene.unpack(end)["hammer"]["position"])
    for point, center in (("origin", (0, 0, 0)), ("center_of_mass", CENTER)):
        ball = em.regions.Ball("hammer", center, 0.01, point=point)
        assert ball.contains(scene, state)
        assert ball.contains(scene, end) == (point == "center_of_mass")
    assert np.linalg.norm(path) > 0.1


def test_a_point_that_is_none_and_that_of_a_fixed_body_are_refused_by_name():
    with pytest.raises(ValueError, match="point is 'com', expected 'origin' or 'center_of_mass'"):
        em.regions.Ball("hammer", (0, 0, 0), 1.0, point="com")
    scene = hammer()
    post = em.regions.Disc("post", (0, 0), 1.0, point="center_of_mass")
    with pytest.raises(ValueError, match="'center_of_mass' of 'post', which is fixed, expected 'o"):
        post.contains(scene, scene.pack())
