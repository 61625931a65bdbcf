"""What the viewer shows of problems with a horizon and a plan."""

import dataclasses
import time

import numpy as np
import pytest
from futures import STEP, carried, falling, resting, two_balls, waving

import energymargin as em
from energymargin.datasets import Future
from energymargin.evaluate.futures import undisturbed
from energymargin.evaluate.searches import SearchSettings
from energymargin.look.viewer import view
from energymargin.look.viewer.search import replay, score_state
from energymargin.look.viewer.sources import profile_scores
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
    assert not scored.empty
    assert escape_text(scored).count("It is out already") == 1


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
    assert scored.complete and scored.tree.states.shape[0] == scored.nodes + 1 == 62
    values = scored.values(5, rate=7.0)
    assert values == {
        "probability": alone.captured,
        "probability/success": scored.probability.success,
    }
    assert all(0 <= share <= 1 for share in shares)


def test_its_table_has_each_probability_with_its_interval():
    scored = score_state(two_balls(), SearchSettings(nodes=20, rollouts=25))
    table = score_table(scored, 20, 5.0)
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


def test_a_search_that_is_stopped_at_once_is_empty_and_not_shown():
    cancel = em.Cancel()
    cancel.set()
    problem = resting()
    scored = score_state(problem, SearchSettings(nodes=50), None, cancel)
    assert scored.empty and not scored.complete
    with view(problem) as viewer:
        viewer.page._keep(0, 0, scored)
        assert viewer.page.scored is None


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
        f"undisturbed it leaves at {future.exit:.2f} s",
    ):
        assert words in text
    assert "undisturbed it stays captured" in future_text(resting(), undisturbed(resting()))
    assert "the effector coasts" in future_text(resting(), None)
    assert "cannot be simulated: too fast" in future_text(problem, None, why="too fast")


def test_the_page_of_a_problem_with_a_plan_offers_its_future_and_its_probability():
    with view(carried(), nodes=30) as viewer:
        page, panel = viewer.page, viewer.page._panel
        page.wait()
        assert "undisturbed it leaves" in panel.future_text.content
        assert not panel.future.button.disabled
        assert panel.future.slider.max == len(page._future.times) - 1
        assert panel.rollouts.visible and not panel.rate.visible
        assert panel.shown["undisturbed path"].visible
        nodes = viewer._server.scene._handle_from_node_name
        assert {"/undisturbed_path/0", "/undisturbed_path/diamond"} <= set(nodes)  # line and exit
        page.score()
        page.wait()
        assert page.scored.probability.rollouts == 30
        assert "stays captured" in panel.scores.content
        assert page.scored.escape.effort == 0.0
        assert "by itself" in panel.escape_text.content
        assert "undisturbed path" in panel.legend.content
        assert np.array_equal(panel._curve.data[1], page.scored.probability.curve)


def test_the_page_of_a_problem_without_a_horizon_is_as_before():
    with view(carried().replace(horizon=None, plan=None), nodes=30) as viewer:
        viewer.page.score()
        viewer.page.wait()
        panel = viewer.page._panel
        assert not panel.rollouts.visible and panel.rate.visible
        assert not panel.shown["undisturbed path"].visible
        assert viewer.page.scored.probability is None
        assert "capture score" in panel.scores.content
        assert "undisturbed" not in panel.legend.content


def test_the_slider_of_the_future_moves_the_bodies_and_its_text():
    with view(carried()) as viewer:
        page, panel = viewer.page, viewer.page._panel
        page.wait()
        last = len(page._future.times) - 1
        panel.future.slider.value = last
        panel.future.draw()  # as a move by hand does
        assert "0.60 s ahead" in panel.future_text.content
        where = page._stage._bodies._moving["pusher"].position
        assert where == pytest.approx(page._future.states[last, 13:16], abs=1e-6)


def test_a_replay_of_the_future_ends_at_the_horizon():
    with view(carried(0.2)) as viewer:
        page = viewer.page
        page.wait()
        page._play(page._panel.future)
        page._panel.future.join()
        assert page._panel.future.slider.value == len(page._future.times) - 1
        assert page._panel.future.button.label == "Replay the future"


def test_a_problem_file_with_a_plan_is_viewed_with_it(tmp_path):
    carried().save(tmp_path / "carried.json")
    with view(tmp_path / "carried.json") as viewer:
        viewer.page.wait()
        assert viewer.page._future.exit == undisturbed(carried()).exit


@pytest.fixture(scope="module")
def dataset():
    return em.datasets.generate("push", trajectories=2, frames=5, seed=1)


def scored_page(viewer):
    viewer.page.score()
    viewer.page.wait()
    return viewer.page


@pytest.mark.parametrize("plan", ["script", "hold", None])
def test_the_states_of_a_dataset_are_asked_about_their_future(dataset, plan):
    future = Future(2, plan)
    with view(dataset, trajectory=1, frame=2, future=future) as viewer:
        problem = viewer.page._problem
        assert problem.to_json() == dataset.problems([7], future=future)[0].to_json()
        assert (problem.plan is None) == (plan is None)
        viewer.page._panel.frame.value = 4  # behind the end of the script, too
        end = time.monotonic() + 30
        while viewer.page._frame != 4 and time.monotonic() < end:
            time.sleep(0.01)
        page = scored_page(viewer)
        assert page.scored.probability.times[-1] == pytest.approx(page._problem.horizon)


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
    with view(dataset, trajectory=0, frame=1, scores=path) as viewer:
        page = scored_page(viewer)
        ((_, stored),) = page._stored.at(1)
        assert page.scored.values(1, 1.0) == stored
        assert page.scored.probability.rollouts == 12
        text = page._panel.scores.content
        assert text.count(f">{stored['probability']:.3f}<") == 2
        assert "random wrenches within 2 times the bounds" in text
        assert np.array_equal(page._along()["probability"], page._stored.curves["probability"][:5])


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
    view(dataset, future=Future(1)).close()
    with pytest.raises(ValueError, match="expected 'hold' or None"):
        view(off, future=Future(1))


def test_the_page_says_why_a_capture_score_says_less_than_it_seems_to():
    with view(falling(), nodes=300) as viewer:
        page = scored_page(viewer)
        warnings = page.scored.capture.warnings
        assert len(warnings) == 2  # one node has most of the likelihood, and it leaves by itself
        assert all(warning in page._panel.scores.content for warning in warnings)
    assert (
        score_state(carried(), SearchSettings(nodes=5)).capture is None
    )  # and so there is none to warn of


def test_scores_along_a_plan_have_the_alongs_disturbance_its_intervals_and_its_efforts():
    pushes = em.disturbances.Gaussian(force=0.3, correlation_time=0.1)
    along = em.margin_profile(
        strong(carried(0.3)), ahead=0.1, rollouts=30, disturbance=pushes, nodes=50
    )
    assert 0.0 < along.weakest.probability < 1.0
    with view(along, frame=along.weakest.number) as viewer:
        page = scored_page(viewer)
        assert page.scored.probability.captured == along.weakest.probability
        text = page._panel.scores.content
        assert "Gaussian(force=0.3" in text
        assert "scored now" in text and "along the plan" in text
        times, probability, low, high, now = page._panel._plot.data
        assert np.array_equal(times, along.times)
        assert np.array_equal(
            [probability, low, high], [along.probabilities, along.low, along.high]
        )
        assert np.flatnonzero(~np.isnan(now)).tolist() == [along.weakest.number]
        finite = np.isfinite(along.efforts)
        assert finite.any() and page._panel._efforts.visible
        assert np.array_equal(page._panel._efforts.data[1][finite], along.efforts[finite])
        low, high = page._panel._efforts.scales["y"]["range"]
        assert low == 0.0 and along.efforts[finite].max() < high


def test_scores_that_an_along_has_not_are_no_curves():
    along = em.margin_profile(carried(0.3), ahead=0.1, rollouts=5, effort=False)
    assert list(profile_scores(along).curves) == ["probability", "low", "high"]
    with view(along) as viewer:
        assert not viewer.page._panel._efforts.visible
    successful = carried(0.3, succeeded=em.regions.Ball("box", (0.1, 0.0, 0.0), 0.05))
    for problem, names in ((carried(), ["probability"]), (successful, ["probability", SUCCESS])):
        with view(problem) as viewer:
            assert viewer.page._panel.curves == names
