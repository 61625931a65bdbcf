"""`em.executors.ask`: questions that have parts, a store, and a limit."""

from functools import partial

import pytest

import energymargin as em
from energymargin.executors import Kept, Processes, Threads, ask
from energymargin.store import AnswerFile


class Numbers:
    """A question: the squares of some numbers; `made`: how many of them can be made."""

    def __init__(self, first, count, made=None):
        self.first, self.count, self.made = first, count, count if made is None else made

    def __len__(self):
        return self.count

    def parts(self):
        numbers = range(self.first, self.first + self.made)
        yield from (numbers[k : k + 2] for k in range(0, self.made, 2))
        self.count = self.made


def squares(numbers, _cancel):
    return [number**2 for number in numbers]


def pairs(numbers, _cancel):
    """Two at a time, where they are neighbours."""
    found, numbers = [], list(numbers)
    while numbers:
        first, *numbers = numbers
        if numbers and numbers[0] == first + 1:
            found += [[first**2, numbers.pop(0) ** 2], None]
        else:
            found.append([first**2])
    return found


def asked(questions, answer=squares, join=lambda _, results: results, **options):
    found = {}
    note = lambda answers: found.update({q.first: answer for q, answer in answers})  # noqa: E731
    complete = ask([questions], answer, note, split=Numbers.parts, join=join, **options)
    return complete, found


@pytest.mark.parametrize("executor", [Threads(1), Threads(3), Processes(2)])
@pytest.mark.parametrize("most", [1, 3, 1000])
def test_an_answer_is_joined_of_the_results_of_its_parts_in_their_order(executor, most):
    questions = [Numbers(100 * k, count) for k, count in enumerate((5, 1, 8, 2))]
    complete, found = asked(questions, executor=executor, most=most)
    assert complete
    assert found == {q.first: [k**2 for k in range(q.first, q.first + q.count)] for q in questions}


def test_the_result_of_several_parts_stands_at_the_first_of_them():
    join = lambda _, results: [one for some in results for one in some]  # noqa: E731
    complete, found = asked([Numbers(0, 9), Numbers(20, 4)], pairs, join, threads=2)
    assert complete
    assert found == {0: [k**2 for k in range(9)], 20: [k**2 for k in range(20, 24)]}


def test_a_question_whose_last_parts_cannot_be_made_is_answered_by_the_others():
    complete, found = asked([Numbers(0, 6, made=3), Numbers(10, 4, made=0), Numbers(20, 2)])
    assert complete and found == {0: [0, 1, 4], 10: [], 20: [400, 441]}


def test_progress_counts_parts():
    seen = []
    asked([Numbers(0, 5), Numbers(10, 3)], total=8, progress=lambda *now: seen.append(now))
    assert seen[-1] == (8, 8) and [done for done, _ in seen] == sorted(done for done, _ in seen)


@pytest.mark.parametrize("partly", [False, True])
def test_at_a_limit_a_question_has_its_first_results_if_those_count(partly):
    cancel = em.Cancel()

    def stopped_at_three(numbers, _cancel):
        if 3 in numbers:
            cancel.set()
            raise em.Cancelled("cancelled at 3")
        return [number**2 for number in numbers]

    options = {"threads": 1, "most": 1, "cancel": cancel, "partly": partly}
    complete, found = asked([Numbers(0, 6)], stopped_at_three, **options)
    assert not complete and found == ({0: [0, 1, 4]} if partly else {})


def test_what_a_store_has_is_delivered_without_work_and_an_error_is_not_kept(tmp_path):
    worked = []

    def roots(numbers, _cancel):
        worked.extend(numbers)
        return [number**0.5 if number >= 0 else "an error" for number in numbers]

    def run(numbers):
        found, seen = {}, []
        with AnswerFile(tmp_path / "roots.db", create=True) as file:
            kept = Kept(
                file,
                digest=partial(file.key, "root"),
                read=lambda _, content: float(content),
                written=lambda root: None if isinstance(root, str) else repr(root).encode(),
            )
            progress = lambda *now: seen.append(now)  # noqa: E731
            assert ask([numbers], roots, found.update, kept=kept, total=3, progress=progress)
        return found, seen[-1]

    assert run([4, 9, -1]) == ({4: 2.0, 9: 3.0, -1: "an error"}, (3, 3))
    assert sorted(worked) == [-1, 4, 9]
    worked.clear()
    assert run([9, 16, -1]) == ({9: 3.0, 16: 4.0, -1: "an error"}, (3, 3))
    assert sorted(worked) == [-1, 16]


def test_workers_that_are_given_stay_open():
    found = {}
    with Threads(2).workers() as workers:
        for numbers in (range(3), range(3, 6)):
            assert ask([numbers], squares, found.update, executor=workers)
    assert found == {k: k**2 for k in range(6)}
