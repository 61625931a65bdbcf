"""`make bench` on little trees: that it works, and compares the same rollouts; not how fast."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import energymargin as em
from edges import Edge, edges_of, positions
from energymargin_paper.pages import blocks
from measurements import TASKS, problems_of
from mujoco_rollouts import MuJoCoEdges
from speed_bodies import clumps
from speed_error import Law, Measured, Setting, cheapest, furthest
from speed_frame import PAGE, foreseen
from speed_tasks import cost_of
from tables import write

SCRIPT = Path(__file__).parents[3] / "python" / "bench" / "speed.py"


def run(*arguments):
    return subprocess.run(
        [sys.executable, SCRIPT, *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=180,
    )


@pytest.mark.parametrize("task", ["push", "balance", "topple", "grasp"])
def test_bullet_mujoco_and_pybullet_make_the_same_rollouts(task):
    cost = cost_of(problems_of(task, 6)[2], nodes=(10, 30), rounds=1, large=False)
    for pairs in (*cost.floor.values(), cost.mujoco.step, cost.mujoco.rollout, cost.pybullet):
        assert pairs.others_steps == pairs.steps > 0
        assert pairs.moved > 1e-3
    assert cost.floor[30].apart < 0.1 * cost.floor[30].moved
    if task != "grasp":  # where PyBullet controls the joints its own way, and MuJoCo's fingers slip
        assert cost.pybullet.apart < 0.1 * cost.pybullet.moved
        assert cost.mujoco.step.apart < 0.2 * cost.mujoco.step.moved


@pytest.mark.parametrize("task", TASKS)
def test_twin_in_mujoco_begins_where_the_scene_is_and_ends_alike_by_both_of_its_ways(task):
    problem = problems_of(task, 6)[2]
    tree = em.capture_score(problem, nodes=5, warn=False).tree
    edges = edges_of(problem, tree)
    waiting = MuJoCoEdges(problem, [Edge(edge.start, edge.wrenches, 0) for edge in edges])
    starts = positions(problem.scene, [edge.start for edge in edges])
    assert waiting.step() == pytest.approx(starts, abs=1e-12)
    moving = MuJoCoEdges(problem, edges)
    moving.roll_out()
    assert np.array_equal(moving.stepped()[0], moving.rolled_out())


def test_body_that_falls_alone_ends_in_mujoco_where_it_does_here():
    scene = em.Scene()
    scene.add_body("ball", em.Sphere(0.1), mass=2.0, position=(0, 0, 5), role="object")
    always = em.regions.Speed("ball", 100.0)
    wrench = np.array([[3.0, 0.0, 1.0, 0.0, 0.01, 0.0]])
    start = scene.pack(ball={"velocity": (0, 1, 0), "angular_velocity": (1, 2, 3)})
    problem = em.Problem(
        scene, start, force=(3, 3, 3), torque=(1, 1, 1), duration=1, captured=always
    )
    twin = MuJoCoEdges(problem, [Edge(start, wrench, 48)])
    ends, (_, contacts, _) = twin.step(), twin.stepped()
    end = em.World(scene).rollout(start, wrench[0], 48 * scene.step).state
    assert ends[0, 0] == pytest.approx(end[:3], abs=1e-9)
    assert set(contacts) == {0}


def test_boxes_of_a_clump_touch_and_rest():
    problem = clumps(12)
    world = em.World(problem.scene)
    names = {frozenset((c.body_a, c.body_b)) for c in world.contacts(problem.state)}
    for pair in (("ground", "box_0"), ("box_0", "box_3"), ("box_4", "box_2"), ("ground", "box_5")):
        assert frozenset(pair) in names
    end = world.rollout(problem.state, np.zeros(6), 0.5).state
    assert np.abs(positions(problem.scene, [end - problem.state])).max() < 1e-4


def test_a_block_has_the_command_that_measured_it(tmp_path, monkeypatch):
    page = tmp_path / "docs" / "speed.md"
    page.parent.mkdir()
    page.write_text("# Speed\n\n<!-- made: bench-error\ncommand: a\nversion: 0\n-->\n")
    page.write_text(page.read_text() + "<!-- end: bench-error -->\n")
    words = ["--out", "a.md", "--parts", "error", "--states", "4", "--pages", str(page.parent)]
    monkeypatch.setattr(sys, "argv", ["speed.py", *words])
    write(None, "# Speed\n\n| push |\n", "bench", page.parent)
    (block,) = blocks(page)
    assert block.head.command == "make bench BENCH='--parts error --states 4'"
    assert "| push |" in page.read_text() and block.head.date


def test_a_setting_of_mujoco_is_the_cheapest_that_is_right_or_the_least_wrong():
    law = Law("elliptic", 1.0, soft=True)
    quick, slow = (Setting(share, law, 100) for share in (1.0, 0.5))
    measured = {quick: Measured([0.002], [0.1]), slow: Measured([0.001], [0.3])}
    measured[Setting(1.0)] = Measured([0.0], [0.01])  # ours, which is never the other one
    assert cheapest(measured, 0.003) == quick
    assert cheapest(measured, 0.001) == slow
    assert cheapest(measured, 0.0005) == slow


def test_the_furthest_object_counts_and_what_diverges_as_far_as_anything():
    apart = np.array([[[0.001, 0, 0], [0, 0.003, 0]], [[0.5, 0, 0], [0, 0, 0]], [[np.nan] * 3] * 2])
    assert furthest(apart, np.zeros((3, 2, 3))) == pytest.approx([0.003, 0.01, 0.01])


def test_foresight_beside_a_frame_is_that_of_the_page():
    known = foreseen(PAGE.read_text())
    assert set(known) == set(TASKS) - {"push-real"}
    for task, auc_ap in known.items():
        row = f"| {task} | "
        assert any(line.startswith(row) and auc_ap in line for line in PAGE.read_text().split("\n"))


def test_each_table_has_its_rows_with_numbers(tmp_path):
    parts = "tasks,frame,answer,error,cores,growth,bodies,start"
    little = ("--quick", "--states", "1", "--tasks", "push", "--parts", parts)
    done = run(*little, "--out", tmp_path / "speed.md")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "speed.md").read_text() in done.stdout
    rows = [
        [cell.strip().removeprefix("x ") for cell in line.strip("|").split("|")[1:]]
        for line in done.stdout.splitlines()
        if line.startswith("|")
    ]
    numbers = [
        [float(cell.split("/")[0]) for cell in row if cell] for row in rows if is_number(row[0])
    ]
    of_tasks, of_frames = [12, 7], [5, 7]
    assert [len(row) for row in numbers] == [
        *of_tasks,
        *of_frames,
        *[5] * 4,
        *[8] * 4,
        *[3] * 4,
        *[2] * 2,
        *[4] * 2,
        1,
        *[2] * 4,
    ]
    assert np.isfinite(np.concatenate(numbers)).all()
    assert (np.concatenate(numbers) >= 0.0).all()


def is_number(cell):
    return cell.replace(".", "", 1).isdigit()


@pytest.mark.parametrize(("option", "wrong"), [("--tasks", "juggle"), ("--parts", "juggling")])
def test_an_unknown_task_or_part_is_named(option, wrong):
    done = run(option, wrong)
    assert done.returncode != 0
    assert repr(wrong) in done.stderr


def test_a_version_beside_itself_is_not_slower_and_answers_the_same():
    script = SCRIPT.with_name("versions.py")
    asked = ["--tasks", "push", "--states", "2", "--rounds", "1"]
    done = subprocess.run(
        [sys.executable, script, sys.executable, *asked],
        check=False,
        capture_output=True,
        text=True,
        timeout=180,
    )
    assert done.returncode in (0, 1), done.stderr  # 1: a ratio of little time was above its bar
    cells = done.stdout.splitlines()[2].split("|")
    assert cells[1].strip() == "push" and float(cells[5]) == 0.0
