"""Two policies by their outcomes: sure in the end, seldom wrong, whenever one looks."""

import json

import numpy as np
import pytest
from command_line import invoke

import energymargin as em


def won(rate, count, seed):
    return (np.random.default_rng(seed).random(count) < rate).astype(float)


def test_of_equal_policies_one_is_seldom_called_better_however_often_one_looks():
    found = [em.compare(won(0.6, 150, 2 * k), won(0.6, 150, 2 * k + 1)) for k in range(300)]
    assert sum(one.better != "" for one in found) <= 15  # 5 % of 300
    held = sum(low <= 0.6 <= high for one in found for low, high in one.intervals)
    assert held >= 0.95 * 600


def test_the_better_one_is_found_and_it_is_said_after_how_many_episodes():
    found = [em.compare(won(0.9, 200, 2 * k), won(0.6, 200, 2 * k + 1)) for k in range(40)]
    assert all(one.better == "a" for one in found)
    one = found[0]
    again = em.compare(won(0.9, one.decided, 0), won(0.6, one.decided, 1))
    before = em.compare(won(0.9, one.decided - 1, 0), won(0.6, one.decided - 1, 1))
    assert again.decided == one.decided and before.decided is None and before.better == ""
    swapped = em.compare(won(0.6, 200, 1), won(0.9, 200, 0))
    assert swapped.better == "b" and swapped.sure == one.sure[::-1]
    assert "a is better" in one.to_markdown()


def test_scores_count_by_who_is_better_and_have_no_rate():
    found = em.compare([3.0, 2.5, 9.0, 4.0] * 8, [1.0, 2.0, 8.5, 4.0] * 8)
    assert found.better == "a" and (found.wins, found.losses, found.pairs) == (24, 0, 32)
    assert np.isnan(found.intervals[0]).all()


def written(path, successes, seeds):
    episodes = [
        {"episode_ix": k, "success": bool(one), "sum_reward": 1.0, "seed": seed}
        for k, (one, seed) in enumerate(zip(successes, seeds, strict=True))
    ]
    path.write_text(json.dumps({"per_episode": episodes, "aggregated": {}}))
    return path


def test_evaluations_of_lerobot_are_paired_by_their_seeds(tmp_path):
    a = written(tmp_path / "a.json", [1, 1, 0, 1], [7, 8, 9, 10])
    b = written(tmp_path / "b.json", [0, 1, 0], [10, 9, 7])
    found = em.compare(a, b)
    assert found.pairs == 3  # seeds 7, 9, 10: 1 and 0, 0 and 1, 1 and 0
    assert (found.wins, found.losses) == (2, 1)
    tasks = {"per_task": [{"task_id": 0, "metrics": {"successes": [True, False, True, True]}}]}
    (tmp_path / "c.json").write_text(json.dumps(tasks))
    assert em.compare(tmp_path / "c.json", b).pairs == 3
    told = invoke(["compare", str(a), str(b)])
    assert told.exit_code == 0 and "neither is sure" in told.output


def test_successes_are_not_compared_with_rewards(tmp_path):
    a = written(tmp_path / "a.json", [1, 1, 0, 1], [7, 8, 9, 10])
    (tmp_path / "b.json").write_text(a.read_text().replace('"success"', '"ended"'))
    assert em.compare(tmp_path / "b.json", tmp_path / "b.json").pairs == 4
    with pytest.raises(ValueError, match="a has each episode's success and b its sum_reward"):
        em.compare(a, tmp_path / "b.json")
    (tmp_path / "b.json").write_text(a.read_text().replace('"success"', '"ended"', 1))
    with pytest.raises(ValueError, match="expected a list of finite outcomes"):
        em.compare(a, tmp_path / "b.json")  # one episode without a success


def tasks(path, *rows):
    """As LeRobot writes several tasks: a group, a number and successes each."""
    path.write_text(
        json.dumps(
            {
                "per_task": [
                    {
                        "task_group": group,
                        "task_id": number,
                        "metrics": {
                            "sum_rewards": [float(one) for one in successes],
                            "max_rewards": [float(one) for one in successes],
                            "successes": [bool(one) for one in successes],
                            "video_paths": [],
                        },
                    }
                    for group, number, successes in rows
                ],
                "per_group": {group: {"pc_success": float("nan")} for group, *_ in rows},
                "overall": {"pc_success": 50.0, "n_episodes": sum(len(one[2]) for one in rows)},
            }
        )
    )
    return path


def test_tasks_that_ended_in_another_order_are_paired_by_their_names(tmp_path):
    """Two policies alike: all of the easy task is won, nothing of the hard one."""
    easy, hard = ("spatial", 0, [1] * 12), ("goal", 0, [0] * 12)
    a, b = tasks(tmp_path / "a.json", easy, hard), tasks(tmp_path / "b.json", hard, easy)
    found = em.compare(a, b)
    assert (found.pairs, found.wins, found.losses, found.better) == (24, 0, 0, "")
    more = tasks(tmp_path / "c.json", ("goal", 1, [1] * 9), hard, ("spatial", 0, [1] * 5))
    assert em.compare(a, more).pairs == 17  # what only one has does not count
    with pytest.raises(ValueError, match="no seed and no task in common"):
        em.compare(a, tasks(tmp_path / "d.json", ("object", 0, [1])))


def test_who_ended_first_makes_nobody_better(tmp_path):
    """The order of a file is that in which tasks ended: here a's won ones first."""
    random = np.random.default_rng(5)
    rows = {number: (random.random(2) < 0.5).tolist() for number in range(60)}
    others = {number: (random.random(2) < 0.5).tolist() for number in range(60)}
    order = sorted(rows, key=lambda number: sum(others[number]) - sum(rows[number]))
    a = tasks(tmp_path / "a.json", *(("t", number, rows[number]) for number in order))
    b = tasks(tmp_path / "b.json", *(("t", number, others[number]) for number in rows))
    assert em.compare(a, b).better == ""


@pytest.mark.parametrize(
    ("a", "match"),
    [
        ([], "a is .*expected a list of finite outcomes"),
        ([[1, 0]], "expected a list of finite outcomes"),
        ([1, np.nan], "expected a list of finite outcomes"),
        ("one", "No such file"),
    ],
)
def test_what_is_no_list_of_outcomes_is_named(a, match):
    with pytest.raises((ValueError, OSError), match=match):
        em.compare(a, [1, 0])


def test_a_file_of_something_else_is_named(tmp_path):
    (tmp_path / "x.json").write_text('{"a": 1}')
    with pytest.raises(ValueError, match="is no evaluation of LeRobot"):
        em.compare(tmp_path / "x.json", [1, 0])
    with pytest.raises(ValueError, match="confidence is 1"):
        em.compare([1], [0], confidence=1.0)
