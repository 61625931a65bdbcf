"""The command `energymargin demo`."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import replace_figure
from energymargin.cli.evaluate import print_evaluation
from energymargin.cli.options import WHERE, Where, options_of
from energymargin.cli.score import Scoring
from energymargin.cli.terminal import out, require_own_folder, say, share_bar, write_plot

TASK = "push"
FRAMES = 10
SEARCH = em.SearchSettings(nodes=30)
SUFFIXES = {".h5", ".db", ".md", ".csv", ".png", ".html"}
HANDLE, HEAD = (0.024, 0.22, 0.024), (0.11, 0.05, 0.05)  # m: along x, y and z, on a table
MASS = 0.4  # kg, of hard wood
BELOW_HEAD = (0.02, 0.05, 0.08, 0.11, 0.14, 0.17)  # m, of the middle of the pads
POSE_ERRORS = (0.003, 0.003, 0.001, 0.02, 0.02, 0.03)  # m, rad: standard deviations
FRICTION_ERROR = 0.1  # standard deviation
LIFT, LARGEST_TILT = 0.15, 0.6  # m, rad


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
    what = f"{trajectories} pushes, each state of which is scored, and six grips of a mallet"
    say(f"{what}. 6 pushes and 8 trials a grip take some 20 s on two cores, 50 and 30 a minute.")
    path = output / f"{TASK}.h5"
    if not _is_there(path, trajectories, settings.seed):
        with bar(f"Generating {TASK}", "trajectories") as progress:
            asked: Any = {"trajectories": trajectories, "frames": FRAMES, "seed": settings.seed}
            em.datasets.generate(TASK, path=path, progress=progress, **asked).close()
    dataset = em.datasets.load(path)
    scoring = Scoring(dataset, output / f"{TASK}-scores.db", settings, executor)
    with scoring.run(scoring.metrics()) as (run, _):
        labelled = run.labelled_scores()
    tables, files = em.evaluation.tables_of(labelled), [output / "table.md", output / "table.csv"]
    print_evaluation(tables, files, seed=settings.seed)
    scores = score_grips(trials, executor)
    out.print()
    out.print(em.summary.summary(scores))
    if find_spec("matplotlib") is None:
        say(escape("Pictures of all that need matplotlib: pip install 'energymargin[plots]'"))
    else:
        trees = em.plots.figure_trees(dataset, settings.nodes, settings.seed)
        replace_figure(output / "qualitative.png", trees)
        replace_figure(output / "scores.png", em.plots.figure_along(dataset, labelled))
        replace_figure(output / "grip.png", em.plots.figure_grasp(scores, scores.best), dpi=150)
        write_plot(output / "grips.png", em.plots.plot_grasps(scores))
    if find_spec("skimage") is not None:
        with share_bar() as tell:
            page = em.viewer.view(scores, scoring=lambda share: tell("The grips as a page", share))
        page.save(output / "grips.html")
        say("Open grips.html there in a browser: the grips turn and play")
    written = sorted(path.name for path in output.iterdir() if path.suffix in SUFFIXES)
    say(f"In {escape(str(output))}/: {', '.join(written)}")
    say(
        "Next: `energymargin grasps FILE --hand panda --object MESH --mass KG` ranks grasps of "
        "yours, `energymargin settle SCENE.xml` says what is at rest, `energymargin --help` has all"
    )


def _is_there(path: Path, trajectories: int, seed: int) -> bool:
    """Whether a file has these pushes already."""
    if not path.exists():
        return False
    with em.datasets.load(path) as found:
        return bool(found.seed == seed and found.lengths.tolist() == [FRAMES] * trajectories)


def score_grips(trials: int, executor: em.executors.Executor) -> em.grasps.GraspScores:
    """A Panda lifts a mallet by its handle in six ways, so many trials each."""
    handle = em.Part(em.Box(HANDLE), (0.0, -HANDLE[1] / 2, HANDLE[2] / 2))
    head = em.Part(em.Box(HEAD), (0.0, HEAD[1] / 2, HEAD[2] / 2))
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(BELOW_HEAD), 1, 1))  # from above
    poses[:, 1, 3], poses[:, 2, 3] = -np.array(BELOW_HEAD), HANDLE[2] / 2
    names = tuple(f"{100 * below:.0f} cm below the head" for below in BELOW_HEAD)
    motions = [em.grasps.Motion("lift", 0.6, LIFT), em.grasps.Motion("hold", 0.4)]
    mallet = em.grasps.GraspObject(em.Compound([handle, head]), MASS)
    protocol = em.grasps.Protocol(motions, table=True, angle=LARGEST_TILT)
    belief = em.grasps.GraspBelief(pose=POSE_ERRORS, friction=FRICTION_ERROR)
    asked = em.grasps.GraspSet(poses, names=names), "panda", mallet, protocol
    with bar("Gripping a mallet", "grips") as progress:
        runs: Any = {"rollouts": trials, "executor": executor, "progress": progress}
        return em.grasps.score(*asked, belief=belief, **runs)
