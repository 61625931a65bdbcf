"""The study of the guard: its arms, and that it goes on from what it has."""

import numpy as np
import pytest
from command_line import invoke

from energymargin._core import Cancel
from energymargin_paper.evidence import guard as study
from energymargin_paper.evidence.pairs_of_trials import paired

SMALL = study.Settings(episodes=1, watched=3, rollouts=3, horizon=0.2, candidates=2, seed=2)
WORDS = {"noise": 2.0, "candidates": 2, "spread": 5.0, "rollouts": 3, "horizon": 0.2}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("guard")
    return study.STUDY.reproduce(SMALL, folder), folder


def test_each_arm_has_an_episode_of_each_seed(made):
    result, _ = made
    assert {arm: len(found) for arm, found in result.outcomes.items()} == dict.fromkeys(
        study.ARMS, 1
    )
    policy, guard, _ = (result.outcomes[arm][0] for arm in study.ARMS)
    assert (policy.alarms, policy.changed, policy.rollouts) == (0, 0, 0)
    assert guard.changed <= guard.alarms <= guard.steps
    assert guard.rollouts >= 3 * guard.steps
    assert "McNemar" in result.to_markdown()


def test_it_goes_on_from_the_episodes_that_it_has(made):
    result, folder = made
    before = (folder / study.EPISODES_FILE).read_text()
    again = study.STUDY.reproduce(SMALL, folder)
    assert (folder / study.EPISODES_FILE).read_text() == before
    assert again.to_csv() == result.to_csv() == (folder / "guard.csv").read_text()


def test_without_actions_that_are_better_for_sure_the_filter_changes_nothing():
    """Two rollouts show nothing with a confidence of 0.99."""
    words = {**WORDS, "noise": 0.0, "candidates": 1, "rollouts": 2, "horizon": 0.1}
    alarm = {"on": 0.7, "off": 0.9, "watched": 2, "confidence": 0.99, "least": 0.0}
    plain, filtered = (
        study.run(study.Episode(arm, 3, **words, **alarm), Cancel()) for arm in ("policy", "filter")
    )
    assert filtered.changed == 0 < filtered.rollouts
    assert (filtered.success, filtered.steps) == (plain.success, plain.steps)


def test_an_alarm_that_is_never_on_leaves_the_policy_as_it_is(made):
    plain = made[0].outcomes["policy"][0]
    job = study.Episode(
        "guard", SMALL.seed, on=0.0, off=0.0, watched=2, confidence=0.5, least=0.0, **WORDS
    )
    guarded = study.run(job, Cancel())
    assert guarded.alarms == guarded.changed == 0
    assert (guarded.success, guarded.lost, guarded.steps) == (
        plain.success,
        plain.lost,
        plain.steps,
    )


@pytest.mark.parametrize(
    ("gained", "lost", "p"), [(10, 0, 2 * 0.5**10), (5, 5, 1.0), (0, 0, 1.0), (9, 1, 0.02148)]
)
def test_mcnemars_test_asks_a_fair_coin(gained, lost, p):
    difference, low, high, found = paired(gained, lost, 40)
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
        for _, low, high, _ in [paired(int(gained), int(lost), 60)]
    ]
    assert np.mean(held) > 0.93


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--episodes", "0"], "episodes is 0"),
        (["--off", "0.1"], "off is 0.1"),
        (["--watched", "0"], "watched is 0"),
        (["--least", "-1"], "least is -1"),
    ],
)
def test_bad_settings_are_refused(words, message, tmp_path):
    done = invoke(["reproduce", "guard", *words, "-o", str(tmp_path)])
    assert done.exit_code == 2 and message in " ".join(done.output.split())
