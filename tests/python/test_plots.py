import matplotlib.colors
import numpy as np
import pytest
from matplotlib.figure import Figure

from energymargin import capture_score, plots, tasks


@pytest.fixture(scope="module")
def task():
    return tasks.make("push", friction=0.3)


@pytest.fixture(scope="module")
def trajectory(task):
    return task.rollout(seed=0, frames=4)


@pytest.fixture(scope="module")
def drawn(task, trajectory):
    problem = task.problem(trajectory.states[0])
    score = capture_score(problem, nodes=40, seed=0)
    ax = Figure().subplots()
    plots.plot_state(problem, score, ax, limits=((-1, 3), (-1, 2)))
    return problem, score, ax


def filled_area(ax, color):
    """Area [m^2] of the cells of one colour."""
    for image in ax.images:
        if image.get_cmap()(0.0)[:3] == pytest.approx(matplotlib.colors.to_rgb(color)):
            left, right, bottom, top = image.get_extent()
            cells = image.get_array()
            return (~np.ma.getmaskarray(cells)).mean() * (right - left) * (top - bottom)
    raise AssertionError("nothing is filled in that colour")


def test_every_node_is_a_dot_where_the_box_got_coloured_by_its_cost(drawn):
    problem, score, ax = drawn
    (dots,) = (dots for dots in ax.collections if dots.get_array() is not None)
    start = problem.scene.slice("object").start
    assert np.allclose(dots.get_offsets(), score.tree.states[:, start : start + 2])
    assert np.array_equal(dots.get_array(), score.tree.costs)


def test_a_cross_marks_each_node_outside_of_the_capture_set(drawn):
    problem, score, ax = drawn
    crosses = ax.collections[-1].get_offsets()
    outside = ~problem.captured.contains(problem.scene, score.tree.states)
    start = problem.scene.slice("object").start
    assert outside.any()
    assert np.allclose(crosses, score.tree.states[outside, start : start + 2])


def test_a_spatial_task_is_drawn_from_the_side_with_all_its_links():
    task = tasks.make("grasp", friction=0.5)
    problem = task.problem(task.scene({"friction": 0.5, "clench": 1.0}).pack())
    score = capture_score(problem, nodes=5, seed=0)
    ax = Figure().subplots()
    plots.plot_state(problem, score, ax, plane=task.plane, ghosts=0)
    outlines = [patch for patch in ax.patches if not patch.get_fill()]
    assert len(outlines) == len(problem.scene.bodies)
    assert ax.get_ylabel() == "z [m]"
    (dots,) = (dots for dots in ax.collections if dots.get_array() is not None)
    start = problem.scene.slice("object").start
    assert np.allclose(dots.get_offsets(), score.tree.states[:, [start, start + 2]])


def test_the_title_says_capture_and_success(drawn):
    _, score, ax = drawn
    assert ax.get_title() == f"capture {score.capture:.2f}   success {score.success:.2f}"


def test_the_success_set_is_filled_where_it_is(drawn):
    assert filled_area(drawn[2], plots.SUCCEEDED_COLOR) == pytest.approx(4 * 0.4, rel=0.03)


def test_the_capture_set_is_filled_where_it_is(task, trajectory):
    state = trajectory.states[0].copy()
    problem = task.problem(state)
    state[problem.scene.slice("effector")][7:13] = 0.0  # at rest: a disc of radius 0.855 m
    problem = task.problem(state)
    ax = Figure().subplots()
    plots.plot_state(problem, capture_score(problem, nodes=5), ax, limits=((-1, 3), (-1, 2)))
    assert filled_area(ax, plots.CAPTURED_COLOR) == pytest.approx(np.pi * 0.855**2, rel=0.02)


def test_the_qualitative_figure_has_a_row_a_trajectory_and_three_frames_in_each(task, trajectory):
    figure = plots.figure_qualitative(
        task, {"failed": trajectory, "successful": trajectory}, nodes=10
    )
    panels = [ax for ax in figure.axes if "capture" in ax.get_title()]
    assert len(panels) == 6
    assert [ax.get_title().split("\n")[0] for ax in panels[:3]] == [
        f"t = {trajectory.times[k]:.2f} s" for k in (0, 1, 2)
    ]


def test_an_infinite_effort_is_drawn_at_the_top_of_its_axis():
    ax = Figure().subplots()
    times = np.array([0.0, 1.0, 2.0])
    plots.plot_trajectory_scores(
        times, {"effort/est": np.array([1.0, np.inf, 3.0])}, np.ones(3, bool), [ax]
    )
    marks = [line for line in ax.lines if line.get_marker() == "^"]
    assert marks[0].get_xdata().tolist() == [1.0]
    assert marks[0].get_transform().transform((0, marks[0].get_ydata()[0]))[1] == pytest.approx(
        ax.transAxes.transform((0, 0.95))[1]
    )


def test_frames_that_are_not_captured_are_shaded():
    ax = Figure().subplots()
    plots.plot_trajectory_scores(
        np.arange(4.0), {"force": np.ones(4)}, np.array([True, True, False, False]), [ax]
    )
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches]
    assert spans == [(1.5, 2.5), (2.5, 3.0)]
