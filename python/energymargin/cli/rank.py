"""The command `energymargin rank`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.fields import options_of
from energymargin.cli.options import (
    WHERE,
    OverwriteOption,
    SchedulerOption,
    ThreadsOption,
    TimeoutOption,
    chosen_executor,
    chosen_sampling,
)
from energymargin.cli.places import require_free
from energymargin.cli.terminal import TIMED_OUT, err, out, say
from energymargin.searches import SearchSettings

if TYPE_CHECKING:
    from energymargin import Problem, Ranking

TEXTS, PICTURES = (".csv", ".md"), (".png", ".pdf", ".svg")
RACE = "How candidates are compared"


@options_of(SearchSettings(), "nodes", "seed")
@options_of(SearchSettings(), "search", panel=RACE)
def rank(
    problems: Annotated[
        list[Path], typer.Argument(help="Problem files, from `problem.save(...)`: the candidates.")
    ],
    *,
    metric: Annotated[
        str,
        typer.Option(
            help="What is to be large: probability, probability/success, effort/est or effort/rrt.",
            metavar="METRIC",
        ),
    ] = "probability",
    rollouts: Annotated[
        int, typer.Option(help="The most draws of each candidate; of an effort, searches.")
    ] = 200,
    strength: Annotated[
        float | None,
        typer.Option(
            help="Of the disturbance of probabilities: a share of the problems' bounds, by "
            "default 1."
        ),
    ] = None,
    belief: Annotated[
        str | None,
        typer.Option(
            help="How well the models are known, as JSON or a file of it: friction, mass, pose, "
            "velocity.",
            metavar="JSON|FILE",
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(help="Of all comparisons together, below 1.", rich_help_panel=RACE),
    ] = 0.95,
    tolerance: Annotated[
        float,
        typer.Option(
            help="A difference of probabilities that does not matter, below 1.",
            rich_help_panel=RACE,
        ),
    ] = 0.05,
    race: Annotated[
        bool,
        typer.Option(
            "--race/--no-race",
            help="Whoever is beaten is out before the end.",
            rich_help_panel=RACE,
        ),
    ] = True,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Also the table as .csv or .md, or a picture: .png, .pdf, .svg."
        ),
    ] = None,
    overwrite: OverwriteOption = False,
    threads: ThreadsOption = None,
    processes: Annotated[
        int | None,
        typer.Option(help="So many processes instead of threads.", rich_help_panel=WHERE),
    ] = None,
    scheduler: SchedulerOption = None,
    timeout: TimeoutOption = None,
    **given: Any,
) -> None:
    """Rank problems: which plan, grasp or push holds best, and how sure is that?

    All candidates meet the same random disturbances. The table has 95 % intervals, and the last
    line says what can be decided.

    Example: `energymargin rank left.json middle.json right.json -o ranking.png`
    """
    from energymargin import actions, disturbances
    from energymargin.cli.progress import progress_bar

    if strength is not None and metric.startswith("effort"):
        raise ValueError(f"--strength is {strength:g} with --metric {metric}, which has none")
    if output is not None:
        _check_output(output, overwrite=overwrite)
    sampling = chosen_sampling(belief, None)
    with progress_bar(err, "Ranking", "draws") as progress:
        ranking = actions.rank(
            _candidates(problems),
            metric=metric,
            rollouts=rollouts,
            disturbance=None if strength is None else disturbances.Uniform(strength),
            uncertainty=None if sampling is None else sampling.uncertainty,
            confidence=confidence,
            tolerance=tolerance,
            race=race,
            **{name: value for name, value in given.items() if value is not None},
            executor=chosen_executor(threads, processes, scheduler),
            progress=progress,
            timeout=timeout,
        )
    out.print(ranking.to_markdown(), markup=False, highlight=False, soft_wrap=True)
    if output is not None:
        _write(output, ranking)
        say(f"Wrote {escape(str(output))}")
    if not ranking.complete:
        say("[yellow]the time was over before all draws were made[/]")
        raise typer.Exit(TIMED_OUT)


def _candidates(paths: list[Path]) -> dict[str, Problem]:
    """The problems by the names of their files, or by their paths if two have the same name."""
    from energymargin import Problem

    stems = {path.stem for path in paths}
    names = [path.stem if len(stems) == len(paths) else str(path) for path in paths]
    if len(set(names)) < len(paths):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"problems has {twice} twice, expected different files")
    return {name: Problem.load(str(path)) for name, path in zip(names, paths, strict=True)}


def _check_output(path: Path, *, overwrite: bool) -> None:
    """Raises ValueError on a file of another kind, or one that exists."""
    if path.suffix not in (*TEXTS, *PICTURES):
        raise ValueError(
            f"--output is {path}, expected a name that ends with {', '.join((*TEXTS, *PICTURES))}"
        )
    require_free(path, overwrite=overwrite)
    if not path.parent.is_dir():
        raise ValueError(f"--output is {path}, but there is no folder {path.parent}")
    if path.suffix in PICTURES:
        import energymargin.plots  # noqa: F401  says what is missing before anything is computed


def _write(path: Path, ranking: Ranking) -> None:
    if path.suffix in PICTURES:
        from energymargin.plots import plot_ranking

        figure = plot_ranking(ranking).get_figure(root=True)
        assert figure is not None
        figure.savefig(path)
    else:
        from energymargin.replacing import replace_text

        replace_text(path, ranking.to_csv() if path.suffix == ".csv" else ranking.to_markdown())
