"""The command `energymargin demo`."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import replace_figure
from energymargin.cli.demo_grips import draw_grips, score_grips
from energymargin.cli.evaluate import print_evaluation
from energymargin.cli.fields import options_of
from energymargin.cli.options import WHERE, Where
from energymargin.cli.places import require_own_folder
from energymargin.cli.progress import share_bar
from energymargin.cli.score import scored_run
from energymargin.cli.terminal import err, out, say

TASK = "push"
FRAMES = 10
SEARCH = em.SearchSettings(nodes=30)
SUFFIXES = {".h5", ".db", ".md", ".csv", ".png", ".html"}


@options_of(SEARCH, "nodes", "seed")
def demo(
    *,
    output: Annotated[Path, Parameter(alias="-o")] = Path("out"),
    trajectories: int = 6,
    trials: int = 8,
    threads: Annotated[int | None, Parameter(group=WHERE)] = None,
    overwrite: bool = False,
    **given: Any,
) -> None:
    """The whole way on planar pushing: scores, table, pictures; and where to grip a mallet. Some
    twenty seconds. Stopped, it goes on from there.

    Example: `energymargin demo -o out`

    In a minute on two cores, with more of both: `energymargin demo --trajectories 50 --trials 30`

    Args:
        output: Folder for all files.
        trajectories: How many pushes.
        trials: How many trials each grip of the mallet has.
        threads: Threads; all cores if not given. Scores do not depend on it.
        overwrite: Take a folder that has files of others too, and replace those of the same
            names.
    """
    require_own_folder(output, overwrite=overwrite)
    settings, executor = replace(SEARCH, **given), Where(threads=threads).executor()
    say(
        f"{trajectories} pushes, each state of which is scored, and six grips of a mallet. With 6 "
        "pushes and 8 trials a grip this takes some 20 s on two cores, with 50 and 30 a minute, "
        "and two with 100 nodes in place of 30."
    )
    path = output / f"{TASK}.h5"
    if not _is_there(path, trajectories, settings.seed):
        with bar(f"Generating {TASK}", "trajectories") as progress:
            asked: Any = {"trajectories": trajectories, "frames": FRAMES, "seed": settings.seed}
            em.datasets.generate(TASK, path=path, progress=progress, **asked).close()
    dataset = em.datasets.load(path)
    database = output / f"{TASK}-scores.db"
    metrics = em.store.dataset_metrics(dataset, None, settings)
    with scored_run(dataset, database, settings, metrics, executor) as (run, _):
        labelled = run.labelled_scores()
    print_evaluation(labelled, [output / "table.md", output / "table.csv"], seed=settings.seed)
    scores = score_grips(trials, executor)
    out.print()
    out.print(em.summary.summary(scores))
    if find_spec("matplotlib") is None:
        say(escape("Pictures of all that need matplotlib: pip install 'energymargin[plots]'"))
    else:
        _draw(dataset, labelled, settings, scores, output)
    if find_spec("skimage") is not None:
        with share_bar(err) as tell:
            page = em.viewer.view(scores, scoring=lambda share: tell("The grips as a page", share))
        page.save(output / "grips.html")
        say("Open grips.html there in a browser: the grips turn and play")
    written = sorted(path.name for path in output.iterdir() if path.suffix in SUFFIXES)
    say(f"In {escape(str(output))}/: {', '.join(written)}")
    say(
        "Next: `energymargin grasps FILE --hand panda --object MESH --mass KG` ranks grasps of "
        "yours, `energymargin settle SCENE.xml` says what is at rest, `energymargin --help` has all"
    )


def _draw(
    dataset: em.datasets.Dataset,
    labelled: em.evaluation.LabelledScores,
    settings: em.SearchSettings,
    scores: em.grasps.GraspScores,
    output: Path,
) -> None:
    """Pictures of pushes and grips."""
    trees = em.plots.figure_trees(dataset, settings.nodes, settings.seed)
    replace_figure(output / "qualitative.png", trees)
    replace_figure(output / "scores.png", em.plots.figure_along(dataset, labelled))
    draw_grips(scores, output)


def _is_there(path: Path, trajectories: int, seed: int) -> bool:
    """Whether a file has these pushes already."""
    if not path.exists():
        return False
    with em.datasets.load(path) as found:
        return bool(found.seed == seed and found.lengths.tolist() == [FRAMES] * trajectories)
