"""Pictures of the state of every task, and of the way out of its capture set."""

import io

import numpy as np
import pytest
from grippers import gripper
from made_tasks import MADE
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from energymargin import (
    Box,
    Problem,
    Scene,
    capture_score,
    escape_effort,
    plots,
    regions,
    tasks,
)
from energymargin.look.outlines import (
    REACH,
    axis_numbers,
    object_centers,
    outlines_of,
    plane_for,
    view_of,
)
from energymargin.look.plots.scenes import sets_of
from energymargin.tasks.base import plane_of


@pytest.fixture(scope="module", params=MADE)
def drawn(request):
    """A captured state of a task, scored, and drawn in a figure of its own."""
    task = tasks.make(request.param)
    trajectory = task.rollout(seed=2)
    frame = int(np.flatnonzero(trajectory.captured[:6])[-1])
    problem = task.problem(trajectory.states[frame], trajectory.params, trajectory.contacts[frame])
    score = capture_score(problem, nodes=60, seed=0)
    escape = escape_effort(problem, nodes=60, seed=0)
    ax = plots.plot_state(problem, score, ax=Figure().subplots(), escape=escape)
    return task, problem, score, escape, ax


@pytest.fixture
def block():
    """A box on a table that no robot holds, captured within half a metre of x."""
    scene = Scene()
    scene.add_plane("table", friction=0.1)
    scene.add_body("box", Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.05), role="object")
    return Problem(
        scene,
        scene.pack(),
        force=(6.0, 0.0, 0.0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=regions.Box("box", (0, 0, 0), (1.0, np.inf, np.inf)),
    )


def ways(ax):
    return [line for line in ax.lines if line.get_gid() == "escape"]


def filled(ax):
    """The images of the sets, by their colour's RGB."""
    return {tuple(np.round(image.get_cmap()(0.0)[:3], 3)): image for image in ax.images}


def test_the_path_drawn_goes_from_the_start_to_the_escape_node(drawn):
    _, problem, _, escape, ax = drawn
    if not len(escape.path):
        assert not ways(ax)
        return
    states = escape.tree.states[escape.path]
    assert not problem.captured.contains(problem.scene, states[-1])
    plane = ax.get_xlabel()[0], ax.get_ylabel()[0]
    possible = object_centers(problem.scene, states, plane).swapaxes(0, 1)
    assert ways(ax)
    for line in ways(ax):
        assert any(np.array_equal(line.get_xydata(), way) for way in possible)


def test_the_path_of_a_capture_score_ends_at_its_cheapest_node_outside(drawn):
    _, problem, score, _, _ = drawn
    ax = plots.plot_state(problem, score, ax=Figure().subplots(), plane=("x", "y"))
    outside = ~problem.captured.contains(problem.scene, score.tree.states)
    if not outside.any():
        assert not ways(ax)
        assert ax.get_title().endswith("no escape found with 60 nodes")
        return
    cost = score.tree.costs[outside].min()
    cheapest = int(np.flatnonzero(outside & (score.tree.costs == cost))[0])
    ends = object_centers(problem.scene, score.tree.states[[cheapest]], ("x", "y"))[0]
    for line in ways(ax):
        assert line.get_xydata()[-1].tolist() in ends.tolist()
    assert f"{cost:.3g} J" in ax.get_title()


def test_a_set_is_filled_where_the_region_contains_the_objects_place(drawn):
    _, problem, _, _, ax = drawn
    plane = ax.get_xlabel()[0], ax.get_ylabel()[0]
    captured, succeeded = sets_of(problem)
    images = filled(ax)
    compared = 0
    for region, color in ((captured, (0.337, 0.706, 0.914)), (succeeded, (0.549, 0.549, 0.549))):
        if color not in images:  # all of the view, or nowhere in it
            continue
        image = images[color]
        cells = ~np.ma.getmaskarray(image.get_array())
        left, right, bottom, top = image.get_extent()
        for row, column in np.random.default_rng(0).integers(cells.shape, size=(200, 2)):
            state = problem.state.copy()
            x = left + (column + 0.5) * (right - left) / cells.shape[1]
            y = bottom + (row + 0.5) * (top - bottom) / cells.shape[0]
            for body in (body for body in problem.scene.bodies if body.role == "object"):
                state[problem.scene.slice(body.name)][axis_numbers(plane)] = x, y
            assert region.contains(problem.scene, state) == cells[row, column]
            compared += 1
    assert compared or "all of the view" in legend(problem) or "nowhere" in legend(problem)


def legend(problem):
    """All that the legend of a picture of the state alone says."""
    ax = plots.plot_state(problem, ax=Figure().subplots(), legend=True)
    return " ".join(text.get_text() for text in ax.get_legend().get_texts())


def test_the_plane_that_is_chosen_is_the_one_in_which_the_task_is_shown(drawn):
    task, problem, score, _, _ = drawn
    assert plane_for(problem.scene, score.tree.states) == plane_of(task)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_gripper_is_seen_from_the_side_from_which_neither_palm_nor_fingers_cover_the_cube(axis):
    scene = gripper(axis).scene
    states = np.tile(scene.pack(), (50, 1))
    place = scene.slice("cube").start
    states[:, place : place + 2] += np.random.default_rng(0).normal(0, 0.01, (50, 2))
    assert plane_for(scene, states) == (axis, "z")


def test_a_mast_far_away_does_not_shrink_the_hand():
    near, far = (plots.plot_state(gripper(mast=mast), ax=Figure().subplots()) for mast in (0, 1))
    assert (near.get_xlim(), near.get_ylim()) == (far.get_xlim(), far.get_ylim())
    (low, high), (left, right) = far.get_ylim(), far.get_xlim()
    assert high - low < 0.3 and right - left < 0.3
    assert low < 0.13 and high > 0.255 and left < -0.07 and right > 0.07  # cube and palm


def test_an_arm_that_reaches_far_is_cut_off_and_a_free_pusher_is_not():
    scene = Scene()
    scene.add_body("cube", Box((0.04,) * 3), mass=1, position=(0, 0, 0.02), role="object")
    scene.add_body("arm", Box((0.05, 0.05, 2)), mass=0, position=(0, 0, 1.05), role="effector")
    (_, _), (_, high) = view_of(scene, [scene.pack()], ("x", "z"), around=0.0)
    assert high == pytest.approx(0.04 + REACH * 0.04)
    scene.add_body("pusher", Box((0.04,) * 3), mass=1, position=(1, 0, 0.02), role="effector")
    (_, right), _ = view_of(scene, [scene.pack()], ("x", "z"), around=0.0)
    assert right == pytest.approx(1.02, abs=1e-3)


def test_every_axis_has_its_unit(drawn):
    ax = drawn[-1]
    assert ax.get_xlabel().endswith(" [m]")
    assert ax.get_ylabel().endswith(" [m]")
    assert [other.get_ylabel() for other in ax.figure.axes if other is not ax] == [
        "cost of reaching a node [J]"
    ]


def test_the_start_the_captured_nodes_and_the_escape_are_in_view(drawn):
    _, problem, score, escape, ax = drawn
    plane = ax.get_xlabel()[0], ax.get_ylabel()[0]
    captured = problem.captured.contains(problem.scene, score.tree.states)
    shown = [score.tree.states[captured | ~captured[0]], escape.tree.states[escape.path]]
    points = object_centers(problem.scene, np.concatenate(shown), plane).reshape(-1, 2)
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    assert ((points > low) & (points < high)).all()


def test_nodes_that_are_not_lost_are_in_view_and_those_out_of_it_are_counted(block):
    tree = capture_score(block, nodes=100, seed=0)
    ax = plots.plot_state(block, tree, ax=Figure().subplots(), path=False, legend=True)
    x = object_centers(block.scene, tree.tree.states, "x").ravel()
    low, high = ax.get_xlim()
    captured = block.captured.contains(block.scene, tree.tree.states)
    assert np.abs(x[captured]).max() > 0.2
    assert ((x[captured] > low) & (x[captured] < high)).all()
    unseen = int(((x < low) | (x > high)).sum())
    assert unseen > 1
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[-2:] == ["outside of the capture set", f"{unseen} of 101 nodes out of view"]


def test_a_set_that_is_left_by_speed_is_said_to_be_no_matter_of_place(block):
    slow, fast = (
        regions.Predicate(lambda states, is_slow=is_slow: (states[:, 7] < 0.5) == is_slow)
        for is_slow in (True, False)
    )
    moving = Problem(
        block.scene,
        block.state,
        force=(6.0, 0.0, 0.0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=slow,
        succeeded=fast,
    )
    tree = capture_score(moving, nodes=100, seed=0)
    ax = plots.plot_state(moving, tree, ax=Figure().subplots(), legend=True)
    said = [text.get_text() for text in ax.get_legend().get_texts()]
    assert said[1:3] == [
        "capture set (not by place alone: not drawn)",
        "success set (not by place alone: not drawn)",
    ]
    assert "capture set (all of the view)" in legend(moving)


def test_the_legend_has_no_cross_where_the_picture_has_none(block):
    tree = capture_score(block, nodes=1, seed=0)
    assert block.captured.contains(block.scene, tree.tree.states).all()
    ax = plots.plot_state(block, tree, ax=Figure().subplots(), legend=True)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["object", "capture set (all of the view)"]


@pytest.mark.parametrize("layout", [None, "constrained"])
def test_the_legend_below_axes_of_the_caller_covers_nothing_and_moves_nothing(block, layout):
    tree = capture_score(block, nodes=100, seed=0)
    figure = Figure(figsize=(9.0, 3.5), layout=layout)
    for ax in figure.subplots(1, 2):
        place, spec, anchor = ax.get_position().bounds, ax.get_subplotspec(), ax.get_anchor()
        plots.plot_state(
            block, tree, ax=ax, limits=((-1, 1), (-1, 1)), legend=True, color_bar=False
        )
        assert ax.get_position(original=True).bounds == place
        assert (ax.get_subplotspec(), ax.get_anchor()) == (spec, anchor)
    figure.savefig(io.BytesIO(), format="png")
    for ax in figure.axes:
        box = ax.get_legend().get_window_extent()
        assert not box.overlaps(ax.xaxis.get_tightbbox())
        assert not box.overlaps(ax.bbox)
        assert layout is None or box.y0 >= 0


def test_the_legend_of_a_new_figure_is_no_wider_than_it(block):
    scene = Scene()
    for name in ("box", *(f"an obstacle with a long name {k}" for k in range(3))):
        role = "object" if name == "box" else "none"
        place = (0.2 * len(scene.bodies), 0.0, 0.05)
        scene.add_body(name, Box((0.1, 0.1, 0.1)), mass=1.0, position=place, role=role)
    sets = {"captured": block.captured, "succeeded": block.captured}
    crowded = Problem(scene, scene.pack(), force=(6, 0, 0), torque=(0, 0, 0), duration=0.5, **sets)
    figure = plots.plot_state(crowded).figure
    figure.savefig(io.BytesIO(), format="png")
    box = figure.axes[0].get_legend().get_window_extent()
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width


def test_the_colours_end_with_what_is_captured_or_with_the_escape(block):
    tree = capture_score(block, nodes=100, seed=0)
    costs, states = tree.tree.costs, tree.tree.states
    captured = costs[block.captured.contains(block.scene, states)].max()
    effort = escape_effort(block, nodes=20, seed=1)
    assert captured < costs.max()
    for escape, path, most in (
        (None, False, captured),
        (effort, True, max(captured, effort.effort)),
    ):
        ax = plots.plot_state(block, tree, ax=Figure().subplots(), escape=escape, path=path)
        (dots,) = (c for c in ax.collections if c.get_gid() == "nodes")
        assert dots.get_clim() == (0.0, most)
        assert dots.norm.vmax < costs.max()
        (bar,) = (other for other in ax.figure.axes if other is not ax)
        assert bar._colorbar.extend == "max"
    ax = plots.plot_state(block, tree, ax=Figure().subplots(), most=2 * costs.max())
    assert ax.figure.axes[1]._colorbar.extend == "neither"


def test_without_a_result_the_state_is_drawn_alone(drawn):
    problem = drawn[1]
    ax = plots.plot_state(problem, ax=Figure().subplots())
    assert not [c for c in ax.collections if isinstance(c, PathCollection)]
    assert not ways(ax)
    assert len(ax.figure.axes) == 1  # no bar of colours
    assert any(patch.get_fill() for patch in ax.patches)


def test_a_scene_without_effector_is_drawn_and_its_escape_ends_where_the_box_is_lost(block):
    escape = escape_effort(block, nodes=200, seed=0)
    ax = plots.plot_state(block, escape)
    (way,) = ways(ax)
    assert abs(way.get_xydata()[-1][0]) > 0.5
    assert ax.get_title() == f"effort of escape {escape.effort:.3g} J"
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[:2] == ["object", "capture set"]
    assert "effector" not in " ".join(texts)


def test_the_lost_object_is_outlined_where_the_path_ends(block):
    escape = escape_effort(block, nodes=200, seed=0)
    ax = plots.plot_state(block, escape, ax=Figure().subplots())
    (outline,) = (patch for patch in ax.patches if patch.get_gid() == "lost")
    center = outline.get_xy()[:-1].mean(axis=0)
    assert center == pytest.approx(ways(ax)[0].get_xydata()[-1], abs=1e-6)


def test_a_legend_of_several_pictures_names_the_escape_of_a_search_that_found_one(block):
    found = escape_effort(block, nodes=200, seed=0)
    lacking = escape_effort(block, nodes=1, seed=0)
    labels = [
        [handle.get_label() for handle in plots.state_legend(block, escape=escape)]
        for escape in (found, lacking, None)
    ]
    assert np.isfinite(found.effort)
    assert np.isinf(lacking.effort)
    assert ["cheapest escape" in each for each in labels] == [True, False, False]


def test_no_escape_is_said_in_the_title(block):
    effort = escape_effort(block, nodes=1, seed=0)
    assert effort.effort == np.inf
    ax = plots.plot_state(block, effort, ax=Figure().subplots())
    assert ax.get_title() == "no escape found with 1 node"
    assert not ways(ax)


def test_a_start_outside_of_the_capture_set_is_said_in_the_title(block):
    state = block.scene.pack(box={"position": (2.0, 0.0, 0.05)})
    outside = Problem(
        block.scene, state, force=(6, 0, 0), torque=(0, 0, 0), duration=0.5, captured=block.captured
    )
    for result in (escape_effort(outside, nodes=5), capture_score(outside, nodes=5)):
        ax = plots.plot_state(outside, result, ax=Figure().subplots())
        assert ax.get_title().endswith("the start is outside of the capture set")


def test_a_search_that_was_stopped_is_said_to_be_not_complete(block):
    effort = escape_effort(block, nodes=10**6, timeout=0.05)
    ax = plots.plot_state(block, effort, ax=Figure().subplots())
    assert ax.get_title().endswith("(not complete)")


def test_the_same_things_make_the_same_picture(block):
    score = capture_score(block, nodes=30, seed=0)

    def picture():
        image = io.BytesIO()
        ax = plots.plot_state(block, score, ax=Figure().subplots(), ghosts=2)
        ax.figure.savefig(image, format="png")
        return image.getvalue()

    assert picture() == picture()


def test_a_result_of_another_problem_is_refused(block):
    task = tasks.make("push", friction=0.3)
    other = task.problem(task.rollout(seed=0, frames=2).states[0])
    with pytest.raises(ValueError, match=r"its states have 26 numbers, expected 13"):
        plots.plot_state(block, capture_score(other, nodes=2))
    moved = Problem(
        block.scene,
        block.scene.pack(box={"position": (0.1, 0, 0.05)}),
        force=(6, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=block.captured,
    )
    with pytest.raises(ValueError, match="escape is of another problem: its tree does not start"):
        plots.plot_state(block, escape=escape_effort(moved, nodes=2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"result": 3.0}, "result is 3.0, expected a CaptureScore or an EscapeEffort"),
        ({"escape": "it"}, "escape is 'it', expected an EscapeEffort"),
        ({"plane": ("x", "w")}, r"plane is \('x', 'w'\), expected two axes"),
        ({"plane": 3}, "plane is 3, expected two axes"),
        ({"limits": "auto"}, r"limits is 'auto', expected \(low, high\) of two axes \[m\]"),
        ({"legend": "below"}, "legend is 'below', expected true or false"),
        ({"limits": ((1, 0), (0, 1))}, r"limits is .*, expected \(low, high\) of two axes \[m\]"),
        ({"ghosts": -1}, "ghosts is -1, expected a whole number"),
        ({"detail": 0}, "detail is 0, expected a whole number"),
        ({"ax": "here"}, "ax is 'here', expected a matplotlib Axes"),
    ],
)
def test_a_bad_argument_is_named_with_what_was_expected(block, arguments, message):
    with pytest.raises(ValueError, match=message):
        plots.plot_state(block, **arguments)


@pytest.mark.parametrize("projection", ["3d", "polar"])
def test_axes_that_are_not_a_plane_are_refused(block, projection):
    ax = Figure().add_subplot(projection=projection)
    with pytest.raises(ValueError, match=f"ax is '{projection}', expected a matplotlib Axes with"):
        plots.plot_state(block, ax=ax)


def test_a_part_that_is_seen_edge_on_is_a_line():
    flat = Box((1.0, 2.0, 1e-300))
    (line,) = outlines_of(flat, (np.zeros(3), np.array([0, 0, 0, 1.0])), ("x", "z"))
    assert sorted(line[:, 0].tolist()) == [-0.5, 0.5]
