"""The study of policies in the loop, at a small size: its LQR, its plans, what it leaves out."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import energymargin as em
from energymargin._core import Cancel
from energymargin_paper.evidence import (
    policies,
    policies_fetch as fetch,
    policies_learned as learned,
    policies_loops as loops,
    policies_lqr as lqr,
    policies_pusht as pusht,
    policies_told as asked_of_others,
)
from energymargin_paper.evidence.act import demo_of

SMALL = policies.Settings(
    parts=("learned", "fetch"), rollouts=2, worlds=1, episodes=2, questions=2, seed=3
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("policies")
    return policies.STUDY.reproduce(SMALL, folder, threads=2), folder


def test_each_part_has_a_section_and_the_picture_shows_it(made):
    result, folder = made
    text = result.to_markdown()
    assert "## A learned policy" in text and "## FetchPush" in text and "seed 3" in text
    [(name, figure)] = policies.STUDY.figures(result)
    figure.savefig(folder / name, dpi=50)
    assert (folder / name).stat().st_size > 5_000
    for one in result.found["fetch"].values():
        assert 0 <= one[asked_of_others.LOOP] <= 1


def test_it_goes_on_from_the_cases_that_it_has(made):
    result, folder = made
    before = (folder / policies.CASES_FILE).read_text()
    again = policies.STUDY.reproduce(SMALL, folder)
    assert (folder / policies.CASES_FILE).read_text() == before
    assert again.to_csv() == result.to_csv() == (folder / "policies.csv").read_text()


@pytest.mark.parametrize(
    ("part", "package"), [(fetch, "energymargin[fetch]"), (pusht, "gym-pusht")]
)
def test_a_part_whose_package_is_missing_says_how_to_install_it(
    part, package, tmp_path, monkeypatch
):
    monkeypatch.setattr(asked_of_others, "find_spec", lambda _: None)
    name = part.__name__.rsplit("_", 1)[1]
    settings = policies.Settings(parts=(name,))
    text = policies.STUDY.reproduce(settings, tmp_path).to_markdown()
    assert "Left out" in text and "pip install" in text and package in text


def test_an_lqr_of_a_ball_on_a_rail_is_that_of_riccati():
    scene = em.Scene(gravity=(0, 0, 0))
    axis = {"linear_factor": (1, 0, 0), "angular_factor": (0, 0, 0)}
    scene.add_body("ball", em.Sphere(0.05), mass=2.0, role="object", **axis)
    bounds = {"force": (1, 0, 0), "torque": (0, 0, 0), "duration": 0.1, "horizon": 4.0}
    plan = em.Plan(1 / 240, wrenches={"ball": np.zeros((960, 6))})
    near = em.regions.Ball("ball", (0, 0, 0), 0.1)
    problem = em.Problem(scene, scene.pack(), captured=near, plan=plan, **bounds)
    law = lqr.Law(("ball.x", "ball.vx"), {"ball.fx": 2.0}, 0.05, {"ball.x": 0.1, "ball.vx": 0.5})
    gains = lqr.tracking(problem, law)
    a, b = np.array([[1, 0.05], [0, 1]]), np.array([[0.05**2 * (1 + 1 / 12) / 2 / 2], [0.05 / 2]])
    weights, effort = np.diag([100.0, 4.0]), np.array([[0.25]])
    cost = solve_discrete_are(a, b, weights, effort)
    wanted = np.linalg.solve(effort + b.T @ cost @ b, b.T @ cost @ a)
    assert gains.shape == (80, 1, 2)
    assert gains[0] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@pytest.mark.parametrize("task", loops.STARTS)
def test_a_feedback_along_a_plan_does_nothing_where_nothing_disturbs_it(task):
    demo = demo_of(task)
    problem = demo.problem(demo.nominal)
    law = loops.LQR[task]
    strong = np.full((len(law.commands), len(law.observed)), 0.1)
    closed = lqr.followed(problem, law, strong)
    ends = [
        np.asarray(em.World(problem.scene, p).simulate(problem.state, 120).states)[-1]
        for p in (problem.plan, closed)
    ]
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


def test_a_controller_is_told_and_run_in_held_out_worlds():
    small = policies.Settings(rollouts=1, worlds=2)
    one = loops.run("balance 2 LQR", small, Cancel())
    assert 0 <= one["told"] <= 1 and len(one["lost"]) == 2


def test_a_better_controller_that_was_told_counts_as_right():
    better = {"plan": (0.5, [True, True]), "LQR": (0.9, [False] * 2), "impedance": (0.7, [0, 1])}
    found = {}
    for case in loops.cases(SMALL):
        told, lost = better[case.split()[2]]
        found[case] = {"told": told, "interval": (0, 1), "effort": told, "lost": lost}
    assert loops.report(SMALL, found).count("**36 of 36**") == 2


def test_what_the_policy_does_undisturbed_leads_where_it_does():
    network = learned.trained(0)
    task, params, start = learned._begun(5)
    scene, steps = task.scene(params), 10 * learned.FRAME * learned.AHEAD
    ends = [
        np.asarray(em.World(scene, plan).simulate(start, steps).states)[-1]
        for plan in (learned.in_the_loop(network), learned.replayed(scene, start, network))
    ]
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)


def test_the_network_does_what_its_expert_does():
    network, task = learned.trained(0), learned.PushTask()
    seen = learned.observe(np.concatenate([task.rollout(seed=s).states[:5] for s in range(20)]))
    assert np.abs(network(seen) - learned.expert(seen)).mean() < 1.0


def test_pusht_is_in_our_scene_what_it_is_there():
    """The agent's plan leads where its policy does, and pushes the T ahead."""
    scene = pusht.scene_of()
    state = scene.pack(
        T={"position": (0.256, 0.1, 0.0), "yaw": 0.2}, agent={"position": (0.27, 0.035, 0.0)}
    )
    near = em.regions.Ball("T", (0, 0, 0), pusht.NEAR, frame="agent")
    asked = em.Problem(
        scene, state, captured=near, force=(1, 1, 0), torque=(0, 0, 0), duration=0.2, horizon=3.0
    )
    loop = pusht.in_the_loop(scene, 60.0)
    ends = [
        np.asarray(em.World(scene, plan).simulate(state, 600).states)[-1]
        for plan in (loop, pusht.replayed(asked, 60.0))
    ]
    assert ends[1] == pytest.approx(ends[0], abs=1e-3)
    assert ends[0][1] > 0.15
