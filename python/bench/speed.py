"""What scores cost: our time against the floor, which is Bullet alone, and against PyBullet.

`make bench` runs this. Each task is asked at some states of recorded trajectories, since the cost
depends on the state. What is compared takes turns, and what is shown are medians of the ratios of
pairs: so another job on the machine disturbs both.
"""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from energymargin.progress import share_bar
from measurements import TASKS, Results, Settings, measure
from report import report


def main(
    tasks: Annotated[str, typer.Option(help="With commas between.")] = ",".join(TASKS),
    states: Annotated[int, typer.Option(min=1, help="Of each task.")] = Settings.states,
    rounds: Annotated[int, typer.Option(min=1, help="Pairs of each comparison.")] = Settings.rounds,
    quick: Annotated[bool, typer.Option("--quick", help="Little trees: does it work?")] = False,
    out: Annotated[Path | None, typer.Option(help="Markdown file to write as well.")] = None,
) -> None:
    """Measures, and prints Markdown. Ctrl-C ends it at once: then it prints what there is."""
    chosen = tuple(tasks.split(","))
    if unknown := sorted(set(chosen) - set(TASKS)):
        raise typer.BadParameter(f"tasks has {unknown[0]!r}, expected some of {', '.join(TASKS)}")
    settings = Settings(chosen, states, rounds)
    results = Results(settings.quick() if quick else settings)
    interrupted = fill(results)
    text = report(results)
    print(text)
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
    if interrupted:
        raise typer.Exit(128 + signal.SIGINT)


def fill(results: Results) -> bool:
    """Measures under a progress bar; whether that was interrupted."""
    begun = 0
    with share_bar(Console(stderr=True)) as update:

        def tell(what: str) -> None:
            nonlocal begun
            update(what, begun / results.settings.pieces())
            begun += 1

        try:
            measure(results, tell)
        except KeyboardInterrupt:
            return True
    return False


if __name__ == "__main__":
    typer.run(main)
