"""The command `energymargin grasps`, its page, its pictures, and the viewer of a grasp."""

import csv
import os
import re
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import trimesh
from browsers import watched_page
from clusters import Cluster
from command_line import COMMAND, run, run_here

import energymargin as em
from energymargin.cli.grasp_words import (
    chosen_belief,
    chosen_frame,
    chosen_hand,
    chosen_protocol,
    chosen_rows,
)
from energymargin.grasps import HandFile, Motion, ParallelGripper
from energymargin.grasps.hands import PANDA
from energymargin.grasps.protocols import LIFT
from energymargin.summary import summary

DOWN = "1,0,0,0"  # half a turn about x: the approach points down
LIGHT = ["--hand", "panda", "--object", "box.stl", "--mass", "0.1"]
FEW = [*LIGHT, "--rollouts", "2"]


def rows_of(names, places, labels):
    lines = ["name,x,y,z,qx,qy,qz,qw,label"]
    lines += [
        f"{name},{x},{y},{z},{DOWN},{label}"
        for name, (x, y, z), label in zip(names, places, labels, strict=True)
    ]
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A box with grasps in its middle, at its edge, and beside it; forty of them in another."""
    folder = tmp_path_factory.mktemp("grasps")
    trimesh.creation.box((0.05, 0.08, 0.06)).export(folder / "box.stl")
    places = [(0, 0.07, 0.02), (0, 0, 0.015), (0, 0.02, 0.02)]
    names = ["beside", "middle", "edge"]
    (folder / "three.csv").write_text(rows_of(names, places, [0, 1, 1]))
    many = [(0, y, 0.02) for y in np.linspace(-0.06, 0.06, 40)]
    held = [int(abs(y) < 0.04) for _, y, _ in many]
    (folder / "forty.csv").write_text(rows_of([f"g{k}" for k in range(40)], many, held))
    return folder


@pytest.fixture(scope="module")
def scores(folder):
    box = em.grasps.GraspObject.load(folder / "box.stl", mass=0.1)
    return em.grasps.score(em.grasps.read(folder / "three.csv"), "panda", box, rollouts=2)


@pytest.fixture(scope="module")
def many(folder):
    box = em.grasps.GraspObject.load(folder / "box.stl", mass=0.1)
    return em.grasps.score(em.grasps.read(folder / "forty.csv"), "panda", box, rollouts=1)


def refused(done, *words):
    """The last line says what is wrong, the exit code is 2, and there is no table."""
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 2 and last.startswith("error: ") and not done.stdout, done.stderr
    assert all(word in last for word in words), last


def test_one_command_ranks_the_grasps_of_a_file_beside_their_labels(folder):
    done = run_here("grasps", "three.csv", *FEW, cwd=folder)
    assert done.returncode == 0, done.stderr
    table = done.stdout.splitlines()
    ranked = [line.split()[1] for line in table if re.match(r"[123]  ", line)]
    assert set(ranked[:2]) == {"middle", "edge"} and ranked[2] == "beside"
    assert "2 not gripped" in done.stdout
    assert re.search(
        r"AUC 1.00 \(0.\d\d to 1.00\) against the labels: 2 held, 1 lost.", done.stdout
    )
    assert "three.csv: 3 grasps, 67% of them recorded as held" in done.stderr
    assert "0.05 x 0.08 x 0.06 m, 0.1 kg, friction 0.5" in done.stderr


def test_tables_pictures_pages_and_grasps_are_written_by_their_suffix(folder):
    names = ("t.csv", "t.md", "t.png", "t.html")
    outputs = [word for name in names for word in ("-o", name)]
    done = run_here("grasps", "three.csv", *FEW, *outputs, "--write", "scored.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert all(f"Wrote {name}" in done.stderr for name in (*names, "scored.csv"))
    with (folder / "t.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows][2] == "beside" and rows[2]["not_gripped"] == "2"
    text = (folder / "t.md").read_text()
    assert "| 3 | beside | 0.00 |" in text and "| protocol | hold for 1 s; gravity" in text
    assert (folder / "t.png").stat().st_size > 5000
    written = em.grasps.read(folder / "scored.csv")
    assert written.columns["energymargin/probability"].tolist() == [0, 1, 1]
    assert written.labels.tolist() == [0, 1, 1]
    again = run_here("grasps", "three.csv", *FEW, "-o", "t.csv", cwd=folder)
    refused(again, "t.csv exists", "--overwrite")


def kept(path):
    """What a store has of each grasp."""
    with suppress(ValueError), em.store.AnswerFile(path) as store:
        return sorted(row[0] for row in store.database.execute("SELECT content FROM answers"))
    return []


def test_a_file_of_scores_is_gone_on_with_and_takes_another_question(folder):
    command = ["grasps", "three.csv", *FEW, "-o", "scores.db"]
    first = run_here(*command, cwd=folder)
    before = kept(folder / "scores.db")
    assert len(before) == 3
    again = run_here(*command, cwd=folder)
    assert again.returncode == 0 and again.stdout == first.stdout
    assert kept(folder / "scores.db") == before
    other = run_here(*command, "--protocol", "shake", cwd=folder)
    assert other.returncode == 0 and len(kept(folder / "scores.db")) == 6
    assert run_here(*command, cwd=folder).stdout == first.stdout


def test_a_shake_with_a_belief_is_asked_by_words_alone(folder):
    words = [
        "--protocol",
        '{"preset": "lift", "radius": 0.05}',
        "--object-pose",
        "0,0,-.005,0,0,0,1",
    ]
    belief = '{"pose": [0.002, 0.002, 0.002, 0.02, 0.02, 0.02], "friction": 0.05, "force": 2}'
    words += ["--belief", belief, "--where", "name=middle", "--effort", 20, "-o", "lift.md"]
    command = ["grasps", "three.csv", *FEW, "--friction", "0.8", "--colliding", "lost"]
    done = run_here(*command, *words, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "1 grasp, 2 trials of 1.5 s each" in done.stdout and " J" in done.stdout
    asked = (folder / "lift.md").read_text()
    assert "friction 0.8" in asked and "on a table" in asked and "counts as lost" in asked
    assert "force 2" in asked and "more than 0.05 m" in asked


def test_after_a_timeout_the_grasps_are_shown_that_are_finished(folder):
    command = ["grasps", "forty.csv", *LIGHT, "--rollouts", 60, "--threads", 1]
    done = run_here(*command, "--timeout", 8, "-o", "timed.db", cwd=folder)
    assert done.returncode == 124, done.stderr
    count = int(re.search(r"(\d+) of 40 grasps are scored and kept in timed.db", done.stderr)[1])
    assert 0 < count < 40 and f"{40 - count} of 40 grasps were not scored" in done.stdout


def test_a_timeout_before_the_first_grasp_says_that_nothing_is_finished(folder):
    done = run_here("grasps", "forty.csv", *FEW, "--timeout", 1e-6, "-o", "late.csv", cwd=folder)
    assert done.returncode == 124 and not done.stdout, done.stderr
    last = "nothing is finished: the time was over before a grasp has its score"
    assert done.stderr.splitlines()[-1] == last and not (folder / "late.csv").exists()


def test_grasps_none_of_which_has_a_score_make_pages_that_say_so(folder):
    weightless = '{"preset": "panda", "mass": 1e-300, "force": 1e300}'
    outputs = [word for name in ("n.csv", "n.md", "n.png", "n.html") for word in ("-o", name)]
    command = ["grasps", "three.csv", *FEW, "--hand", weightless, *outputs, "--write", "w.csv"]
    done = run_here(*command, "--baselines", "--view", "v.html", cwd=folder)
    assert "Wrote n.html" in done.stderr and "w.csv is not written" in done.stderr, done.stderr
    assert done.returncode == 2 and "none of the 3 grasps has a trial that counts" in done.stderr
    assert "| 1 | beside | 2 diverged | 0 |" in (folder / "n.md").read_text()
    page = (folder / "n.html").read_text()
    assert "No grasp has a score." in page and "Pictures" not in page


def test_ctrl_c_keeps_what_is_scored_and_the_same_command_goes_on(folder):
    command = ["grasps", "forty.csv", *LIGHT, "--rollouts", "40", "-o", "part.db"]
    process = subprocess.Popen(
        [COMMAND, *command, "--threads", "1"], cwd=folder, stderr=subprocess.PIPE, text=True
    )
    end = time.monotonic() + 120
    while not ((folder / "part.db").exists() and kept(folder / "part.db")):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130 and "stopped" in said and "Traceback" not in said
    count = int(re.search(r"(\d+) of 40 grasps are scored and kept in part\.db", said)[1])
    before = kept(folder / "part.db")
    assert 0 < count == len(before) < 40
    done = run(*command, "--timeout", 1e6, cwd=folder)
    assert done.returncode == 0, done.stderr
    after = kept(folder / "part.db")
    assert len(after) == 40 and set(before) <= set(after)


def test_baselines_are_columns_and_stand_beside_the_labels(folder):
    command = ["grasps", "three.csv", *FEW, "--baselines", "-o", "b.csv", "--write", "c.csv"]
    done = run_here(*command, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "2 of 3 grasps hold (the object)." in done.stdout and "epsilon" in done.stdout
    with (folder / "b.csv").open() as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert float(rows["middle"]["center_distance"]) == pytest.approx(0.015, abs=1e-6)
    assert rows["beside"]["epsilon"] == "" and float(rows["middle"]["volume"]) > 0
    assert em.grasps.read(folder / "c.csv").columns["energymargin/undisturbed"].tolist() == [
        0,
        1,
        1,
    ]


def test_the_guide_s_hand_of_a_file_ranks_as_the_preset_does(folder):
    guide = (Path(__file__).parents[3] / "docs/guides/grasps.md").read_text()
    (text,) = re.findall(r"```json\n(.*?)```", guide, re.DOTALL)
    data = pytest.importorskip("pybullet_data").getDataPath()
    (folder / "panda.json").write_text(text.replace("franka_panda/", f"{data}/franka_panda/"))
    command = ["grasps", "three.csv", "--hand", "panda.json", *FEW[2:], "-o", "hand.md"]
    done = run_here(*command, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^3 +beside +0.00", done.stdout, re.MULTILINE)
    assert re.search(r"^[12] +middle +1.00", done.stdout, re.MULTILINE)
    assert "panda.urdf" in (folder / "hand.md").read_text()


def test_processes_and_a_cluster_have_the_same_table(folder):
    command = ["grasps", "three.csv", *FEW]
    here = run_here(*command, "--threads", 1, cwd=folder)
    assert run_here(*command, "--processes", 2, cwd=folder).stdout == here.stdout
    with Cluster(workers=1) as cluster:
        there = run_here(*command, "--scheduler", cluster.address, cwd=folder)
    assert there.returncode == 0 and there.stdout == here.stdout, there.stderr


def test_at_most_so_many_grasps_are_taken_evenly_from_the_file(folder):
    done = run_here("grasps", "forty.csv", *FEW, "--most", 3, "--rollouts", 1, cwd=folder)
    names = [line.split()[1] for line in done.stdout.splitlines() if re.match(r"[123]  ", line)]
    assert set(names) == {"g0", "g20", "g39"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"--hand": "shadow"},
            ("--hand is 'shadow', expected panda, robotiq_2f85,", "wsg_50, JSON"),
        ),
        ({"--hand": "my.urdf"}, ("--hand is 'my.urdf'", '"path": "my.urdf", "close": {"JOINT"')),
        ({"--hand": '{"force": 3}'}, ("--hand has no 'opening'",)),
        ({"--hand": '{"opening": 0.1, "forse": 3}'}, ("--hand has 'forse'", "force")),
        ({"--protocol": "drop"}, ("--protocol is 'drop'", "lift, graspa, acronym, shake")),
        ({"--belief": '{"poze": 1}'}, ("--belief is 'poze'", "pose")),
        ({"--belief": "none.json"}, ("--belief is 'none.json'",)),
        ({"--where": "name=far"}, ("where has", "beside")),
        ({"--where": "far"}, ("--where is 'far', expected COLUMN=VALUE",)),
        ({"--frame": "hand"}, ("--frame is 'hand'", "panda_hand")),
        ({"--view": "fourth"}, ("--view is fourth", ".html")),
        ({"--object": "none.stl"}, ("none.stl",)),
        ({"--mass": "80"}, ("mass is 80 kg",)),
        ({"--mesh-scale": "1000"}, ("object is 80 m large", "--mesh-scale 0.001")),
        ({"--scale": "1000"}, ("in mm needs --scale 0.001", "need --object-pose")),
        ({"-o": "t.xyz"}, ("-o is t.xyz, expected a name with .db or .csv",)),
        (
            {"-o": "twice.csv", "--write": "twice.csv"},
            ("--write is twice.csv, which is output too",),
        ),
        ({"--write": "t.npz"}, ("--write is t.npz", ".yaml")),
        ({"--rollouts": "0"}, ("rollouts is 0",)),
        ({"--most": "0"}, ("--most is 0",)),
    ],
)
def test_what_is_wrong_is_named_before_anything_is_scored(folder, change, words):
    given = dict(zip(LIGHT[::2], LIGHT[1::2], strict=True)) | change
    refused(
        run_here("grasps", "three.csv", *(w for pair in given.items() for w in pair), cwd=folder),
        *words,
    )


def test_quaternions_in_another_order_and_a_hand_that_is_too_narrow_are_doubted(folder):
    right, doubt = (0.7071068, 0, 0, 0.7071068), "order of the quaternions (x, y, z, w) right"
    for name, quaternion in (("right", right), ("swapped", (right[3], *right[:3]))):
        row = ",".join(map(str, (0, 0.03, -0.02, *quaternion)))
        (folder / f"{name}.csv").write_text(f"x,y,z,qx,qy,qz,qw\n{row}\n")
    said = [
        " ".join(run_here("grasps", f"{name}.csv", *FEW, *words, cwd=folder).stdout.split())
        for name, words in (
            ("right", ()),
            ("swapped", ()),
            ("right", ("--hand", '{"opening": 0.04}')),
        )
    ]
    assert [doubt in text for text in said] == [False, True, True]
    assert "object, 0.05 x 0.08 x 0.06 m, fit into an opening of 0.04 m?" in said[2]


def test_an_object_that_is_not_told_is_asked_for_by_the_option(folder):
    refused(run_here("grasps", "three.csv", *LIGHT[:2], cwd=folder), "--object is not given")
    refused(run_here("grasps", "three.csv", *LIGHT[:4], cwd=folder), "--mass is not given")
    lines = (folder / "three.csv").read_text().splitlines()
    several = [
        f"{line},{name}" for line, name in zip(lines, ("object", "a", "a", "b"), strict=True)
    ]
    (folder / "several.csv").write_text("\n".join(several))
    command = ["grasps", "several.csv", *LIGHT, "--rollouts", 1]
    refused(run_here(*command, cwd=folder), "grasps of 2 objects", "--where object=a")
    assert run_here(*command, "--where", "object=b", cwd=folder).returncode == 0


def test_words_are_hands_protocols_beliefs_frames_and_rows(tmp_path):
    assert chosen_hand("panda") is PANDA
    assert chosen_hand('{"preset": "panda", "force": 20}').force == 20
    assert chosen_hand('{"opening": 0.1}') == ParallelGripper(0.1)
    given = '{"path": "h.urdf", "close": {"a": [0, 1]}, "fingers": ["l", "r"]}'
    assert isinstance(chosen_hand(given), HandFile)
    path = tmp_path / "p.json"
    path.write_text('{"motions": [{"kind": "lift", "duration": 1, "amount": 0.1}], "radius": 0.02}')
    lifted = chosen_protocol(str(path))
    assert lifted.motions == (Motion("lift", 1, 0.1),) and lifted.radius == 0.02
    assert chosen_protocol('{"preset": "lift", "dwell": 0}').motions == LIFT.motions
    belief = chosen_belief('{"pose": [1, 1, 1, 0, 0, 0], "force": 2, "about": "center_of_mass"}')
    assert belief.force == 2 and belief.about == "center_of_mass" and belief.mass is None
    assert chosen_frame("0.1034") == 0.1034 and chosen_frame("0,0,0,0,0,0,1")[6] == 1
    rows = chosen_rows(["object=YcbBanana,layout=0", "layout=1"])
    assert rows == {"object": ["YcbBanana"], "layout": [0, 1]}


@pytest.mark.skipif("ENERGYMARGIN_GRASPS" not in os.environ, reason="it names no folder")
@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("acronym/mug.h5", ["--protocol", "acronym"]),
        (
            "graspa/grasps.csv",
            [
                *("--object-pose", "{}/graspa/objects.csv", "--where", "object=YcbBanana"),
                *("--mass", "0.066", "--protocol", "graspa"),
            ],
        ),
    ],
)
def test_files_of_others_need_no_more_than_a_hand_and_what_they_lack(tmp_path, file, words):
    data = os.environ["ENERGYMARGIN_GRASPS"]
    words = [word.format(data) for word in words]
    command = ["grasps", f"{data}/{file}", "--hand", "panda", "--most", 4, "--rollouts", 1]
    done = run_here(*command, *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(re.findall(r"^[1-4]  ", done.stdout, re.MULTILINE)) == 4 and "label" in done.stdout


def test_help_has_ten_options_before_the_first_heading(folder):
    done = run_here("grasps", "--help", cwd=folder)
    first = done.stdout.split("╭─ Which grasps")[0]
    options = set(re.findall(r"│ \*?\s+(--[\w-]+)", first)) - {"--help"}
    assert len(options) == 10 and "--colliding" in done.stdout


def test_a_summary_has_the_best_the_most_doubtful_and_the_worst(many, scores):
    said = summary(many)
    ranks = [int(row[0]) for row in said.rows]
    assert ranks[:4] == [1, 2, 3, 4] and ranks[-4:] == [37, 38, 39, 40] and len(ranks) == 12
    assert "AUC" in said.notes[0]
    html = many._repr_html_()
    assert "40 grasps, 1 trial of 1 s each" in html and "data:image/png" in html
    assert len(summary(scores).rows) == 3 and "middle" in scores.to_markdown()


def test_marks_are_coloured_by_label(many):
    ax = em.plots.plot_grasps(many)
    counts = {line.get_label(): len(line.get_xdata()) for line in ax.lines}
    labels = many.grasps.labels
    assert counts["recorded as held"] == labels.sum()
    assert counts["recorded as lost"] == (1 - labels).sum()
    heights = np.concatenate([line.get_ydata() for line in ax.lines])
    assert np.sort(heights).tolist() == np.sort(many.probabilities).tolist()
    with pytest.raises(ValueError, match="scores is 3"):
        em.plots.plot_grasps(3)


def patches(ax, color):
    return [p for p in ax.patches if tuple(np.round(p.get_edgecolor()[:3], 2)) == color]


@pytest.mark.parametrize("name", ["beside", "middle"])
def test_a_picture_has_the_closed_hand_above_the_object_from_two_sides(scores, name):
    figure = em.plots.figure_grasp(scores, scores.grasps.names.index(name))
    green, orange = (0.0, 0.62, 0.45), (0.9, 0.62, 0.0)
    for ax in figure.axes:
        hand = np.concatenate([p.get_xy() for p in patches(ax, green)])
        box = np.concatenate([p.get_xy() for p in patches(ax, orange)])
        assert hand[:, 1].max() > box[:, 1].max() + 0.05
        assert hand[:, 1].min() < box[:, 1].max()
    fingers = np.concatenate([p.get_xy() for p in patches(figure.axes[0], green)])
    inner = np.abs(fingers[fingers[:, 1] < 0, 0]).min()
    assert inner == pytest.approx(0.025 if name == "middle" else 0.0, abs=2e-3)
    title = {"beside": "the hand does not close on the object", "middle": "gripped"}[name]
    assert figure.get_suptitle().startswith(f"{name}: {title}")
    with pytest.raises(ValueError, match="number is 3, expected a whole number from 0 to 2"):
        em.plots.figure_grasp(scores, 3)


def test_a_page_of_grasps_needs_no_network_and_has_their_pictures(scores, chromium, tmp_path):
    em.report.write_grasps(scores, tmp_path / "g.html", title="Grasps of <three>")
    with watched_page(chromium) as (page, wrong):
        page.goto(f"file://{tmp_path / 'g.html'}")
        assert page.locator("h1").inner_text() == "Grasps of <three>"
        images = page.locator("img").evaluate_all("all => all.map(one => one.naturalWidth)")
        assert len(images) == 3 and min(images) > 100
        titles = page.locator(".card strong").all_inner_texts()
        assert titles[-1] == "The worst: beside" and titles[0].startswith("The best: ")
        assert page.locator("#table tbody tr").count() == 3
        assert wrong == []
    with pytest.raises(ValueError, match=r"expected a name with \.html"):
        em.report.write_grasps(scores, Path("g.pdf"))


def test_grasps_turn_and_play_on_a_page_the_best_first(folder, chromium):
    done = run_here("grasps", "three.csv", *FEW, "--view", "v.html", cwd=folder)
    assert done.returncode == 0 and "Wrote v.html" in done.stderr, done.stderr
    with watched_page(chromium) as (page, wrong):
        page.goto((folder / "v.html").as_uri())
        assert page.locator("#shot option").count() == 3
        page.get_by_text("held with probability").wait_for()
        page.locator("#shot").select_option(index=2)
        page.get_by_text("this is the open hand").wait_for()
        assert wrong == []
