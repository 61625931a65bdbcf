"""The study of the filter: its pairs, its test, and that it goes on from what it has."""

import numpy as np
import pytest
from command_line import invoke

from energymargin._core import Cancel
from energymargin_paper.evidence import filter as study

SMALL = study.Settings(episodes=2, rollouts=3, horizon=0.3, candidates=3)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("filter")
    return study.STUDY.reproduce(SMALL, folder), folder


def test_both_episodes_of_a_pair_are_there_and_some_have_their_states_scored(made):
    result, _ = made
    assert {arm: len(found) for arm, found in result.outcomes.items()} == {
        "policy": 2,
        "scored": 1,
        "filtered": 2,
    }
    assert "McNemar" in result.to_markdown()


def test_a_score_does_not_change_an_episode(made):
    result, _ = made
    plain, scored = result.outcomes["policy"][0], result.outcomes["scored"][0]
    assert (scored.success, scored.steps, scored.changed) == (plain.success, plain.steps, 0)
    assert scored.seconds > plain.seconds


def test_an_episode_is_the_same_again(made):
    result, folder = made
    before = (folder / study.EPISODES_FILE).read_text()
    again = study.STUDY.reproduce(SMALL, folder)
    assert (folder / study.EPISODES_FILE).read_text() == before
    assert again.to_csv() == result.to_csv() == (folder / "filter.csv").read_text()


def test_without_candidates_that_differ_the_filter_changes_nothing():
    words = {"noise": 0.0, "candidates": 2, "rollouts": 2, "horizon": 0.1, "confidence": 0.99}
    plain, filtered = (
        study.run(study.Episode(arm, 3, spread=5.0, **words), Cancel())
        for arm in ("policy", "filtered")
    )
    assert filtered.changed == 0  # two rollouts show nothing with a confidence of 0.99
    assert (filtered.success, filtered.steps) == (plain.success, plain.steps)


@pytest.mark.parametrize(
    ("gained", "lost", "p"), [(10, 0, 2 * 0.5**10), (5, 5, 1.0), (0, 0, 1.0), (9, 1, 0.02148)]
)
def test_mcnemars_test_asks_a_fair_coin(gained, lost, p):
    difference, low, high, found = study.paired(gained, lost, 40)
    assert found == pytest.approx(p, abs=1e-4)
    assert difference == (gained - lost) / 40
    assert low < difference < high


def test_the_interval_of_the_difference_holds_it():
    """In at least 93 of 100 draws, of 60 pairs."""
    random = np.random.default_rng(0)
    chances = [0.2, 0.1, 0.7]
    held = [
        low <= 0.1 <= high
        for gained, lost, _ in random.multinomial(60, chances, 1000)
        for _, low, high, _ in [study.paired(int(gained), int(lost), 60)]
    ]
    assert np.mean(held) > 0.93


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--episodes", "0"], "episodes is 0"),
        (["--noise", "-1"], "noise is -1"),
        (["--candidates", "1"], "candidates is 1"),
        (["--confidence", "1"], "confidence is 1"),
    ],
)
def test_bad_settings_are_refused(words, message, tmp_path):
    done = invoke(["reproduce", "filter", *words, "-o", str(tmp_path)])
    assert done.exit_code == 2 and message in " ".join(done.output.split())
