"""The study of the guard: its arms, and that it goes on from what it has."""

import pytest
from command_line import invoke

from energymargin._core import Cancel
from energymargin_paper.evidence import filter as filtering, guard as study

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
    before = (folder / filtering.EPISODES_FILE).read_text()
    again = study.STUDY.reproduce(SMALL, folder)
    assert (folder / filtering.EPISODES_FILE).read_text() == before
    assert again.to_csv() == result.to_csv() == (folder / "guard.csv").read_text()


@pytest.mark.parametrize(("arm", "there"), [("policy", "policy"), ("filter", "filtered")])
def test_policy_and_filter_are_those_of_the_study_of_the_filter(made, arm, there):
    found = made[0].outcomes[arm][0]
    same = filtering.run(
        filtering.Episode(there, SMALL.seed, confidence=0.5, **{**WORDS, "candidates": 3}),
        Cancel(),
    )
    assert (found.success, found.steps, found.changed) == (same.success, same.steps, same.changed)


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
