"""Sets of states that are large, deep or both: they work or are refused, and none ends Python."""

import json

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
