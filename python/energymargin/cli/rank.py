"""The command `energymargin rank`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import energymargin as em
from energymargin.base.bars import bar
from energymargin.cli.options import Outputs, Where, chosen_sampling, options_of, panel
from energymargin.cli.terminal import PICTURES, TEXTS, require_outputs, show_table

COMPARED = panel("How candidates are compared")


@options_of(em.SearchSettings(), "nodes", "seed")
def rank(
    problems: list[Path],
    /,
    *,
    metric: str = "probability",
    rollouts: int = 200,
    strength: float | None = None,
    belief: str | None = None,
    confidence: Annotated[float, COMPARED] = 0.95,
    tolerance: Annotated[float, COMPARED] = 0.05,
    race: Annotated[bool, COMPARED, Parameter(negative="--no-race")] = True,
    output: Outputs = None,
    overwrite: bool = False,
    where: Where = Where(),
    **given: Any,
) -> None:
    """Rank problems: which plan, grasp or push holds best, and how sure is that?

    All candidates meet the same random disturbances. The table has 95 % intervals, and the last
    line says what can be decided.

    Example: `energymargin rank left.json middle.json right.json -o ranking.png`

    Args:
        problems: Problem files, from `problem.save(...)`: the candidates.
        metric: What is to be large: probability, probability/success, effort, effort/est or
            effort/rrt.
        rollouts: The most draws of each candidate; for an effort, the most searches.
        strength: Strength of the disturbance of probabilities: a share of the problems' bounds, by
            default 1.
        belief: How well the models are known, as JSON or a file of it: friction, mass, pose,
            velocity.
        output: Also the table as .csv or .md, or a picture: .png, .pdf, .svg. May be repeated.
        overwrite: Replace files that exist.
        confidence: Confidence in all comparisons together, below 1.
        tolerance: A difference of probabilities that does not matter, below 1.
        race: Whoever is beaten is out before the end.
    """
    if strength is not None and metric.startswith("effort"):
        raise ValueError(f"--strength is {strength:g} with --metric {metric}, which has none")
    require_outputs(output or (), overwrite=overwrite, suffixes=TEXTS + PICTURES)
    sampling = chosen_sampling(belief, None)
    with bar("Ranking", "draws") as progress:
        ranking = em.rank(
            _candidates(problems),
            metric=metric,
            rollouts=rollouts,
            disturbance=None if strength is None else em.disturbances.Uniform(strength),
            uncertainty=None if sampling is None else sampling.uncertainty,
            confidence=confidence,
            tolerance=tolerance,
            race=race,
            **given,
            executor=where.executor(),
            progress=progress,
            timeout=where.timeout,
        )
    done, draw = "all draws were made", lambda: em.plots.plot_ranking(ranking)
    show_table(ranking, output or (), done, draw)


def _candidates(paths: list[Path]) -> dict[str, em.Problem]:
    """The problems by the names of their files, or by their paths if two have the same name."""
    stems = {path.stem for path in paths}
    names = [path.stem if len(stems) == len(paths) else str(path) for path in paths]
    if len(set(names)) < len(paths):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"problems has {twice} twice, expected different files")
    return {name: em.Problem.load(str(path)) for name, path in zip(names, paths, strict=True)}
