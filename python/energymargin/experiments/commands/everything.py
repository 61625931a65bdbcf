"""All studies, one after the other, into one folder with an index page."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from energymargin.cli.options import Threads, split
from energymargin.cli.terminal import err, say
from energymargin.experiments.commands import checks, paper
from energymargin.experiments.commands.shared import app, folder_of

__all__ = ["STUDIES", "everything"]

Run = Callable[[Path, bool, int | None], None]
NODES = 100  # of the trees of table 1

# By name: what it shows, and how it runs with a folder, `quick` and the number of threads.
STUDIES: dict[str, tuple[str, Run]] = {
    "table1": (
        "Prediction of robustness and success, on every task (Table I)",
        lambda folder, quick, threads: paper.table1(
            nodes=None if quick else NODES, quick=quick, threads=threads, output=folder
        ),
    ),
    "figure-quality": (
        "Trees in six frames of two pushes (the qualitative figure)",
        lambda folder, quick, threads: paper.figure_quality(
            quick=quick, threads=threads, output=folder
        ),
    ),
    "efficiency": (
        "Success prediction and time a state, by nodes (the figure of time efficiency)",
        lambda folder, quick, threads: paper.efficiency(
            quick=quick, threads=threads, output=folder
        ),
    ),
    "perturbation": (
        "Prediction with errors of the model (the figure of robustness)",
        lambda folder, quick, threads: paper.perturbation(
            quick=quick, threads=threads, output=folder
        ),
    ),
    "table2": (
        "Prediction on recorded pushes, a simulated stand-in (Table II)",
        lambda folder, quick, threads: paper.table2(quick=quick, threads=threads, output=folder),
    ),
    "foresight": (
        "What each score of a state foresees of the next frames",
        lambda folder, quick, threads: checks.foresight(
            quick=quick, threads=threads, output=folder
        ),
    ),
    "enlarged": (
        "Centimetres and grams at true scale, beside enlarged scenes",
        lambda folder, quick, _threads: checks.enlarged(quick=quick, output=folder),
    ),
    "bowl": (
        "The escape energy of a ball in a bowl (Definition 2)",
        lambda folder, quick, _threads: checks.bowl(
            samples=500 if quick else 2000, seeds=2 if quick else 10, output=folder
        ),
    ),
    "audit": (
        "Where the energy of rollouts goes",
        lambda folder, quick, _threads: checks.audit(quick=quick, output=folder),
    ),
    "closed-forms": (
        "The effort of escape against answers known on paper",
        lambda folder, quick, threads: checks.closed_forms(
            nodes=200 if quick else 5000,
            seeds=2 if quick else 20,
            gain_seeds=1 if quick else 8,
            threads=threads,
            output=folder,
        ),
    ),
    "walls": (
        "Whether anything gets through a wall",
        lambda folder, quick, threads: checks.walls(quick=quick, threads=threads, output=folder),
    ),
    "uncertainty": (
        "How often the intervals of the scores hold the truth",
        lambda folder, quick, threads: checks.uncertainty(
            nodes="20" if quick else "100,300",
            states=1 if quick else 5,
            trees=40 if quick else 200,
            threads=threads,
            output=folder,
        ),
    ),
    "fewer-steps": (
        "What it gains to use more of each rollout",
        lambda folder, quick, threads: checks.fewer_steps(
            quick=quick, threads=threads, output=folder
        ),
    ),
}


@app.command("all")
def everything(
    *,
    only: Annotated[
        str | None,
        typer.Option(help="Which studies, with commas between.", show_default="all of them"),
    ] = None,
    threads: Threads = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for all folders.",
            show_default="out/all, or out/all-quick",
        ),
    ] = None,
    pages: Annotated[
        Path | None,
        typer.Option(help="A folder of pages (docs/results), whose results are made anew."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="A first picture of everything, in some minutes.")
    ] = False,
) -> None:
    """Every study of this list, into one folder with an index page (index.html, index.md).

    Each goes into a folder of its own, with its numbers and pictures; the page is written again
    after each. The five of the paper take an hour or more on two cores, the walls hours, the others
    one and a half; stop it with Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce all --only table2,enlarged`
    """
    from energymargin.executors.threads import thread_count
    from energymargin.experiments.index_page import write_index
    from energymargin.experiments.results_pages import check_pages, put_into
    from energymargin.experiments.times import Times

    chosen = list(STUDIES) if only is None else split(only)
    wrong = [name for name in chosen if name not in STUDIES]
    if wrong or not chosen:
        what = repr(wrong[0]) if wrong else "nothing"
        raise ValueError(f"only has {what}, expected some of {', '.join(STUDIES)}")
    if pages is not None:
        if quick:
            raise ValueError("pages are made from the full studies, expected no --quick with them")
        check_pages(pages)
    output = folder_of(output, "all", quick)
    output.mkdir(parents=True, exist_ok=True)
    times = Times(output / "times.json")
    times.of(chosen[0])  # a file that holds something else is said now, not after hours
    shows = {name: study[0] for name, study in STUDIES.items()}
    for number, name in enumerate(chosen, 1):
        err.print(f"[bold]{name}[/] ({number} of {len(chosen)}): {shows[name]}")
        begun = time.monotonic()
        try:
            STUDIES[name][1](output / name, quick, threads)
        finally:
            times.add(name, time.monotonic() - begun)
        write_index(output, shows, times, thread_count(threads))
    if pages is not None:
        made = put_into(pages, output)
        say(f"Made anew: {', '.join(escape(str(page)) for page in made)}.")
    say(f"In {escape(str(output))}/: index.html, index.md, and a folder for each study")
