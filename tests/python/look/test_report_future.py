"""Reports of scores with a horizon."""

import re

import pytest
from reports import OPTIONS, Document, scores

from energymargin import datasets, report
from energymargin.datasets import Future
from energymargin.evaluate.searches import SearchSettings
from energymargin.evaluation import evaluate
from energymargin.look.report.pictures import SearchRepeater, pictures
from energymargin.records.evaluation.curves import SUCCESS, roc
from energymargin.records.evaluation.labelled import compared_trajectories
from energymargin.store import score_dataset


@pytest.fixture(scope="module")
def ahead(tmp_path_factory):
    """A folder with the scores of the frames to come of 12 balances, and their report."""
    folder = tmp_path_factory.mktemp("ahead")
    dataset = datasets.generate("balance", trajectories=12, frames=6, seed=1)
    dataset.save(folder / "balance.h5")
    settings = SearchSettings(nodes=15, seed=3, rollouts=20, strength=0.3, objects=1)
    future = Future(2, "script")
    score_dataset(dataset, folder / "balance-scores.db", settings=settings, future=future)
    report.write(folder / "balance-scores.db", folder / "report.html", options=OPTIONS)
    return folder


def test_a_report_of_probabilities_says_what_they_depend_on(ahead):
    found = Document(ahead / "report.html")
    assert found.row("asked about") == [["horizon 2 frames, plan script"]]
    said = "of 20 rollouts of each state, under random wrenches within 0.3 times the bounds"
    assert found.row("probabilities") == [[f"{said}, on 1 object at a time"]]
    assert "a probability is the share of random rollouts in which the object stays" in found.text
    assert "This run has no scores of" not in found.text  # a clockless score is not missed


def test_its_label_looks_as_far_ahead_as_the_scores(ahead):
    found = Document(ahead / "report.html")
    assert "“captured over the next 2 frames”" in found.text


def test_probabilities_are_drawn_on_their_own_axis(ahead):
    found = Document(ahead / "report.html")
    assert all("probability [0..1]" in picture.texts for picture in found.pictures["along"])
    (picture,) = found.pictures["distributions"]
    assert "probability [0..1]" in picture.texts


def test_the_probability_of_success_is_judged_by_the_success_of_trajectories(ahead):
    labelled = scores(ahead / "balance-scores.db")
    result = evaluate(labelled, draws=200)
    assert "probability/success" not in result.states
    compared = compared_trajectories(labelled, "probability/success", result.last)
    assert result.probable_success.auc == roc(labelled, "probability/success", target=SUCCESS).auc
    assert compared.labels.sum() == sum(
        labelled.success[states[-1]] for states in labelled.by_trajectory()
    )
    found = Document(ahead / "report.html")
    cells = [row[1][0] for row in found.rows if row[0] == ["probability/success"]]
    assert result.probable_success.value() in cells


@pytest.mark.parametrize("metric", ["probability", "probability/success", "effort/est"])
def test_pictures_of_a_future_are_of_the_very_question_of_the_score(ahead, metric):
    labelled = scores(ahead / "balance-scores.db")
    settings = SearchSettings(nodes=15, seed=3, rollouts=20, strength=0.3, objects=1)
    dataset = datasets.load(ahead / "balance.h5")
    repeater = SearchRepeater(dataset, settings.all(), Future(2, "script"))
    for number in (3, 20, 41):
        repeated = repeater.repeat(number, metric)
        assert repeated.score == labelled.scores[metric][number]
        assert repeated.problem.plan is not None
        drawn = pictures(repeated, repeater.plane)
        assert len(drawn) == (1 if metric == "effort/est" else 2)
        assert all(image.startswith("data:image/png;base64,") for image in drawn)


def test_a_most_wrong_probability_is_shown_with_its_future_and_its_curve(ahead):
    found = Document(ahead / "report.html")
    assert "the curve below is the probability of being captured until then" in found.text
    cards = re.findall(r"(probability [01]\.\d+), but (?:is lost|stays captured)", found.text)
    assert cards
    assert "searched again it gives" not in found.text


def test_the_scores_of_the_states_as_they_are_stand_beside_those_with_a_horizon(tmp_path):
    dataset = datasets.generate("topple", trajectories=4, frames=5, seed=1)
    dataset.save(tmp_path / "topple.h5")
    path, settings = tmp_path / "topple-scores.db", SearchSettings(nodes=3, rollouts=4)
    score_dataset(dataset, path, ["probability"], settings=settings, future=Future(2))
    score_dataset(dataset, path, ["capture", "effort/est"], settings=settings)
    report.write(path, tmp_path / "report.html", options=OPTIONS)
    found = Document(tmp_path / "report.html")
    assert "alone in the second, are the scores of the states as they are" in found.text
    first, second = [n for n, row in enumerate(found.rows) if row[0] == ["score"]][:2]
    assert [row[0] for row in found.rows[first + 1 : first + 4]] == [
        ["probability"],
        ["capture"],
        ["effort/est"],
    ]
    assert ["h = 0"] in found.rows[second]
