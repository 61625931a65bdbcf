import json
from dataclasses import replace

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.figure import Figure

from energymargin import (
    Box,
    Compound,
    Part,
    Problem,
    Scene,
    Sphere,
    capture_score,
    datasets,
    plots,
    regions,
    tasks,
)
from energymargin.look.plots.scenes import lost_objects
from energymargin.model.scenes.corners import shape_parts
from energymargin.tasks.scoop import CAPTURE_AHEAD, CAPTURE_HEIGHT, LENGTH, RAMP


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
    plots.plot_state(problem, score, ax=ax, path=False, limits=((-1, 3), (-1, 2)))
    return problem, score, ax


def drawn_as(artists, name):
    """The one artist of that name."""
    (found,) = (artist for artist in artists if artist.get_gid() == name)
    return found


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
    dots = drawn_as(ax.collections, "nodes")
    start = problem.scene.slice("object").start
    assert np.allclose(dots.get_offsets(), score.tree.states[:, start : start + 2])
    assert np.array_equal(dots.get_array(), score.tree.costs)


def test_a_cross_marks_each_node_outside_of_the_capture_set(drawn):
    problem, score, ax = drawn
    crosses = drawn_as(ax.collections, "outside").get_offsets()
    outside = ~problem.captured.contains(problem.scene, score.tree.states)
    start = problem.scene.slice("object").start
    assert outside.any()
    assert np.allclose(crosses, score.tree.states[outside, start : start + 2])


def test_a_spatial_task_is_drawn_from_the_side_with_all_its_links():
    task = tasks.make("grasp", friction=0.5)
    problem = task.problem(task.scene({"friction": 0.5, "clench": 1.0}).pack())
    score = capture_score(problem, nodes=5, seed=0)
    ax = Figure().subplots()
    plots.plot_state(problem, score, ax=ax, plane=task.plane)
    outlines = [patch for patch in ax.patches if patch.get_linewidth() == 0.9]
    assert len(outlines) == len(problem.scene.bodies)
    assert ax.get_ylabel() == "z [m]"
    dots = drawn_as(ax.collections, "nodes")
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
    plots.plot_state(problem, capture_score(problem, nodes=5), ax=ax, limits=((-1, 3), (-1, 2)))
    assert filled_area(ax, plots.CAPTURED_COLOR) == pytest.approx(np.pi * 0.855**2, rel=0.02)


def test_the_figure_of_trees_has_a_row_a_trajectory_and_three_frames_in_each(task, trajectory):
    ends = [replace(trajectory, success=success) for success in (False, True)]
    dataset = datasets.Dataset("push", {"friction": 0.3}, 0, ends)
    figure = plots.figure_trees(dataset, nodes=10, seed=0)
    panels = [ax for ax in figure.axes if "capture" in ax.get_title()]
    assert len(panels) == 6
    assert [ax.get_title().split("\n")[0] for ax in panels[:3]] == [
        f"t = {trajectory.times[k]:.2f} s" for k in (0, 1, 2)
    ]


@pytest.fixture(scope="module")
def several():
    """A state of four boxes and a scoop of several parts, with the tree from there, and a view."""
    task = tasks.make("scoop")
    trajectory = task.rollout(seed=2, frames=7)
    problem = task.problem(trajectory.states[3], trajectory.params)
    score = capture_score(problem, nodes=20, seed=0)
    ax = Figure().subplots()
    plots.plot_state(problem, score, ax=ax, plane=("x", "z"), path=False, limits=((0, 1), (0, 0.3)))
    own = task.captured(problem.state, trajectory.params)
    return problem, score, ax, own


def places(problem, states, name):
    """Of one object on x and z."""
    start = problem.scene.slice(name).start
    return states[:, [start, start + 2]]


def test_every_object_has_a_dot_for_each_node_in_the_colour_of_the_nodes_cost(several):
    problem, score, ax, own = several
    dots = drawn_as(ax.collections, "nodes")
    by_object = np.asarray(dots.get_offsets()).reshape(len(score.tree.costs), len(own), 2)
    for number, name in enumerate(own):
        assert np.allclose(by_object[:, number], places(problem, score.tree.states, name))
    assert np.array_equal(dots.get_array(), np.repeat(score.tree.costs, len(own)))


def test_a_cross_marks_each_object_that_is_outside_of_its_own_capture_set(several):
    problem, score, ax, own = several
    states = score.tree.states
    lost = [
        places(problem, states, name)[~region.contains(problem.scene, states)]
        for name, region in own.items()
    ]
    crosses = np.asarray(drawn_as(ax.collections, "outside").get_offsets())
    assert 0 < len(crosses) < len(own) * len(states)
    assert sorted(map(tuple, crosses)) == sorted(map(tuple, np.concatenate(lost)))


def test_a_compound_is_drawn_with_the_outline_of_each_part(several):
    problem, _, ax, own = several
    (scoop,) = (body for body in problem.scene.bodies if body.role == "effector")
    outlines = [patch for patch in ax.patches if patch.get_linewidth() == 0.9]
    assert len(outlines) == len(own) + len(scoop.shape.parts)


def test_the_parts_of_a_compound_are_where_they_are_in_its_frame():
    half_turn = (0.0, 0.0, 1.0, 0.0)
    compound = Compound([Box((2, 2, 2)), Part(Box((4, 2, 2)), (10, 0, 0), half_turn)])
    first, second = shape_parts(compound)
    assert (first.min(axis=0).tolist(), first.max(axis=0).tolist()) == ([-1] * 3, [1] * 3)
    assert second.min(axis=0) == pytest.approx([8, -1, -1])
    assert second.max(axis=0) == pytest.approx([12, 1, 1])


def test_the_title_of_several_objects_says_the_scores_of_all_and_of_at_least_one(several):
    _, score, ax, _ = several
    assert ax.get_title() == (
        f"all:   capture {score.capture:.2f}   success {score.success:.2f}\n"
        f"any:   capture {score.capture_any:.2f}   success {score.success_any:.2f}"
    )


def test_the_filled_capture_set_of_several_objects_is_where_each_may_be(several):
    problem, _, ax, _ = several
    scoop = problem.scene.unpack(problem.state)["scoop"]
    reach = LENGTH + RAMP + CAPTURE_AHEAD * scoop["velocity"][0]
    assert filled_area(ax, plots.CAPTURED_COLOR) == pytest.approx(reach * CAPTURE_HEIGHT, rel=0.05)


SWAPPED = {"a": (0.3, 0.0, 0.0), "b": (-0.3, 0.0, 0.0)}


def spheres(**captured):
    """Two balls, each where the other's capture set is."""
    scene = Scene()
    for name, place in SWAPPED.items():
        scene.add_body(name, Sphere(0.05), mass=1.0, position=place, role="object")
    return Problem(
        scene, scene.pack(), force=(1, 0, 0), torque=(0, 0, 0), duration=0.5, captured=captured
    )


def test_each_object_is_lost_by_its_own_set_alone():
    left, right = (regions.Ball(name, (x, 0, 0), 0.2) for name, x in (("a", -0.3), ("b", 0.3)))
    problem = spheres(a=left, b=right)
    scene, states = problem.scene, np.tile(problem.state, (4, 1))
    for row, x in ((1, -0.3), (3, -0.3)):
        states[row, scene.slice("a").start] = x
    for row, x in ((2, 0.3), (3, 0.3)):
        states[row, scene.slice("b").start] = x
    expected = [[True, True], [False, True], [True, False], [False, False]]
    assert lost_objects(problem, states).tolist() == expected


def test_each_object_is_lost_by_its_own_set_also_if_the_sets_are_predicates():
    sets = {
        name: regions.Predicate(lambda states, n=number: states[:, 13 * n] * (2 * n - 1) > 0.1)
        for number, name in enumerate(SWAPPED)
    }
    problem = spheres(**sets)
    states = np.tile(problem.state, (2, 1))
    states[1, problem.scene.slice("b").start] = 0.3
    assert lost_objects(problem, states).tolist() == [[True, True], [True, False]]


def test_where_sets_cannot_be_told_apart_no_object_is_lost_that_may_be_in_its_own():
    left, right = (regions.Ball(name, (x, 0, 0), 0.2) for name, x in (("a", -0.3), ("b", 0.3)))
    text = json.loads(spheres(a=left, b=right).to_json())
    text["captured"] = text["captured"]["of"][0]
    problem = Problem.from_json(json.dumps(text))
    states = np.tile(problem.state, (2, 1))
    states[1, problem.scene.slice("a").start] = -0.3
    assert problem.captured_by_object is None
    assert lost_objects(problem, states).tolist() == [[True, True], [False, False]]


def test_a_long_thin_view_is_drawn(task, trajectory):
    problem = task.problem(trajectory.states[0])
    for limits in (((-5, 5), (0.45, 0.452)), ((0.45, 0.452), (-5, 5))):
        ax = plots.plot_state(problem, ax=Figure().subplots(), limits=limits)
        assert (ax.get_xlim(), ax.get_ylim()) == limits


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"most": 0.0}, "most is 0.0"),
        ({"most": np.nan}, "most is nan"),
        ({"most": np.inf}, "most is inf"),
    ],
)
def test_a_scale_that_cannot_be_is_named(drawn, options, words):
    problem, score, _ = drawn
    with pytest.raises(ValueError, match=words):
        plots.plot_state(problem, score, ax=Figure().subplots(), ghosts=1, **options)
