"""Whether a Monitor holds a camera's rate: pushes played at 30 Hz, and how late each reading is.

The states are those of pushes that hold to their end, whose rollouts all last for the whole
horizon: the most expensive ones. make bench-monitor
"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import cyclopts
import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

import energymargin as em
from energymargin.base.checks import core_count
from energymargin.cli.terminal import out, share_bar
from energymargin.monitor import Counters, Reading
from energymargin.tasks.push import FRICTION_MIDDLE as FRICTION, PushTask
from energymargin_paper.evidence.foresight import STRENGTH
from tables import machine, markdown, write

LAST = 10.0  # s; so long the last readings are waited for
PUSHES = 4


@dataclass(frozen=True)
class Stream:
    """What is played."""

    seconds: float = 60.0
    rate: float = 30.0
    """States a second."""
    rollouts: int | tuple[int, int] = 30
    """A number, or the least and the most."""
    horizon: float = 0.5
    """Horizon of each state [s]."""
    threads: int = 2

    @property
    def period(self) -> float:
        """Between two states [s]."""
        return 1 / self.rate


@dataclass
class Played:
    """What came of a stream."""

    lateness: list[float] = field(default_factory=list)
    """Lateness of each reading [s]."""
    rollouts: list[int] = field(default_factory=list)
    pushes: list[float] = field(default_factory=list)
    """How long each call of `push` took [s]."""
    counters: Counters = field(default_factory=lambda: Counters(0, 0, 0, 0, 0))
    load: tuple[float, float] = (0.0, 0.0)
    """Load of the machine in the last minute, before and after: processes that run or want to."""
    processor: float = 0.0
    """Time of this process on all cores, over the time of the stream."""

    def note(self, reading: Reading) -> None:
        """One more reading."""
        self.lateness.append(reading.lateness)
        self.rollouts.append(reading.rollouts)


def main(
    *,
    seconds: Annotated[float, Parameter(help="How long it is played [s].")] = Stream.seconds,
    rate: Annotated[float, Parameter(help="States a second.")] = Stream.rate,
    rollouts: Annotated[str, Parameter(help="A number, or LEAST,MOST.")] = "30",
    horizon: Annotated[float, Parameter(help="Of each state [s].")] = Stream.horizon,
    threads: Annotated[int | None, Parameter(help="All cores, if not given.")] = None,
    out_file: Annotated[Path, Parameter(name="--out", help="The table.")] = Path("out/monitor.md"),
    pages: Annotated[Path | None, Parameter(help="Folder of pages, as docs.")] = None,
) -> None:
    """Plays pushes to a Monitor in real time, and says how many readings were late."""
    least, _, most = rollouts.partition(",")
    count = (int(least), int(most)) if most else int(least)
    stream = Stream(seconds, rate, count, horizon, core_count("threads", threads))
    with share_bar() as bar:
        played = play(stream, lambda done: bar("Playing", done))
    text = table(stream, played)
    write(out_file, text, "bench-monitor", pages)
    out.print(text, markup=False, soft_wrap=True)


def play(stream: Stream, tell: Callable[[float], None]) -> Played:
    """Pushes every state at its time, and waits for the last readings."""
    played, task = Played(), PushTask(friction=FRICTION)
    states, params = held_pushes(task, stream.rate), {"friction": FRICTION}
    horizon = round(stream.horizon / task.step) * task.step
    before = os.getloadavg()[0]

    def question(state: NDArray[np.float64], at: float) -> em.Problem:
        return task.future(state, at % task.length, params, horizon)

    with em.Monitor(
        question,
        period=stream.period,
        rollouts=stream.rollouts,
        threads=stream.threads,
        disturbance=em.disturbances.Uniform(strength=STRENGTH),
        on_reading=played.note,
    ) as live:
        begun, used = time.monotonic(), time.process_time()
        for number in range(round(stream.seconds * stream.rate)):
            due = number * stream.period
            time.sleep(max(begun + due - time.monotonic(), 0.0))
            start = time.perf_counter()
            live.push(due, states[number % len(states)])
            played.pushes.append(time.perf_counter() - start)
            tell(due / stream.seconds)
        live.wait(LAST)
        played.counters = live.counters
    played.processor = (time.process_time() - used) / stream.seconds
    played.load = (before, os.getloadavg()[0])
    return played


def held_pushes(task: PushTask, rate: float) -> NDArray[np.float64]:
    """States of some pushes that hold to their end, one after the other, shape (K, n)."""
    frames = round(task.length * rate)
    pushes = (task.rollout(seed, frames=frames + 1) for seed in itertools.count())
    held = itertools.islice((push for push in pushes if push.captured.all()), PUSHES)
    return np.concatenate([push.states[:frames] for push in held])


def table(stream: Stream, played: Played) -> str:
    """In Markdown."""
    lateness, counters = 1e3 * np.array(played.lateness), played.counters
    median, most_of_all, most = np.percentile(lateness, (50, 99, 100))
    rows = [
        ["pushed, scored, dropped, failed", ", ".join(map(str, _counts(counters)))],
        ["later than a frame after the push", str(counters.late)],
        ["later than two frames", str(int((lateness > 2e3 * stream.period).sum()))],
        ["lateness: median, 99 %, most [ms]", f"{median:.1f}, {most_of_all:.1f}, {most:.1f}"],
        ["rollouts: least, median, most", "{:.0f}, {:.0f}, {:.0f}".format(*_spread(played))],
        ["longest push() [ms]", f"{1e3 * max(played.pushes):.2f}"],
        ["cores that this process kept busy", f"{played.processor:.2f}"],
        ["load of the machine before, after", "{:.1f}, {:.1f}".format(*played.load)],
    ]
    title = (
        f"Pushes that hold, {stream.rate:g} Hz for {stream.seconds:g} s; {stream.rollouts} "
        f"rollouts over {stream.horizon:g} s, {stream.threads} threads; {machine()}.\n\n"
    )
    return title + markdown(["", "value"], rows)


def _spread(played: Played) -> NDArray[np.float64]:
    return np.asarray(np.percentile(played.rollouts, (0, 50, 100)))


def _counts(counters: Counters) -> tuple[int, ...]:
    return counters.pushed, counters.scored, counters.dropped, counters.failed


if __name__ == "__main__":
    cyclopts.run(main)
