"""Several searches for an escape, on several threads: the best of them is the result."""

import math

import pytest
from reacting import on_a_rail

import energymargin as em
from energymargin._core import stream

SEARCHES = 3


@pytest.fixture(scope="module")
def problem():
    captured = em.regions.Ball("ball", (0, 0, 0), 0.2)
    return on_a_rail(horizon=0.5, duration=0.5).replace(captured=captured)


def test_the_first_of_least_effort_is_the_result_with_the_steps_of_all(problem):
    best = em.escape_effort(problem, nodes=101, searches=SEARCHES, seed=5)
    shares = (34, 34, 33)
    alone = [em.escape_effort(problem, nodes=n, seed=stream(5, i)) for i, n in enumerate(shares)]
    least = min(alone, key=lambda one: one.effort)
    assert 0 < least.effort < max(one.effort for one in alone) < math.inf
    assert (best.effort, best.history) == (least.effort, least.history)
    assert (best.tree.states == least.tree.states).all()
    assert best.steps == sum(one.steps for one in alone)
    assert best.complete


def test_the_bits_do_not_depend_on_the_threads(problem):
    one, two = (em.escape_effort(problem, nodes=90, searches=3, threads=n) for n in (1, 2))
    assert one.effort == two.effort
    assert (one.tree.states == two.tree.states).all()


def test_progress_counts_the_nodes_of_all(problem):
    seen = []
    em.escape_effort(
        problem, nodes=2999, searches=3, threads=2, progress=lambda *of: seen.append(of)
    )
    assert seen[-1] == (2999, 2999)


def test_a_cancel_keeps_the_best_so_far(problem):
    cancel = em.Cancel()

    def progress(done, total):
        if done > 2000:
            cancel.set()

    asked = {"nodes": 10**7, "searches": 2, "threads": 2, "cancel": cancel}
    early = em.escape_effort(problem, **asked, progress=progress)
    assert not early.complete
    assert early.effort < math.inf
    none = em.escape_effort(problem, **asked)  # of roots alone
    assert not none.complete
    assert none.effort == math.inf


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"searches": 0}, "searches is 0, expected"),
        ({"searches": 11}, "searches is 11, expected at most `nodes`, 10"),
        ({"threads": 0}, "threads"),
    ],
)
def test_what_makes_no_searches_says_so(problem, options, words):
    with pytest.raises(ValueError, match=words):
        em.escape_effort(problem, nodes=10, **options)


@pytest.mark.parametrize("clock", [True, False])
def test_rounds_of_one_search_have_the_same_bits_on_any_threads(problem, clock):
    asked = {"nodes": 400, "seed": 4, "nodes_per_round": 16}
    one = problem if clock else problem.replace(horizon=None)
    first, second = (em.escape_effort(one, threads=n, **asked) for n in (1, 2))
    assert (first.effort, first.history) == (second.effort, second.history)
    assert (first.tree.states == second.tree.states).all()
    assert first.nodes == 400 and 0 < first.effort < math.inf
    alone = em.escape_effort(one, nodes=400, seed=4)
    assert (first.tree.states != alone.tree.states).any()
