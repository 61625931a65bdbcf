"""Reports of small stores, read as a browser reads them, and in one."""

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from command_line import COMMAND, run
from reports import METRICS, SETTINGS, Document, scores, written
from stores import changed

from energymargin import datasets, report
from energymargin.base.table_text import short
from energymargin.datasets import Future
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import evaluate
from energymargin.look.report.pictures import SearchRepeater, chosen
from energymargin.records.evaluation.curves import (
    CAPTURED,
    SUCCESS,
    metrics_against,
    precision_recall,
    ranks,
    roc,
)
from energymargin.records.evaluation.labelled import HORIZON
from energymargin.store import ScoreStore, score_dataset


@pytest.fixture(scope="module")
def document(pushes_report):
    return Document(pushes_report / "report.html")


@pytest.fixture(scope="module")
def labelled(pushes_report):
    return scores(pushes_report / "push-scores.db")


@pytest.fixture
def own(pushes_report, tmp_path):
    """A folder with the same dataset and scores, which a test may change."""
    for name in ("push.h5", "push-scores.db"):
        shutil.copy(pushes_report / name, tmp_path / name)
    return tmp_path


def test_the_page_loads_nothing_from_elsewhere(pushes_report, document):
    loaded = document.attributes("src") + document.attributes("href")
    assert loaded and all(url.startswith(("#", "data:")) for url in loaded)
    style = re.findall(
        r"<style>(.*?)</style>", (pushes_report / "report.html").read_text(), re.DOTALL
    )
    assert not any("url(" in text or "@import" in text for text in style)


def test_the_table_holds_the_very_numbers_of_evaluate(document, labelled):
    result = evaluate(labelled, draws=200)
    for score, cells in result.states.items():
        shown = [[cell.value(), *cell.intervals()] for cell in cells.values()]
        assert document.row(score)[: len(shown)] == shown
    own = [result.success.value(), *result.success.intervals()]
    first, *others = document.row("success")
    assert first == own and others == [[]] * 5


def test_the_page_says_what_was_scored_and_how(document, labelled):
    said = f"Captured: {labelled.captured.sum()} of {len(labelled.captured)} states; successful: "
    assert document.row("labels")[0][0].startswith(said)
    assert "Run 1 of push-scores.db" in document.text
    assert document.row("states scored") == [["72 of 72"]]
    assert "nodes = 15" in document.row("settings")[0][0]
    assert "friction drawn at random, effector = drive" in document.row("parameters")[0][0]
    assert re.match(
        r"[\d.]+ s: capture \d+%, effort \d+%, effort/est \d+%",
        document.row("time of a state")[0][0],
    )
    assert "No picture" not in document.text and not document.text.count("not scored")
    assert (
        "captured in its own frame and in all of the next h ; states with fewer frames left are "
        "left out." in document.text
    )


def test_no_card_is_of_a_state_whose_label_would_look_past_the_end(own):
    path = own / "push-scores.db"
    (own / "push.h5").unlink()  # cards without pictures, which take their time
    changed(path, "DELETE FROM scores WHERE question <> 1")
    changed(path, "UPDATE states SET captured = number % 6 >= 3")
    values = " ".join(f"WHEN {k} THEN {v}" for k, v in enumerate((1, 0.9, 0.8, 0.95, 0.85, 0.5)))
    changed(path, f"UPDATE scores SET value = CASE stream % 6 {values} END WHERE question = 1")
    assert "frame 5." in written(own, pictures=2, frames=0).text
    ahead = written(own, pictures=2, frames=2).text
    assert "frame 3." in ahead and "frame 4." not in ahead and "frame 5." not in ahead


def test_a_horizon_that_no_state_has_is_refused_and_the_default_is_one_that_some_have(own):
    with pytest.raises(ValueError, match=r"horizon is 6 frames, expected 0 to 5: .* has 6 frames"):
        written(own, frames=6)
    assert "captured over the next 5 frames" in written(own, frames=5).text
    dataset = datasets.generate("push", trajectories=2, frames=2, seed=1)
    (own / "push-scores.db").unlink()
    score_dataset(dataset, own / "push-scores.db", ["force"])
    assert "“captured over the next 1 frame”" in written(own).text


def test_intervals_of_few_trajectories_come_with_a_caution(own, document):
    caution = "These intervals are of 9 trajectories."
    assert "These intervals are of" not in document.text
    changed(own / "push-scores.db", "DELETE FROM scores WHERE stream >= 54")
    assert caution in written(own).text


def test_the_same_scores_make_the_same_bytes_whenever_they_were_copied(own):
    written(own)
    first = (own / "r.html").read_bytes()
    os.utime(own / "push-scores.db", (0, 0))
    written(own)
    assert (own / "r.html").read_bytes() == first


def test_the_curves_are_drawn_for_each_label_with_their_auc_and_ap(document, labelled):
    pictures = document.pictures["roc"]
    assert len(pictures) == 2
    for picture, target in ((pictures[0], CAPTURED), (pictures[-1], SUCCESS)):
        for metric in metrics_against(labelled, target):
            auc, ap = (
                roc(labelled, metric, target=target),
                precision_recall(labelled, metric, target=target),
            )
            assert f"{metric} {short(auc.auc)}" in picture.texts
            assert f"{metric} {short(ap.ap)}" in picture.texts


def test_every_trajectory_is_drawn_with_all_its_scores(document, labelled):
    pictures = document.pictures["along"]
    assert len(pictures) == 12
    titles = {picture.texts[-1] for picture in pictures}
    for picture in pictures:
        assert set(METRICS) - {"effort/est", "effort/rrt"} <= set(picture.texts)
        assert "time [s]" in picture.texts and "effort of escape [J]" in picture.texts
    said = [text for picture in pictures for text in picture.texts]
    assert titles and said.count("∞") == sum(
        any(np.isposinf(v[own]).any() for m, v in labelled.scores.items() if "effort" in m)
        for own in labelled.by_trajectory()
    )


def test_the_histograms_count_every_state(document, labelled):
    (picture,) = document.pictures["distributions"]
    counts = [re.fullmatch(r"(.*) \((\d+)\)", text) for text in picture.texts]
    found = [(one[1], int(one[2])) for one in counts if one]
    of_states = sum(count for label, count in found if "trajectory" not in label)
    of_trajectories = sum(count for label, count in found if "trajectory" in label)
    whole = 12 * (6 - HORIZON)  # of each trajectory the states with as many frames left
    assert (of_states, of_trajectories) == (5 * whole, 12)


def test_how_wrong_a_score_is_means_what_the_auc_lacks_of_one():
    # Captured 3 and 2, lost 2 and 1: of the four pairs three are right and one is a tie.
    wrong = ranks(np.array([3.0, 2.0, 2.0, 1.0]), np.array([True, True, False, False])).wrong
    assert wrong.tolist() == [0.0, 0.25, 0.25, 0.0]
    random = np.random.default_rng(0)
    ties, labels = random.integers(0, 9, 200).astype(float), random.random(200) < 0.3
    ties[ties == 8] = np.inf
    from sklearn.metrics import roc_auc_score

    lacking = 1 - roc_auc_score(labels, np.where(np.isinf(ties), 99, ties))
    wrong = ranks(ties, labels).wrong
    assert wrong[labels].mean() == pytest.approx(lacking)
    assert wrong[~labels].mean() == pytest.approx(lacking)


def test_a_state_that_is_level_with_others_is_said_to_be_and_is_not_wrong_by_that_alone(own):
    path = own / "push-scores.db"
    (own / "push.h5").unlink()
    changed(path, "UPDATE states SET captured = trajectory < 4")
    changed(path, "UPDATE scores SET value = 1 WHERE question = 1")  # the capture score
    assert "capture 1.000, but" not in written(own, pictures=1).text  # as of a card
    # A captured state of score .5, and lost ones: 6 above it, 12 level, and 30 below.
    value = (
        "CASE WHEN stream < 24 THEN .5 WHEN stream < 30 THEN 1 WHEN stream < 42 THEN .5 ELSE 0 END"
    )
    changed(path, f"UPDATE scores SET value = {value} WHERE question = 1")
    text = written(own, pictures=1, frames=0).text
    assert "Ranked below or level with 37.5 % of all with the other label." in text
    assert "Ranked above 100 % of all with the other label." in text


def test_the_trees_of_the_pictures_have_the_scores_of_the_file(pushes_report, labelled):
    with datasets.open(pushes_report / "push.h5") as dataset:
        repeater = SearchRepeater(dataset, SETTINGS.all())
        for metric in METRICS:
            found = [repeater.repeat(number, metric).score for number in (0, 35, 71)]
            assert found == labelled.scores[metric][[0, 35, 71]].tolist()


def test_a_page_of_the_frames_to_come_says_so_and_gives_the_command_for_the_rest(own):
    path, future = own / "push-scores.db", Future(2, "hold")
    settings = replace(SETTINGS, rollouts=4, strength=2.0, common_random_numbers=True)
    path.unlink()
    asked = ["probability", "probability/success", "effort/rrt"]
    with datasets.open(own / "push.h5") as dataset:
        score_dataset(dataset, path, asked, settings=settings, future=future)
        repeater, found = SearchRepeater(dataset, settings.all(), future), scores(path).scores
        for metric in asked:
            again = [repeater.repeat(number, metric).score for number in (0, 35, 71)]
            assert again == found[metric][[0, 35, 71]].tolist()
    page = written(own, pictures=1)
    assert page.row("asked about") == [["horizon 2 frames, plan hold"]]
    assert "This run has no scores of effort." in page.text
    assert "No picture" not in page.text and "Not the tree" not in page.text
    assert all(page.row("probability")) and page.row("probability/success")[1:] == [[]] * 5
    assert "stay captured; left out are" in page.text
    (command,) = re.findall(r"energymargin score .*? --strength 2\.0", page.text)
    assert "--frames 2 --plan hold" in command and "--common" in command
    done = run(*shlex.split(command)[1:], cwd=own)
    assert done.returncode == 0, done.stderr
    with ScoreStore(path) as store:
        assert [one.future for one in store.runs()] == [future, future]
        assert set(store.run(2).metrics) == {*asked, "effort"}


def test_a_picture_of_another_tree_than_that_of_the_score_says_so(own):
    changed(own / "push-scores.db", "UPDATE scores SET value = 1 - value WHERE question = 1")
    found = written(own, pictures=1).text
    assert "Not the tree of the score in the file: searched again it gives" in found


def test_what_is_missing_is_said_with_the_command_that_completes_it(own):
    path = own / "push-scores.db"
    changed(path, "DELETE FROM scores WHERE stream >= 20")
    changed(path, "DELETE FROM scores WHERE stream = 19 AND question = 3")
    found = written(own)
    assert (
        "53 of 72 states are not scored yet, or not in full: 52 lack capture, 52 lack success, "
        "53 lack effort, 52 lack effort/est, 52 lack effort/rrt, 52 lack force." in found.text
    )
    assert "Not shown are 8 trajectories that have no score at all." in found.text
    (command,) = re.findall(r"energymargin score .* --seed 3", found.text)
    assert run(*shlex.split(command)[1:], cwd=own).returncode == 0
    assert "not scored" not in written(own).text


def test_scores_that_were_not_asked_for_are_named(own):
    (own / "push-scores.db").unlink()
    with datasets.open(own / "push.h5") as dataset:
        score_dataset(dataset, own / "push-scores.db", ["capture", "force"], settings=SETTINGS)
    found = written(own)
    assert "This run has no scores of success, effort, effort/est, effort/rrt." in found.text
    assert "energymargin score" in found.text and "--paper" in found.text
    assert "--metrics" not in found.text


def test_states_of_one_label_have_no_auc_and_the_page_says_why(own):
    changed(own / "push-scores.db", "UPDATE states SET captured = 1, success = 1")
    found = written(own, pictures=1)
    assert found.row("capture")[:6] == [["—"]] * 6
    assert "one label alone" in found.pictures["roc"][0].texts
    assert found.text.count("None: all have the same label.") == 6


def test_a_store_without_any_score_still_makes_a_page(own):
    changed(own / "push-scores.db", "DELETE FROM scores")
    found = written(own)
    assert "72 of 72 states are not scored yet." in found.text
    assert "Not shown are 12 trajectories" in found.text and "along" not in found.pictures


def test_without_the_dataset_there_are_frames_instead_of_times_and_no_pictures(own):
    (own / "push.h5").unlink()
    found = written(own, pictures=1)
    assert "there is no push.h5 beside push-scores.db" in found.text
    assert found.text.count("No pictures: there is no push.h5 beside push-scores.db.") == 1
    assert found.text.count("there is no push.h5") == 2
    assert "Ranked above" in found.text
    assert "frame" in found.pictures["along"][0].texts


def test_the_command_that_completes_a_page_is_of_its_run_and_its_place(own):
    score_dataset(
        datasets.open(own / "push.h5"), own / "push-scores.db", settings=SearchSettings(nodes=2)
    )
    (own / "push.h5").rename(own / "DATASET.h5")
    text = written(own, run=2).text
    (options,) = re.findall(r"energymargin report \S+ (--data .*?r\.html)", text)
    assert options == f"--data DATASET.h5 --run 2 -o {own / 'r.html'}"


def test_a_file_beside_the_scores_that_is_another_dataset_is_not_used(own):
    datasets.generate("push", trajectories=1, frames=3, seed=9).save(own / "push.h5")
    assert "push.h5 is not the dataset that run 1 of push-scores.db scored" in written(own).text


def test_text_from_the_file_is_no_part_of_the_page_s_code(own):
    bad = json.dumps({"friction": "</script><script>alert(1)</script>"})
    update = "UPDATE datasets SET parameters = ?, task = ?"
    changed(own / "push-scores.db", update, (bad, "<b>push</b>"))
    found = written(own)
    assert "friction = </script><script>alert(1)</script>" in found.row("parameters")[0][0]
    assert found.row("task") == [["<b>push</b>"]]
    assert (
        sum(
            "alert(1)" in part
            for part in re.findall(r"<script.*?</script>", (own / "r.html").read_text(), re.DOTALL)
        )
        == 0
    )


def test_of_many_trajectories_the_most_wrong_and_an_even_sample_are_shown():
    wrong = np.linspace(0, 1, 1000)
    worst, others = chosen(np.arange(1000), wrong, 10)
    assert worst == [999, 998, 997, 996, 995]
    assert others == sorted(others) and len(others) == 5
    assert others[0] == 0 and others[-1] == 994
    worst, others = chosen(np.arange(4), np.full(4, np.nan), 10)
    assert sorted(worst + others) == [0, 1, 2, 3]


def test_several_objects_have_a_table_of_all_and_one_of_at_least_one(tmp_path):
    dataset = datasets.generate("push-multi", trajectories=4, frames=4, seed=0)
    score_dataset(dataset, tmp_path / "push-scores.db", settings=SearchSettings(nodes=5))
    found = written(tmp_path)
    assert "All objects: captured together" in found.text and "At least one object" in found.text
    result = evaluate(scores(tmp_path / "push-scores.db"), draws=9)
    for score in ("capture", "capture/any", "force/any"):
        cells = result.states[score].values()
        assert [cell[0] for cell in found.row(score)] == [c.value() if c else "—" for c in cells]


@pytest.mark.parametrize(
    ("scores", "options", "words"),
    [
        ("push.h5", {}, "push.h5 is not a file of scores"),
        ("none.db", {}, "No such file"),
        ("empty.db", {}, "empty.db has no scores yet; `energymargin score DATASET"),
        ("push-scores.db", {"output": "r.pdf"}, "r.pdf', expected a name with .html"),
        ("push-scores.db", {"output": "no/r.html"}, "No such file"),
        ("push-scores.db", {"data": "other.h5"}, "other.h5 is not the dataset that run 1 of"),
        ("push-scores.db", {"run": 7}, "run is 7"),
        ("push-scores.db", {"run": "1"}, "run is '1', expected a whole number"),
        ("push-scores.db", {"options": {"draws": 9}}, "options is {'draws': 9}, expected a report"),
        ("push-scores.db", {"options": {}}, "options is {}, expected a report.Options"),
    ],
)
def test_what_cannot_be_is_said_and_the_page_that_was_there_stays(
    own, monkeypatch, scores, options, words
):
    with ScoreStore(own / "empty.db", create=True):
        pass
    datasets.generate("push", trajectories=1, frames=2, seed=9).save(own / "other.h5")
    (own / "r.html").write_text("before")
    there = sorted(path.name for path in own.iterdir())
    monkeypatch.chdir(own)
    with pytest.raises((ValueError, OSError), match=re.escape(words)):
        report.write(scores, **{"output": "r.html", **options})
    assert sorted(path.name for path in own.iterdir()) == there
    assert (own / "r.html").read_text() == "before"


@pytest.mark.parametrize(
    ("name", "value"),
    [("trajectories", 0), ("pictures", -1), ("frames", 0.5), ("draws", 0), ("seed", -1)],
)
def test_an_option_that_cannot_be_is_named_with_its_value(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        report.Options(**{name: value})


def test_the_page_never_replaces_the_scores_or_the_dataset(own, monkeypatch):
    monkeypatch.chdir(own)
    os.rename("push-scores.db", "scores.html")
    os.rename("push.h5", "push.html")
    os.symlink("scores.html", "link.html")
    before = {path.name: path.read_bytes() for path in own.iterdir()}
    done = run("report", "scores.html", "--overwrite", cwd=own)
    assert done.returncode == 2
    assert "output is 'scores.html', which is the file of scores, 'scores.html'" in " ".join(
        done.stderr.split()
    )
    for output, words in (("link.html", "scores, 'scores.html'"), ("push.html", "data, 'push")):
        with pytest.raises(ValueError, match=f"output is '{output}', which is the file of {words}"):
            report.write("scores.html", output, data="push.html")
    assert {path.name: path.read_bytes() for path in own.iterdir()} == before


def test_the_command_says_in_one_line_what_is_wrong_and_what_it_wrote(own):
    done = run("report", "push.h5", cwd=own)
    (line,) = done.stderr.strip().splitlines()
    assert done.returncode == 2 and line.startswith("error: push.h5 is not a file of scores")
    (own / "push.h5").rename(own / "elsewhere.h5")
    done = run("report", "push-scores.db", "--pictures", 0, "--draws", 9, cwd=own)
    said = " ".join(done.stderr.split())
    assert done.returncode == 0 and "Wrote push-scores.html, " in said
    assert "Notice in the page: Without the dataset there are no pictures" in said
    assert "--data" in said


def files_of(folder):
    """All but SQLite's files beside an open store."""
    names = (path for path in folder.iterdir() if not path.name.endswith(("-shm", "-wal")))
    return {path.name: path.read_bytes() for path in names}


def being_written(folder):
    """The command that makes a report, at work on the new file."""
    process = subprocess.Popen(
        [COMMAND, "report", "push-scores.db", "--draws", "50000", "--overwrite"],
        cwd=folder,
        stderr=subprocess.PIPE,
    )
    deadline = time.monotonic() + 60
    while not list(folder.glob(".push-scores.html.*")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    return process


def test_ctrl_c_leaves_the_page_that_was_there(own):
    (own / "push-scores.html").write_text("before")
    before = files_of(own)
    process = being_written(own)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130 and b"stopped" in said
    assert files_of(own) == before


def test_a_ctrl_c_that_is_swallowed_on_the_way_still_stops_it(own):
    def swallow(_what, _share):
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        written(own, progress=swallow)
    assert sorted(path.name for path in own.iterdir()) == ["push-scores.db", "push.h5"]


def test_a_card_says_why_its_capture_score_says_less_than_it_seems_to(own):
    (own / "push-scores.db").unlink()
    settings = SearchSettings(nodes=3, seed=3)  # one node of four has a quarter, at least
    with datasets.open(own / "push.h5") as dataset:
        score_dataset(dataset, own / "push-scores.db", ["capture"], settings=settings)
        # so that there is a most wrong one
        changed(own / "push-scores.db", "UPDATE scores SET value = 1.0 - value")
        text = written(own, pictures=1).text
        places = re.findall(r"capture \d\.\d+, but .*?Trajectory (\d+), frame (\d)", text)
        repeater = SearchRepeater(dataset, settings.all())
        scored = [repeater.repeat(6 * int(t) + int(k), "capture").search for t, k in places]
    warnings = [text for score in scored for text in score.warnings]
    assert warnings
    assert all(warning[1:] in text for warning in warnings)


def test_the_command_for_the_rest_looks_as_often_as_the_run(own):
    (own / "push-scores.db").unlink()
    future = Future(2, "script", check=0.025, dwell=0.05)
    with datasets.open(own / "push.h5") as dataset:
        score_dataset(dataset, own / "push-scores.db", ["probability"], future=future, rollouts=2)
    text = written(own).text
    assert "This run has no scores of effort." in text and "--check 0.025 --dwell 0.05" in text
