"""Whether a version got slower: a camera's frame by the interpreters of two versions, in turns.

`make bench-versions OLD=42cd8fe6` installs another version beside this one, and runs this. Both are
asked about the same states; what they answer stands beside the time. This one is asked with the
longest step that answers alike as well.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import cyclopts
import numpy as np
from cyclopts import Parameter
from cyclopts.types import PositiveInt

SOON, ROLLOUTS = 0.5, 30  # s
SLOWER = 1.05
ANSWER = "answer: "


def problem_of(asked: dict[str, Any]) -> Any:
    """Whether a state stays captured while the script goes on, in any version."""
    import energymargin as em

    task: Any = em.tasks.make(asked["task"])
    return task.future(np.array(asked["state"]), asked["time"], asked["params"], SOON)


def worker() -> None:
    """Answers questions, a line each. It has to run in old versions too."""
    import energymargin as em

    for line in sys.stdin:
        asked = json.loads(line)
        problem = problem_of(asked)
        if asked.get("step"):
            problem = problem.with_step(asked["step"])
        start = time.process_time()
        answer = em.capture_probability(problem, rollouts=ROLLOUTS, seed=0, threads=1)
        print(f"{ANSWER}{json.dumps([time.process_time() - start, answer.captured])}", flush=True)


@dataclass
class Version:
    """An interpreter that waits for questions."""

    process: subprocess.Popen[str]

    @staticmethod
    def started(python: str) -> Version:
        """With the energymargin that it has."""
        command = [python, "-W", "ignore", __file__, "--worker"]
        pipe = subprocess.PIPE
        return Version(subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True))

    def ask(self, question: dict[str, Any]) -> tuple[float, float]:
        """CPU time [s] and the probability."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            if line.startswith(ANSWER):
                seconds, captured = json.loads(line.removeprefix(ANSWER))
                return seconds, captured
        raise SystemExit(f"{self.process.args!r} ended without an answer")


@dataclass
class Compared:
    """What there is of a task."""

    old: list[float] = field(default_factory=list)
    """CPU time of each pair [s]."""
    new: list[float] = field(default_factory=list)
    longer: list[float] = field(default_factory=list)
    """Of the new version with the longest step."""
    step: float = 0.0
    """That [s]."""
    moved: list[float] = field(default_factory=list)
    """How far the probability of each state is from the old one's."""

    def ratio(self) -> float:
        """Median of the pairs' ratios."""
        return float(np.median(np.divide(self.new, self.old)))

    def row(self, task: str) -> list[str]:
        """Of the table."""
        old, new, longer = (
            f"{1e3 * np.median(times):.2f}" for times in (self.old, self.new, self.longer)
        )
        with_it = f"{np.median(np.divide(self.longer, self.old)):.3f}"
        slower = "slower" if self.ratio() > SLOWER else ""
        moved = f"{np.mean(self.moved):.3f}"
        step = f"1/{1 / self.step:.0f}"
        return [task, old, new, f"{self.ratio():.3f}", moved, slower, step, longer, with_it]


def questions(task: str, states: int) -> list[dict[str, Any]]:
    """States of a task's trajectories that are captured, with five frames left."""
    import energymargin as em
    from measurements import FRAMES
    from speed_frame import captured_states

    data = em.datasets.generate(task, trajectories=2 * states, frames=FRAMES, seed=0)
    return [
        {
            "task": task,
            "state": data.trajectories[t].states[k].tolist(),
            "time": float(data.trajectories[t].times[k]),
            "params": dict(data.trajectories[t].params),
        }
        for t, k in captured_states(data, states)
    ]


def compared(old: Version, new: Version, task: str, states: int, rounds: int) -> Compared:
    """Pairs, of which every second begins with the new version; a first one warms up."""
    asked = questions(task, states)
    result = Compared(step=longest(asked))
    for question in asked:
        answers = [version.ask(question)[1] for version in (old, new)]
        result.moved.append(abs(answers[1] - answers[0]))
        for i in range(rounds):
            order = ((old, result.old), (new, result.new))
            for version, times in order if i % 2 else reversed(order):
                times.append(version.ask(question)[0])
            result.longer.append(new.ask(question | {"step": result.step})[0])
    return result


def longest(asked: list[dict[str, Any]]) -> float:
    """The longest step [s] whose probabilities of these states are within .02."""
    import energymargin as em

    return em.longest_step([problem_of(question) for question in asked], rollouts=200).step


def main(
    old: Annotated[str, Parameter(help="Interpreter that has the other version.")],
    *,
    tasks: Annotated[str, Parameter(help="With commas between.")] = "",
    states: Annotated[PositiveInt, Parameter(help="Of each task.")] = 6,
    rounds: Annotated[PositiveInt, Parameter(help="Pairs of each state.")] = 7,
) -> None:
    """Prints a table. Exits with 1 if a task takes more than 5 % longer than in the old version."""
    from measurements import TASKS
    from tables import markdown

    both = Version.started(old), Version.started(sys.executable)
    chosen = tasks.split(",") if tasks else TASKS
    found = {task: compared(*both, task, states, rounds) for task in chosen}
    heads = ["task", "old [ms]", "new [ms]", "new / old", "probability moved by", ""]
    heads += ["longest step [s]", "with it [ms]", "/ old"]
    print(markdown(heads, [each.row(task) for task, each in found.items()]))
    raise SystemExit(int(any(each.ratio() > SLOWER for each in found.values())))


if __name__ == "__main__":
    if sys.argv[1:] == ["--worker"]:
        worker()
    else:
        sys.path.insert(0, str(Path(__file__).parent))
        cyclopts.run(main)
