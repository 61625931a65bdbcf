"""What the viewer shows of problems with a horizon and a plan."""

import dataclasses
import json

import numpy as np
import pytest
from futures import STEP, carried, falling, resting, two_balls, waving
from pages import content_of

import energymargin as em
from energymargin.datasets import Future
from energymargin.evaluate.futures import undisturbed
from energymargin.evaluate.searches import SearchSettings
from energymargin.look.viewer import view
from energymargin.look.viewer.sources import replay, score_state, stored_scores
from energymargin.look.viewer.texts import NAMES, escape_text, future_text, score_table
from energymargin.store import score_dataset

SUCCESS = "probability/success"


def strong(problem):
    """The same with so much force that a short search finds a way out."""
    return problem.replace(force=(2.0, 2.0, 0.0))


@pytest.mark.parametrize(
    "problem",
    [
        strong(carried(0.3)),
        strong(waving(0.3)),
        strong(carried(0.3, plan=None)),
        carried(1.0),
        resting(dwell=0.05),
    ],
    ids=["held", "wrenches", "coasting", "by itself", "dwelling"],
)
def test_a_replay_follows_the_plan_to_the_trees_own_states(problem):
    escape = em.escape_effort(problem, nodes=200, seed=1)
    assert len(escape.path) > 1
    way = replay(problem, escape.tree, escape.path.tolist())
    assert np.array_equal(way.states[-1], escape.tree.states[escape.path[-1]])
    assert way.costs[-1] == escape.effort
    assert way.times[-1] == pytest.approx(escape.tree.times[escape.path[-1]])
    assert not problem.captured.contains(problem.scene, way.states[-1])


def test_a_replay_of_a_tasks_future_ends_in_the_trees_own_states():
    task = em.tasks.make("balance")
    trajectory = task.rollout(3)
    now = float(trajectory.times[2])
    problem = task.future(trajectory.states[2], now, trajectory.params, 0.6)
    tree = em.escape_effort(problem, nodes=100, seed=1).tree
    deepest = tree.path_to(int(np.argmax(np.where(np.arange(len(tree)) > 1, tree.times, 0.0))))
    assert len(deepest) > 2
    way = replay(problem, tree, deepest)
    assert np.array_equal(way.states[-1], tree.states[deepest[-1]])


def test_the_undisturbed_future_is_that_of_the_world_with_its_plan():
    problem = carried()
    future = undisturbed(problem)
    assert future.times[-1] == pytest.approx(problem.horizon)
    steps = round(problem.horizon / STEP)
    world = em.World(problem.scene, problem.plan)
    end = world.simulate(problem.state, steps).states[-1]
    assert np.array_equal(future.states[-1], end)
    assert np.array_equal(future.states[0], problem.state)


def test_its_exit_is_when_the_object_leaves_and_none_if_it_stays():
    problem = carried()
    future = undisturbed(problem)
    leaves = future.exit_moment
    inside = problem.captured.contains(problem.scene, future.states)
    assert inside[future.times < future.exit - 1e-9].all()
    assert leaves > 0 and not inside[leaves:].any()
    stays = undisturbed(resting())
    assert stays.exit is None and stays.exit_moment is None


def test_a_state_that_is_outside_leaves_at_once():
    elsewhere = em.regions.Ball("box", (1.0, 0, 0), 0.05)
    problem = carried().replace(captured=elsewhere, start_outside=True)
    future = undisturbed(problem)
    assert future.exit == 0.0 and future.exit_moment == 0
    scored = score_state(problem, SearchSettings(nodes=20))
    assert "It is out already" in escape_text(scored)


def test_a_problem_without_a_horizon_has_no_future():
    with pytest.raises(ValueError, match="without horizon and plan"):
        undisturbed(carried().replace(horizon=None, plan=None))


def test_a_state_with_a_horizon_is_scored_by_its_probability_and_effort_alone():
    problem = resting()
    shares = []
    scored = score_state(
        problem, SearchSettings(nodes=60, rollouts=40, seed=3), progress=shares.append
    )
    assert scored.capture is None and scored.force is None
    alone = em.capture_probability(problem, rollouts=40, seed=3)
    assert scored.probability.captured == alone.captured
    assert scored.escape.effort == em.escape_effort(problem, nodes=60, seed=3).effort
    assert scored.tree.states.shape[0] == scored.nodes + 1 == 62
    assert scored.values == {
        "probability": alone.captured,
        "probability/success": scored.probability.success,
    }
    assert all(0 <= share <= 1 for share in shares)


def test_its_table_has_each_probability_with_its_interval():
    scored = score_state(two_balls(), SearchSettings(nodes=20, rollouts=25))
    table = score_table(scored)
    found = scored.probability
    for name, which, value in (
        ("probability", "captured", found.captured),
        ("probability/any", "any", found.any.captured),
    ):
        low, high = found.interval(which=which)
        row = f">{NAMES[name]} ({low:.2f} to {high:.2f})</td>"
        assert f">{value:.3f}<" in table.partition(row)[2].partition("</tr>")[0]
    assert "25 rollouts" in table and "effort of escape" in table
    assert "capture score" not in table and "nodes" not in table


def test_the_text_names_horizon_plan_and_exit():
    problem = carried(check=1 / 120, dwell=0.05)
    future = undisturbed(problem)
    text = future_text(problem, future)
    for words in (
        "0.6 s",
        "0.00833 s",
        "at least 0.05 s",
        "velocities",
        "of pusher",
        f"undisturbed it leaves at {future.exit:.3g} s",
    ):
        assert words in text
    assert "undisturbed it stays captured" in future_text(resting(), undisturbed(resting()))
    assert "the effector coasts" in future_text(resting(), None)
    assert "cannot be simulated: too fast" in future_text(problem, None, why="too fast")


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=2, frames=5, seed=1)


@pytest.mark.parametrize("plan", ["script", "hold", None])
def test_the_states_of_a_dataset_are_asked_about_their_future(dataset, plan):
    future = Future(2, plan)
    page = view(dataset, trajectory=1, frame=2, every=2, future=future, nodes=20)
    for row, scored in zip((5, 7, 9), page.scored, strict=True):  # behind the script's end, too
        expected = dataset.problems([row], future=future)[0]
        assert scored.problem.to_json() == expected.to_json()
        assert (scored.problem.plan is None) == (plan is None)
        assert scored.probability.times[-1] == pytest.approx(expected.horizon)


@pytest.mark.parametrize("common", [False, True])
def test_live_probabilities_are_those_of_a_stored_run_whose_future_is_taken(
    dataset, tmp_path, common
):
    """The page does not have to be told of horizon, plan, rollouts and disturbance again."""
    path, future = tmp_path / "scores.db", Future(2, "hold")
    settings = SearchSettings(
        nodes=20, seed=5, rollouts=12, strength=2.0, common_random_numbers=common
    )
    score_dataset(
        dataset, path, ["probability", "probability/success"], settings=settings, future=future
    )
    page = view(dataset, trajectory=0, frame=1, scores=path)
    stored = stored_scores(path, dataset)
    ((_, values),) = stored.at(1)
    (scored,) = page.scored
    assert scored.values == values
    assert scored.probability.rollouts == 12
    text = score_table(scored, stored.at(1))
    assert text.count(f">{values['probability']:.3f}<") == 2
    assert "random wrenches within 2 times the bounds" in text


def test_another_future_than_that_of_the_scores_is_refused(dataset, tmp_path):
    path = tmp_path / "scores.db"
    score_dataset(dataset, path, ["force"], settings=SearchSettings(nodes=2))
    with pytest.raises(ValueError, match="the scores are about states as they are"):
        view(dataset, scores=path, future=Future(2))


def test_a_problem_takes_no_horizon_in_frames():
    with pytest.raises(ValueError, match=r"horizon is 2 frames.*problem.replace"):
        view(carried(), future=Future(2))


def test_a_frame_whose_future_cannot_be_posed_is_said():
    task = em.tasks.make("push")
    recorded = task.rollout(1, frames=3)
    dataset = em.datasets.Dataset("push", task.parameters, 0, [recorded])
    off = em.datasets.Dataset(
        "push", task.parameters, 0, [dataclasses.replace(recorded, times=recorded.times + 1e-3)]
    )
    view(dataset, future=Future(1), nodes=5)
    with pytest.raises(ValueError, match="expected 'hold' or None"):
        view(off, future=Future(1))


def test_the_page_of_a_problem_with_a_plan_plays_its_future_and_has_its_probability(tmp_path):
    problem = carried()
    problem.save(tmp_path / "carried.json")
    page = view(tmp_path / "carried.json", nodes=30)
    (scored,), (shot,) = page.scored, content_of(page)["shots"]
    future, found = undisturbed(problem), em.capture_probability(problem, rollouts=30)
    assert scored.probability.captured == found.captured
    assert scored.escape.effort == 0.0
    for words in ("undisturbed it leaves", "stays captured", "by itself", "undisturbed path"):
        assert words in shot["words"]
    track = next(one for one in shot["tracks"] if one["name"] == "undisturbed future")
    assert track["times"] == pytest.approx(future.times, abs=1e-4)
    assert track["times"][-1] == pytest.approx(problem.horizon) and "exit" in shot


def test_the_page_of_a_problem_without_a_horizon_has_no_future():
    page = view(carried().replace(horizon=None, plan=None), nodes=30)
    (shot,) = content_of(page)["shots"]
    assert page.scored[0].probability is None
    assert "capture score" in shot["words"] and "undisturbed" not in json.dumps(shot)


def test_the_page_says_why_a_capture_score_says_less_than_it_seems_to():
    page = view(falling(), nodes=300)
    warnings = page.scored[0].capture.warnings
    assert len(warnings) == 2  # one node has most of the likelihood, and it leaves by itself
    assert all(warning in content_of(page)["shots"][0]["words"] for warning in warnings)
    assert (
        score_state(carried(), SearchSettings(nodes=5)).capture is None
    )  # and so there is none to warn of


def test_scores_along_a_plan_have_the_profile_s_disturbance_and_its_efforts():
    pushes = em.disturbances.Gaussian(force=0.3, correlation_time=0.1)
    along = em.margin_profile(
        strong(carried(0.3)), ahead=0.1, rollouts=30, disturbance=pushes, nodes=50
    )
    assert 0.0 < along.weakest.probability < 1.0
    page = view(along)
    (scored,), (shot,) = page.scored, content_of(page)["shots"]
    assert scored.probability.captured == along.weakest.probability
    assert scored.escape.effort == along.efforts[along.weakest.number]
    for words in ("Gaussian(force=0.3", "scored now", "along the plan"):
        assert words in shot["words"]
