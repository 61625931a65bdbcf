"""The readers of the authors' published data: on a folder of our own everywhere, and on theirs
where ENERGYMARGIN_PUBLISHED names it."""

import csv
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from published_data import write_data
from scipy import stats

import energymargin as em
from energymargin import datasets
from energymargin.evaluation import evaluate
from energymargin.look.viewer.sources import stored_scores
from energymargin.store import ScoreStore
from energymargin_paper.paper import authors
from energymargin_paper.paper.authors.reading import recorded_dataset, recorded_task, steady, tracks
from energymargin_paper.paper.authors.recorded import SLACK, PublishedRecorded
from energymargin_paper.paper.published_agreement import AGAIN, agreement

pytest.importorskip("trimesh")
COMBINATION = "jaw-pushes-rectangle"
DATA = os.environ.get("ENERGYMARGIN_PUBLISHED")
needs_data = pytest.mark.skipif(DATA is None, reason="ENERGYMARGIN_PUBLISHED names no folder")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_data(tmp_path_factory.mktemp("published"))


def test_a_folder_has_the_parts_that_are_there(folder, tmp_path):
    assert authors.parts(folder) == ["push", "topple", COMBINATION]
    with pytest.raises(ValueError, match="has no published data, expected a folder with simulated"):
        authors.parts(tmp_path)
    with pytest.raises(ValueError, match=r"part is 'grasp', expected one of push, topple, jaw"):
        authors.dataset(folder, "grasp")


def test_a_simulated_part_is_a_dataset_of_a_task_at_the_authors_parameters(folder):
    dataset = authors.dataset(folder, "push")
    assert dataset.task == "published-push" and [len(t) for t in dataset.trajectories] == [4, 4]
    first, second = dataset.trajectories
    assert (first.seed, second.seed) == (0, 2) and (first.success, second.success) == (True, False)
    assert first.times.tolist() == pytest.approx([0.0, 0.25, 0.5, 0.75])
    assert second.captured.tolist() == [True, True, False, False]
    problem = dataset.problems([5])[0]
    bodies = problem.scene.unpack(problem.state)
    assert bodies["object"]["position"] == pytest.approx([4.9, 7.1, 0.05])
    assert bodies["effector"]["velocity"] == pytest.approx([0, 0.4, 0])
    assert (problem.rate, problem.effector) == (3.0, "drive")
    # what the labels say of our own numbers is what the capture set says
    assert _inside_the_sets_of_the_labels(dataset) == [True] * 6 + [False] * 2
    ahead = datasets.Future(2).problem(em.tasks.make("published-push"), first, 0)
    assert ahead.plan.wrenches["effector"][0, 1] > 5 and ahead.horizon == pytest.approx(0.5)


def test_the_clock_of_a_topple_is_where_the_physics_meets_the_next_frame(folder):
    task = em.tasks.make("published-topple")
    start = authors.dataset(folder, "topple").trajectories[0].states[0]
    params = {"friction": 0.5}
    world = em.World(task.scene(params), task.plan(start, 0.0, params, 1.0))
    states = world.simulate(start, 4 * 31, record=range(0, 4 * 31 + 1, 31)).states
    from energymargin_paper.paper.authors.reading import matched_interval

    assert matched_interval(task, params, states) == pytest.approx(31 / 240)


def test_what_was_drawn_for_a_trajectory_is_its_own(folder):
    trajectory = authors.dataset(folder, "topple").trajectories[1]
    assert trajectory.params == {"friction": 0.5}


def test_a_recording_is_turned_into_the_scene(folder):
    track = tracks(folder / "recordings" / COMBINATION)[1]
    assert (track.number, track.success, len(track.times)) == (2, False, 12)
    assert track.times[0] == 0 and np.diff(track.times) == pytest.approx(1 / 30)
    assert track.poses["object"][3] == pytest.approx([0.136, 0.04, np.pi / 2])
    assert track.velocities["effector"][0] == pytest.approx([0, -0.6, 0])
    assert steady(track, 11) == pytest.approx([0, -0.6, 0], abs=1e-9)


def test_smoothed_labels_are_those_of_velocities_over_half_a_second(folder):
    own = folder / "recordings" / COMBINATION
    raw, smoothed = (recorded_dataset(folder, own, smoothed=s) for s in (False, True))
    assert raw.trajectories[1].captured.tolist() == [True] * 6 + [False] * 6
    task = recorded_task(folder, COMBINATION)
    scene = task.scene({})
    for trajectory in smoothed.trajectories:
        inside = task.captured_throughout({}).contains(scene, trajectory.states)
        assert (trajectory.captured == inside).mean() > 0.8  # but for what was moved apart
        assert not np.array_equal(trajectory.captured, raw.trajectories[1].captured)


def test_bodies_that_overlap_by_the_tags_errors_are_moved_apart_and_it_is_said(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "near")
    table = tmp_path / "near" / "recordings" / COMBINATION / "00" / "apriltag_results.csv"
    header, *lines = table.read_text().splitlines()
    cells = [line.split(",") for line in lines]
    for row in cells:
        row[2] = str(float(row[2]) - 0.025)  # the tool, towards the object
    table.write_text("\n".join([header, *map(",".join, cells)]))
    folder, told = tmp_path / "near", []
    dataset = authors.dataset(folder, COMBINATION, notice=told.append)
    world = em.World(recorded_task(folder, COMBINATION).scene({}))
    distances = [
        world.distance(state, "object", "effector")
        for trajectory in dataset.trajectories
        for state in trajectory.states
    ]
    assert min(distances) > -1e-4
    of_first = [text for text in told if text.startswith(f"{COMBINATION}, recording 0: ")]
    assert len(of_first) == 1 and "in 12 of 12 frames bodies overlapped" in of_first[0]


def test_the_authors_scores_are_a_run_as_any_other(folder, tmp_path):
    labelled = authors.labelled_scores(folder, "push")
    assert set(labelled.scores) == {"capture", "success", "effort/est", "effort/rrt"}
    assert np.isinf(labelled.scores["effort/est"]).sum() == 2
    dataset = authors.dataset(folder, "push")
    for _ in range(2):  # the second time changes nothing
        number = authors.add_scores(tmp_path / "s.db", folder, dataset, "push")
    with ScoreStore(tmp_path / "s.db") as store:
        (run_,) = store.runs()
        assert run_.number == number and run_.settings == {"source": "published"}
        found = run_.labelled_scores()
    for name, values in labelled.scores.items():
        assert np.array_equal(found.scores[name], values)
    assert np.array_equal(found.captured, labelled.captured)
    stored = stored_scores(tmp_path / "s.db", dataset)  # of the viewer
    assert (
        stored.columns[0][0] == "published"
        and stored.at(5)[0][1]["capture"] == labelled.scores["capture"][5]
    )
    em.store.score_dataset(dataset, tmp_path / "s.db", ["force"])
    with ScoreStore(tmp_path / "s.db") as store:
        assert len(store.runs()) == 2


def test_the_command_makes_datasets_that_are_scored_evaluated_and_shown(folder, tmp_path):
    done = run("import-published", folder, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0 and "Wrote 3 datasets" in done.stderr, done.stderr
    done = run("score", f"out/{COMBINATION}.h5", "--nodes", 3, "--metrics", "capture", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    shown = run("evaluate", f"out/{COMBINATION}-scores.db", "--run", 1, cwd=tmp_path)
    assert shown.returncode == 0 and "captured now" in shown.stdout, shown.stderr
    again = run("import-published", folder, "-o", "out", cwd=tmp_path)
    assert again.returncode == 2 and "push.h5 exists" in again.stderr
    wrong = run("import-published", tmp_path / "none", cwd=tmp_path)
    assert wrong.returncode == 2 and "has no published data" in " ".join(wrong.stderr.split())
    assert "Traceback" not in wrong.stderr


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("viapoints.csv", ("4.9", "wide"), r"viapoints.csv, line 7: xo is 'wide', expected a num"),
        ("viapoints.csv", ("xo,", "xq,"), "the header lacks 'xo'"),
        ("maneuver_labels.csv", ("\n2,0,", "\n2,7,"), "row 5 is of frame 7, expected 0"),
        ("success_labels.csv", ("2,0", "4,0"), "lacks trajectory 2"),
        ("prob-aoest.csv", ("0.9,", "nan,"), "success_metric is 'nan', expected a number"),
    ],
)
def test_a_file_that_is_not_as_expected_is_named_with_its_line(tmp_path, name, change, words):
    root = write_data(tmp_path)
    path = root / "simulated" / "push" / name
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change, 1))
    with pytest.raises(ValueError, match=words):
        authors.dataset(root, "push")
        authors.labelled_scores(root, "push")


def test_a_recording_without_a_label_or_too_short_is_refused(tmp_path):
    root = write_data(tmp_path)
    own = root / "recordings" / COMBINATION
    table = own / "02" / "apriltag_results.csv"
    table.write_text("\n".join(table.read_text().splitlines()[:8]))
    with pytest.raises(ValueError, match="has 7 frames, and there are labels of 12"):
        tracks(own)
    (own / "labels.csv").write_text("id,task_success\n0,1\n")
    with pytest.raises(ValueError, match="lacks recording 2"):
        tracks(own)


def test_a_problem_asks_for_what_was_drawn(folder):
    dataset, task = authors.dataset(folder, "topple"), em.tasks.make("published-topple")
    with pytest.raises(ValueError, match="the friction is drawn for each trajectory"):
        task.problem(dataset.trajectories[0].states[0])


def test_the_authors_search_has_sets_and_scenes_of_its_own(folder):
    dataset, task = authors.dataset(folder, "topple"), em.tasks.make("published-topple")
    first = dataset.trajectories[0]
    assert dataset.problems([0])[0].scene.gravity.tolist() == [0, 0, 0]
    assert task.recorded_problem(first.states[0], first.params).scene.gravity[2] == -9.81
    ahead = datasets.Future(1, plan="hold").problem(task, first, 0)
    assert ahead.scene.gravity[2] == -9.81

    # a support at rest: by the labels a disc of 1.2 m, by the search of 0.9 m
    task = em.tasks.make("published-balance")
    scene = task.scene({})
    state = scene.pack(object={"position": (5.0, 6.0, 0.0)}, effector={"position": (5.0, 5.0, 0.0)})
    asked, defined = task.problem(state), task.recorded_problem(state)
    assert defined.captured.contains(scene, state) and not asked.captured.contains(scene, state)


def test_an_agreement_is_of_states_that_both_sides_have():
    rng = np.random.default_rng(0)
    theirs = {"capture": rng.random(50), "effort/est": rng.random(50)}
    theirs["effort/est"][:10], theirs["effort/est"][10:20] = np.inf, 100.0  # neither was found
    ours = {name: values**2 for name, values in theirs.items()} | {AGAIN: -theirs["capture"]}
    ours["capture"][:5] = np.nan
    capture, effort = agreement("push", theirs, ours, np.arange(50) < 30)
    assert capture[:6] == ["push capture", "45", "1.00", "1.00", "-1.00", "-1.00"]
    assert effort[:6] == ["push effort/est", "30", "1.00", "1.00", "—", "—"]
    assert float(capture[6]) == pytest.approx(theirs["capture"][5:].mean(), abs=1e-3)


def test_a_published_task_makes_no_trajectories_of_its_own(folder):
    for task in (em.tasks.make("published-push"), recorded_task(folder, COMBINATION)):
        with pytest.raises(ValueError, match="import-published DIR"):
            task.rollout(0)
    with pytest.raises(ValueError, match="tool is 'hand', expected 'jaw' or 'circle'"):
        PublishedRecorded(str(folder), "rectangle", "hand")


def test_success_is_a_margin_and_a_set_that_agree(folder):
    task = recorded_task(folder, COMBINATION)
    scene, region = task.scene({}), task.succeeded({})
    random = np.random.default_rng(0)
    poses = np.stack([np.zeros(300), random.uniform(-0.13, -0.09, 300), random.uniform(-3, 3, 300)])
    states = np.stack(
        [scene.pack(object={"position": (0, y, 0.015), "yaw": yaw}) for _, y, yaw in poses.T]
    )
    inside = region.contains(scene, states)
    assert inside.any() and not inside.all()
    assert np.array_equal(inside, task.margin(poses.T) <= SLACK["rectangle"])


# -- the authors' own data

AUTHORS = {  # AUC/AP of the even half, h = 0 to 5, all states and captured now: its README.md
    ("push", "capture", "all"): ".959/.989 .907/.960 .857/.923 .770/.847 .737/.806 .714/.722",
    ("push", "capture", "captured"): ".765/.967 .766/.927 .713/.849 .717/.808 .714/.722",
    ("push", "effort/est", "all"): ".930/.983 .946/.982 .944/.975 .963/.976 .937/.938 .866/.819",
    ("push", "effort/est", "captured"): ".909/.989 .920/.978 .955/.977 .932/.938 .866/.819",
    ("balance", "capture", "all"): ".994/.998 .976/.990 .940/.970 .882/.932 .787/.845 .713/.713",
    ("balance", "capture", "captured"): ".921/.992 .872/.970 .817/.932 .716/.845 .654/.713",
    ("balance", "effort/est", "captured"): ".958/.996 .950/.990 .936/.981 .898/.957 .825/.880",
    ("topple", "capture", "all"): ".941/.938 .984/.971 .976/.954 .983/.963 .977/.952 .934/.825",
    ("topple", "capture", "captured"): ".994/.999 .956/.979 .982/.989 .966/.966 .910/.827",
    ("topple", "effort/est", "captured"): ".758/.950 .794/.913 .860/.913 .960/.952 .914/.893",
    ("grasp", "capture", "all"): "1.00/1.00 .974/.991 .935/.973 .938/.971 .905/.905 .846/.823",
    ("grasp", "capture", "captured"): ".863/.991 .828/.973 .890/.971 .875/.905 .833/.823",
}


@needs_data
@pytest.mark.parametrize(("part", "score", "among"), AUTHORS)
def test_the_authors_cells_come_out_of_the_readers(part, score, among):
    labelled = authors.labelled_scores(DATA, part)
    cells = evaluate(labelled, draws=2, among=among).states[score].values()
    assert " ".join(cell.value() for cell in cells) == AUTHORS[part, score, among]


@needs_data
def test_the_authors_recordings_come_out_of_the_readers():
    parts = [part for part in authors.parts(DATA) if part not in authors.SIMULATED]
    horizons = (0, 1, 2, 5, 10, 20)
    every = [authors.labelled_scores(DATA, part) for part in parts]
    results = [evaluate(labelled, frames=horizons, draws=2) for labelled in every]
    of_all = [[(c.auc, c.ap) for c in r.states["capture"].values()] for r in results]
    assert np.mean(of_all, axis=0).round(3).tolist() == [
        *([0.908, 0.958], [0.814, 0.875], [0.763, 0.797]),
        *([0.71, 0.647], [0.661, 0.467], [0.632, 0.297]),
    ]
    now = [
        evaluate(one, frames=horizons, draws=2, among="captured").states["capture"] for one in every
    ]
    aucs = np.mean([[cell.auc for cell in cells.values()] for cells in now], axis=0)
    assert aucs.round(3).tolist() == [0.571, 0.55, 0.557, 0.532, 0.524]
    success = np.mean([(r.success.auc, r.success.ap) for r in results], axis=0)
    assert success.round(3).tolist() == [0.947, 0.926]


@needs_data
@pytest.mark.parametrize("part", ("push", "balance", "topple", "grasp"))
def test_the_capture_sets_give_the_authors_labels_back(part):
    dataset = authors.dataset(DATA, part)
    inside = _inside_the_sets_of_the_labels(dataset)
    labels = np.concatenate([trajectory.captured for trajectory in dataset.trajectories])
    assert np.mean(np.array(inside) == labels) == 1.0


@needs_data
@pytest.mark.parametrize(
    ("part", "least"), (("push", 0.75), ("balance", 0.7), ("topple", 0.85), ("grasp", 0.8))
)
def test_our_scores_rank_the_states_as_the_authors_do(part, least):
    dataset, theirs = authors.dataset(DATA, part), authors.labelled_scores(DATA, part)
    numbers = list(range(0, 100, 2))
    ours = em.score(dataset.problems(numbers), ["capture"], nodes=100, seed=1)["capture"]
    assert stats.spearmanr(ours, theirs.scores["capture"][numbers]).statistic > least


@needs_data
def test_fingers_of_the_authors_search_hold_their_angles_while_the_table_falls():
    dataset = authors.dataset(DATA, "grasp")
    task, trajectory = em.tasks.make(dataset.task, **dataset.parameters), dataset.trajectories[0]
    for k, falls in ((0, False), (6, True)):
        scene = task.search_scene(trajectory.states[k], trajectory.params)
        joints = scene.unpack(trajectory.states[k])["joints"]
        for joint in scene.joints:
            if joint.name.startswith("finger"):
                assert joint.target == pytest.approx(joints[joint.name]["position"])
        (table,) = [body for body in scene.bodies if body.name == "table"]
        assert (table.force[2] == 0) == falls


@needs_data
def test_the_rules_of_success_give_the_observers_labels_back():
    wrong = total = 0
    for part in authors.parts(DATA):
        if part in authors.SIMULATED:
            continue
        task = recorded_task(Path(DATA), part)
        for track in tracks(Path(DATA) / "recordings" / part):
            reached = task.margin(track.poses["object"][-1:])[0] <= SLACK[task.object]
            wrong += bool(reached) != track.success
            total += 1
    assert total >= 60 and wrong <= 0.05 * total, f"{wrong} of {total}"


# -- the study


def test_the_study_holds_both_sides_against_the_same_states_and_goes_on(folder, tmp_path):
    arguments = ["reproduce", "published", "--data", folder, "--quick", "--nodes", 5]
    done = run(*arguments, "--every", 2, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out"
    text = (out / "published.md").read_text()
    assert "## Simulated, captured now" in text and "smoothed labels" in text
    assert "0 states could not be scored and are left out." in text and "nan" not in text.lower()
    assert (out / "published.png").stat().st_size > 10_000
    lines = (out / "runs.jsonl").read_text().splitlines()
    assert len(lines) == 2 * 2 * 4 + 2 * 6  # simulated states, and every second frame
    with (out / "published.csv").open() as file:
        rows = list(csv.DictReader(file))
    theirs = {row["horizon"]: row for row in rows if _is(row, "push", "theirs", "capture", "all")}
    expected = evaluate(authors.labelled_scores(folder, "push"), draws=2).states["capture"]
    assert float(theirs["0"]["auc"]) == pytest.approx(expected[0].auc)
    (out / "runs.jsonl").write_text("".join(f"{line}\n" for line in lines[:-3]))
    again = run(*arguments, "--every", 2, "-o", "out", cwd=tmp_path)
    assert again.returncode == 0 and (out / "published.md").read_text() == text
    scored = [json.loads(line)[1]["scores"] for line in lines]
    kept = [json.loads(line)[1]["scores"] for line in (out / "runs.jsonl").open()]
    assert sorted(map(str, kept)) == sorted(map(str, scored))


def test_the_study_refuses_what_it_cannot_do(folder, tmp_path):
    for options, words in (
        (["--parts", "push,grasp"], "parts has 'grasp', expected some of push, topple, jaw"),
        (["--every", 3], "every is 3, expected 1, 2, 5 or 10"),
        (["--nodes", 0], "nodes is 0, expected a whole number of at least 1"),
    ):
        done = run("reproduce", "published", "--data", folder, *options, cwd=tmp_path)
        assert done.returncode == 2 and words in " ".join(done.stderr.split()), done.stderr


def _inside_the_sets_of_the_labels(dataset):
    task = em.tasks.make(dataset.task, **dataset.parameters)
    problems = [
        task.recorded_problem(state, trajectory.params)
        for trajectory in dataset.trajectories
        for state in trajectory.states
    ]
    return [bool(p.captured.contains(p.scene, p.state)) for p in problems]


def _is(row, part, side, score, among):
    return (row["part"], row["side"], row["score"], row["among"]) == (part, side, score, among)
