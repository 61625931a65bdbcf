"""Part `frame`: a camera's frame, which asks for the probability that the next seconds hold."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

import energymargin as em
from energymargin.evaluate.steps import StepChoice
from energymargin_paper.evidence.ceiling import scripted
from energymargin_paper.evidence.foresight import OBJECTS, STRENGTH
from measurements import FRAMES, Settings, Tell, digits, in_turns
from tables import markdown

__all__ = ["SOON", "Frames", "measure_frames"]

SOON = 0.5  # s
THREADS = (1, 2)
PAIRS = 10  # times the rollouts, for the choice of a step
AHEAD = 5  # frames of a recording, as far as the foresight table looks
PAGE = Path(__file__).parents[2] / "docs" / "results" / "foresight.md"
COLUMN = "probability, script"  # of its first table of results, which has no push-real


@dataclass(frozen=True)
class Frame:
    """Times of one state [s]."""

    wall: dict[int, list[float]]
    """By the number of threads, 1 and 2 [s]."""
    cpu: dict[int, list[float]]
    steps: int

    def times(self) -> tuple[float, ...]:
        """Wall and CPU on one thread, wall and CPU on two: medians of the rounds [s]."""
        clocks = (self.wall, self.cpu)
        return tuple(median(clock[threads]) for threads in THREADS for clock in clocks)


@dataclass(frozen=True)
class Longer:
    """A task's frames with the longest step that answers as a quarter of the usual one."""

    choice: StepChoice
    frames: tuple[Frame, ...]

    def row(self, task: str, usual: Sequence[Frame]) -> list[str]:
        """A row of a table."""
        with_it, without = (
            median(median(frame.wall[1]) for frame in of) for of in (self.frames, usual)
        )
        held = next(each for each in self.choice.tried if each.step == self.choice.step)
        ends = "{:+.3f} to {:+.3f}".format(*held.interval()) if self.choice.settled else ""
        worst = f"{abs(held.differences).max():.3f}"
        step = f"1/{1 / self.choice.step:.0f}"
        return [task, step, ends, worst, digits(1e3 * with_it), f"{with_it / without:.2f}"]


@dataclass
class Frames:
    """What there is so far."""

    settings: Settings
    soon: dict[str, list[Frame]] = field(default_factory=dict)
    """By task: over the next half second."""
    longer: dict[str, Longer] = field(default_factory=dict)
    """The same with a longer step."""
    ahead: dict[str, list[Frame]] = field(default_factory=dict)
    """Over the next five frames of the recording."""
    horizons: dict[str, float] = field(default_factory=dict)
    """Those of `ahead` [s]."""

    def wall(self, task: str, threads: int) -> float:
        """Time of the probability over the next half second, the median of the states [s]."""
        return median(median(frame.wall[threads]) for frame in self.soon[task])

    def tables(self) -> str:
        """In Markdown."""
        return "\n".join(self._tables()) if self.soon else ""

    def _tables(self) -> Iterator[str]:
        count = self.settings.rollouts
        yield (
            f"`em.capture_probability` of {count} rollouts along the script's plan, under"
            f" Uniform(strength={STRENGTH:g}, objects={OBJECTS}), as in"
            " [foresight](../results/foresight.md): of states that are captured, with five frames"
            " of their trajectory left. Medians of states and rounds, on one thread and on two.\n"
        )
        headers = ["wall, 1 [ms]", "CPU, 1 [ms]", "wall, 2 [ms]", "CPU, 2 [ms]", "steps"]
        yield f"Over {SOON:g} s:\n"
        yield markdown(["task", *headers], [row(task, of) for task, of in self.soon.items() if of])
        yield "The same with the step of `em.longest_step` (`error=0.02`) for these states:\n"
        heads = ["step [s]", "difference", "at worst", "wall, 1 [ms]", "of the usual"]
        yield markdown(
            ["task", *heads],
            [longer.row(task, self.soon[task]) for task, longer in self.longer.items()],
        )
        yield "Over five frames, with the AUC/AP of that page over as many (topple four):\n"
        known = foreseen(PAGE.read_text())
        rows = [
            [*row(task, of), f"{self.horizons[task]:.2f}", known.get(task, "")]
            for task, of in self.ahead.items()
            if of
        ]
        yield markdown(["task", *headers, "horizon [s]", "AUC/AP"], rows)


def row(task: str, frames: Sequence[Frame]) -> list[str]:
    """A row of a table."""
    times = np.median([frame.times() for frame in frames], axis=0)
    steps = median(frame.steps for frame in frames)
    return [task, *(digits(1e3 * seconds) for seconds in times), f"{steps:.0f}"]


def foreseen(page: str) -> dict[str, str]:
    """AUC/AP by task, from the page."""
    table = next(part for part in page.split("\n\n") if COLUMN in part.partition("\n")[0])
    head, _, *rows = [
        [cell.strip().strip("*") for cell in line.strip("|").split("|")]
        for line in table.splitlines()
    ]
    return {cells[0]: cells[head.index(COLUMN)] for cells in rows}


def measure_frames(frames: Frames, tell: Tell) -> None:
    """Fills it task by task."""
    settings = frames.settings
    for task in settings.tasks:
        dataset = em.datasets.generate(
            task, trajectories=2 * settings.states, frames=FRAMES, seed=0
        )
        soon, ahead = frames.soon.setdefault(task, []), frames.ahead.setdefault(task, [])
        problems: list[em.Problem] = []
        for number, (t, k) in enumerate(captured_states(dataset, settings.states), 1):
            tell(f"{task}: frame {number} of {settings.states}")
            times = dataset.trajectories[t].times
            later = float(times[k + AHEAD] - times[k])
            frames.horizons[task] = later
            for horizon, results in ((SOON, soon), (later, ahead)):
                problem = future_of(dataset, t, k, horizon)
                results.append(frame_of(problem, settings))
                if results is soon:
                    problems.append(problem)
        tell(f"{task}: longer steps")
        frames.longer[task] = longer_of(problems, settings)


def captured_states(dataset: em.datasets.Dataset, count: int) -> list[tuple[int, int]]:
    """Trajectory and frame of states that are captured now, with AHEAD frames left."""
    states = [
        (t, k)
        for t, trajectory in enumerate(dataset.trajectories)
        for k in range(len(trajectory) - AHEAD)
        if trajectory.captured[k]
    ]
    return [states[i] for i in np.linspace(0, len(states) - 1, count).astype(int)]


def future_of(dataset: em.datasets.Dataset, t: int, k: int, seconds: float) -> em.Problem:
    """Whether a state stays captured while the script goes on for so long."""
    trajectory, robot = dataset.trajectories[t], scripted(dataset)
    whole = round(seconds / robot.step) * robot.step
    now = float(trajectory.times[k])
    return robot.future(trajectory.states[k], now, trajectory.params, whole)


def disturbance_of(problem: em.Problem) -> em.disturbances.Uniform:
    """That of the foresight table."""
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    return em.disturbances.Uniform(strength=STRENGTH, objects=min(OBJECTS, objects))


def longer_of(problems: Sequence[em.Problem], settings: Settings) -> Longer:
    """The longest step, and what a probability takes with it."""
    choice = em.longest_step(
        problems, disturbance=disturbance_of(problems[0]), rollouts=PAIRS * settings.rollouts
    )
    with_it = [problem.with_step(choice.step) for problem in problems]
    return Longer(choice, tuple(frame_of(problem, settings) for problem in with_it))


def frame_of(problem: em.Problem, settings: Settings) -> Frame:
    """What one probability takes."""
    ask = partial(
        em.capture_probability,
        problem,
        disturbance=disturbance_of(problem),
        rollouts=settings.rollouts,
    )
    cpu: dict[int, list[float]] = {threads: [] for threads in THREADS}

    def timed(threads: int) -> None:
        start = time.process_time()
        ask(threads=threads)
        cpu[threads].append(time.process_time() - start)

    jobs = [partial(timed, threads) for threads in THREADS]
    wall = in_turns(jobs, settings.rounds, time.perf_counter)
    return Frame(dict(zip(THREADS, wall, strict=True)), cpu, ask().steps)
