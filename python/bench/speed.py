"""What scores and probabilities cost: our time beside Bullet alone, MuJoCo and PyBullet.

`make bench` runs this. Each task is asked at some states of recorded trajectories, since the cost
depends on the state. What is compared takes turns, and what is shown are medians of the ratios of
pairs: so another job on the machine disturbs both. The tables are those of
docs/engineering/speed.md.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import cyclopts
from cyclopts import Parameter
from cyclopts.types import PositiveInt
from rich.console import Console

from energymargin.cli.terminal import share_bar
from measurements import TASKS, Settings, Tell
from report import report
from speed_answer import Answers, measure_answers
from speed_bodies import Bodies, measure_bodies
from speed_cores import Cores, Growth, measure_cores, measure_growth
from speed_error import Errors, measure_errors
from speed_frame import Frames, measure_frames
from speed_start import Start, measure_start
from speed_tasks import Tasks, measure_tasks
from tables import write

# By name: what holds the results, and what fills it.
PARTS: dict[str, tuple[Callable[[Settings], Any], Callable[[Any, Tell], None]]] = {
    "tasks": (Tasks, measure_tasks),
    "frame": (Frames, measure_frames),
    "answer": (Answers, measure_answers),
    "error": (Errors, measure_errors),
    "cores": (Cores, measure_cores),
    "growth": (Growth, measure_growth),
    "bodies": (Bodies, measure_bodies),
    "start": (Start, measure_start),
}

ALONE = ("error",)  # a long one, which is a page's block of its own
USUAL = tuple(part for part in PARTS if part not in ALONE)


def main(
    *,
    parts: Annotated[str, Parameter(help="With commas between.")] = ",".join(USUAL),
    tasks: Annotated[str, Parameter(help="With commas between.")] = ",".join(TASKS),
    states: Annotated[PositiveInt, Parameter(help="Of each task.")] = Settings.states,
    rounds: Annotated[PositiveInt, Parameter(help="Of each comparison.")] = Settings.rounds,
    quick: Annotated[bool, Parameter(negative=(), help="Little: does it work?")] = False,
    out: Annotated[Path | None, Parameter(help="Markdown file to write as well.")] = None,
    pages: Annotated[Path | None, Parameter(help="Folder of pages, as docs.")] = None,
) -> None:
    """Measures, and prints Markdown. Ctrl-C ends it at once: then it prints what there is."""
    chosen = some("parts", parts, tuple(PARTS))
    settings = Settings(some("tasks", tasks, TASKS), states, rounds)
    settings = settings.quick() if quick else settings
    load = os.getloadavg()[0]
    measured = {part: PARTS[part][0](settings) for part in chosen}
    interrupted = fill(measured)
    text = report(measured, settings, load)
    print(text)
    write(out, text, "bench", None if interrupted or quick else pages)
    if interrupted:
        raise SystemExit(128 + signal.SIGINT)


def some(option: str, words: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Those that an option names, in its order."""
    chosen = tuple(words.split(","))
    if unknown := sorted(set(chosen) - set(known)):
        raise SystemExit(f"{option} has {unknown[0]!r}, expected some of {', '.join(known)}")
    return chosen


def fill(measured: dict[str, Any]) -> bool:
    """Measures part by part under a bar of their share; whether that was interrupted."""
    with share_bar(Console(stderr=True)) as update:
        for number, (part, results) in enumerate(measured.items()):

            def tell(what: str, done: float = number / len(measured), part: str = part) -> None:
                update(f"{part}: {what}", done)

            try:
                PARTS[part][1](results, tell)
            except KeyboardInterrupt:
                return True
    return False


if __name__ == "__main__":
    cyclopts.run(main)
