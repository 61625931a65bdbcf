"""Results of workers: all of them, or those that are finished when Ctrl-C or an error comes."""

import signal

import pytest

from energymargin import Cancel
from energymargin.limits import Limit
from energymargin.results import collect


class Counters:
    """Workers that count, two numbers a step; one more is finished when they are stopped."""

    def __init__(self, numbers):
        self.left = list(range(numbers))

    @property
    def busy(self):
        return bool(self.left)

    def step(self):
        return [self.left.pop(0) for _ in range(min(2, len(self.left)))]

    def stop(self):
        return [self.left.pop(0)] if self.left else []


def test_all_results_come_in_their_order():
    taken = []
    assert collect(Counters(5), taken.extend, Limit(None, None))
    assert taken == [0, 1, 2, 3, 4]


def test_a_limit_keeps_what_is_finished():
    taken, cancel = [], Cancel()

    def deliver(numbers):
        taken.extend(numbers)
        cancel.set()

    assert not collect(Counters(5), deliver, Limit(None, cancel))
    assert taken == [0, 1, 2]


def test_ctrl_c_is_raised_once_what_is_finished_is_delivered():
    taken = []

    def deliver(numbers):
        taken.extend(numbers)
        if len(taken) == 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        collect(Counters(5), deliver, Limit(None, None))
    assert taken == [0, 1, 2]


def test_an_error_is_raised_once_what_is_finished_is_delivered():
    taken = []

    def deliver(numbers):
        taken.extend(numbers)
        if len(taken) == 2:
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="the disk is full"):
        collect(Counters(5), deliver, Limit(None, None))
    assert taken == [0, 1, 2]
