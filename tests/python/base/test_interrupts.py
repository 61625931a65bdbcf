"""Ctrl-C where it comes at a bad moment."""

import io
import signal
from contextlib import suppress

import pytest
from rich.console import Console

from energymargin.base.interrupts import (
    delayed_interrupts,
    held_interrupts,
    interrupted,
    remembered_interrupts,
)
from energymargin.cli.terminal import progress_bar, share_bar


class Terminal(io.StringIO):
    """One at which Ctrl-C is pressed, once, when it is asked what it is."""

    waits = False

    def isatty(self):
        if self.waits:
            self.waits = False
            signal.raise_signal(signal.SIGINT)
        return True


@pytest.fixture(autouse=True)
def pythons_own_handler():
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_cannot_be_left_half_done_is_done_before_ctrl_c_ends_it():
    done = []
    with pytest.raises(KeyboardInterrupt), delayed_interrupts():
        signal.raise_signal(signal.SIGINT)
        done.append(True)
    assert done


def test_a_delayed_ctrl_c_is_given_to_whoever_holds_it():
    with held_interrupts() as interrupted:
        with delayed_interrupts():
            signal.raise_signal(signal.SIGINT)
            assert not interrupted.is_set()
        assert interrupted.is_set()


@pytest.mark.parametrize("bar", [lambda c: progress_bar("Counting", "sheep", c), share_bar])
def test_ctrl_c_when_a_bar_begins_is_ctrl_c_and_the_bar_ends(bar):
    terminal = Terminal()
    console = Console(file=terminal)
    with pytest.raises(KeyboardInterrupt), bar(console) as update:
        terminal.waits = True
        update("sheep", 0.5) if bar is share_bar else update(1, 2)
    with bar(console):  # a console has one bar at a time
        pass


def test_a_swallowed_ctrl_c_is_raised_again_at_the_next_step_of_a_bar():
    with (
        pytest.raises(KeyboardInterrupt),
        remembered_interrupts(),
        progress_bar("Counting", "sheep", Console(file=io.StringIO())) as update,
    ):
        update(1, 3)
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        update(2, 3)
        raise AssertionError("it went on")
    assert not interrupted()


def test_what_is_held_is_held_where_a_ctrl_c_is_remembered_as_well():
    with remembered_interrupts():
        with held_interrupts() as came:
            signal.raise_signal(signal.SIGINT)
        assert came.is_set() and not interrupted()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert interrupted()
