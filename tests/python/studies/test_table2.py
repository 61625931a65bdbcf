"""Recorded pushes, and the page of all studies; small and real."""

import numpy as np
import pytest
from command_line import invoke

import energymargin as em
from energymargin.evaluate.searches import SearchSettings
from energymargin_paper.paper import table2


def run(*words):
    return invoke(["reproduce", *map(str, words)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("table2")
    done = run("all", "--quick", "--only", "table2,contact", "-o", made, "--threads", 1)
    assert done.exit_code == 0, done.output
    return made


def test_the_table_has_the_scores_of_the_recorded_states(folder):
    """Of some of them, one by one."""
    row = table2.STUDY.reproduce(table2.STUDY.quick, folder / "table2", threads=1).rows[1]
    assert row.combination == "rectangle-round"
    settings = SearchSettings(table2.STUDY.quick.nodes, 0)
    for number in (5, 777):
        (problem,) = row.dataset.problems([number])
        score = em.capture_score(
            problem, nodes=settings.nodes, seed=em.stream(settings.seed, number)
        )
        assert score.capture == row.labelled.scores["capture"][number]
        assert score.success == row.labelled.scores["success"][number]


def test_success_counts_the_last_60_frames_with_rising_weights(folder):
    row = table2.STUDY.reproduce(table2.STUDY.quick, folder / "table2", threads=1).rows[0]
    of_state = row.labelled.scores["success"].reshape(12, 100)[:, 40:]
    scores = of_state @ np.arange(1, 61) / np.arange(1, 61).sum()
    success = row.labelled.success.reshape(12, 100)[:, 0]
    pairs = [(a > b) + 0.5 * (a == b) for a in scores[success] for b in scores[~success]]
    assert row.evaluation.success.auc == pytest.approx(np.mean(pairs))


def test_every_place_says_that_the_recordings_are_a_stand_in(folder):
    for path in (folder / "table2" / "table2.md", folder / "index.md", folder / "index.html"):
        assert "simulated stand-in" in path.read_text()


def test_the_page_has_the_studies_that_were_made_with_their_times_and_pictures(folder):
    text = (folder / "index.md").read_text()
    assert "![table2](table2/table2.png)" in text and "(contact/contact.csv)" in text
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.splitlines()
        if line.startswith("| ")
    ]
    last = {row[0]: row[-1] for row in rows}
    assert last["contact"] == last["table2"] == "whole"
    assert last["act"] == "not yet"
    html = (folder / "index.html").read_text()
    assert "<td>not yet</td>" in html and '<img src="table2/table2.png"' in html
