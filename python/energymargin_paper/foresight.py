"""Will it hold for the next frames? What each score of a state foresees, on every task.

The scores of the paper, the probability of `capture_probability` with and without the robot's plan,
the plan alone, a learned classifier, and the ceiling, all held against "it stays captured for the
next h frames". Only states that are captured now count, with h frames left in their trajectory:
that others are lost needs no foresight.

Every probability is one line of runs.jsonl in the folder, written as soon as it is there, and the
other scores are in stores: stopped and started again, the study goes on with what is missing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Cancel, World, capture_probability, disturbances, stream
from energymargin.datasets import Dataset
from energymargin.datasets.generation import load_or_generate
from energymargin.executors.threads import Threads
from energymargin.settings import SearchSettings
from energymargin.store import ScoreStore, add_scores, score_dataset
from energymargin.tasks.base import ScriptedTask
from energymargin.trajectories import Trajectory
from energymargin_paper.ceiling import CAPTURED, CEILING, ceiling_dataset, scripted
from energymargin_paper.foresight_text import (
    HORIZONS,
    LEARNED,
    NAMES,
    NO_PROBABILITY,
    NOMINAL,
    PLANS,
    PUBLISHED,
    SCRIPT,
    Foresight,
    Settings,
    TaskForesight,
)
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from energymargin.plots.styles import LineStyle

__all__ = [
    "FRAMES",
    "STUDY",
    "Settings",
    "figure_foresight",
    "learned",
    "nominal",
    "share_by_frame",
]

FRAMES = 10  # of a trajectory
LOOK = 4  # steps between two looks at the nominal rollout, as of a problem's `check`
FOLDS = 5  # of the learned baseline
SAMPLED = 10  # states whose trees say how many steps a tree takes
RUNS_FILE = "runs.jsonl"


@dataclass(frozen=True)
class Job:
    """One probability of one state."""

    version: str
    task: str
    trajectories: int
    index: int
    """Of the state in its dataset."""
    method: str
    rollouts: int
    strength: float
    objects: int | None
    seed: int


@dataclass(frozen=True)
class Row:
    """What came out of a job."""

    shares: list[float]
    """Captured throughout until h frames later, for h = 1, 2, ... as far as the trajectory goes."""
    steps: int
    """Of the simulation."""
    seconds: float
    """It took, on one thread [s]."""
    error: str | None = None
    """Why there are no shares."""


class ForesightStudy(Study[Settings, Foresight]):
    """Will it hold for the next frames? What each score of a state foresees, on every task.

    The scores of the paper, the probability to stay captured with and without the robot's plan, the
    plan alone, a learned classifier and the ceiling, on states that are captured now; and whether
    the probabilities mean what they say.

    The folder gets foresight.md, foresight.csv, reliability.csv, foresight.png, runs.jsonl, the
    trajectories and the stores of scores. It takes an hour or two on two cores; stop it with
    Ctrl-C: the same command goes on from there.

    Example: `energymargin reproduce foresight --tasks push,balance`
    """

    name = "foresight"
    title, unit = "Foreseeing", "states"
    settings = Settings()
    quick = Settings(trajectories=8, nodes=20, rollouts=8, fresh=16, continuations=8)

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Foresight:
        """Makes what is not in the folder yet; `progress` counts states, once for each score."""
        parts = {
            name: load_or_generate(
                *(folder / f"{name}.h5", tasks.make(name), settings.trajectories),
                *(FRAMES, settings.seed),
            )
            for name in settings.tasks
        }
        jobs = [job for dataset in parts.values() for job in _jobs(dataset, settings)]
        states = 2 * sum(dataset.size for dataset in parts.values())  # scores, and ceiling
        total = states + len(jobs)
        done = 0
        for dataset in parts.values():
            for stage in (_score, _continue):

                def count(states_done: int, _of: int, before: int = done) -> None:
                    progress(before + states_done, total)

                stage(dataset, settings, folder, threads, count)
                done += dataset.size
        robots = {name: scripted(dataset) for name, dataset in parts.items()}
        rows = resumed(
            folder / RUNS_FILE,
            jobs,
            partial(_run, parts, robots),
            threads,
            lines=pairs(Job, Row),
            progress=lambda n, _of: progress(states + n, total),
        )
        results = [_result(dataset, settings, folder, rows) for dataset in parts.values()]
        return Foresight(settings, results)

    def write(self, result: Foresight, folder: Path) -> None:
        """The reliability too."""
        super().write(result, folder)
        (folder / "reliability.csv").write_text(result.reliability_csv())

    def figures(self, result: Foresight) -> Iterator[tuple[str, Figure]]:
        """AUC by horizon, and reliability, a column a task."""
        yield "foresight.png", figure_foresight(result)


STUDY = ForesightStudy()


def _score(
    dataset: Dataset,
    settings: Settings,
    folder: Path,
    threads: int,
    progress: Callable[[int, int], None],
) -> None:
    """The paper's scores, as published."""
    search = SearchSettings(settings.nodes, settings.seed, search="published")
    path = folder / f"{dataset.task}-scores.db"
    score_dataset(
        dataset, path, PUBLISHED, settings=search, executor=Threads(threads), progress=progress
    )


def _continue(
    dataset: Dataset,
    settings: Settings,
    folder: Path,
    threads: int,
    progress: Callable[[int, int], None],
) -> None:
    """The shares of the ceiling."""
    path = folder / f"{dataset.task}-{CEILING}.db"
    count, seed = settings.continuations, settings.seed
    ceiling_dataset(dataset, path, count, seed, threads=threads, progress=progress)


def _jobs(dataset: Dataset, settings: Settings) -> Iterator[Job]:
    """Of the states that are captured now, with a frame after them."""
    program, frames, most = version("energymargin"), dataset.frames(), _objects(dataset)
    for name, method in settings.methods().items():
        objects = None if method.objects is None else min(method.objects, most)
        for index, (t, k) in enumerate(frames):
            trajectory = dataset.trajectories[t]
            if trajectory.captured[k] and k + 1 < len(trajectory):
                yield Job(
                    *(program, dataset.task, settings.trajectories, index, name),
                    *(method.rollouts, method.strength, objects, method.seed),
                )


def _objects(dataset: Dataset) -> int:
    """How many a task has."""
    scene = scripted(dataset).scene(dataset.trajectories[0].params)
    return sum(body.role == "object" for body in scene.bodies)


def _run(
    parts: Mapping[str, Dataset], robots: Mapping[str, ScriptedTask], job: Job, cancel: Cancel
) -> tuple[Job, Row]:
    dataset = parts[job.task]
    t, k = dataset.frames()[job.index]
    begun = time.perf_counter()
    try:
        shares, steps = _shares(robots[job.task], dataset.trajectories[t], k, job, cancel)
    except (ValueError, RuntimeError) as error:
        return job, Row([], 0, time.perf_counter() - begun, str(error))
    return job, Row(shares, steps, time.perf_counter() - begun)


def _shares(
    task: ScriptedTask, trajectory: Trajectory, frame: int, job: Job, cancel: Cancel
) -> tuple[list[float], int]:
    """Shares by frame, and how many steps they took."""
    now = float(trajectory.times[frame])
    later = trajectory.times[frame + 1 : frame + 1 + max(HORIZONS)] - now
    horizon = round(later[-1] / task.step) * task.step
    plan = PLANS[job.method]
    problem = task.future(trajectory.states[frame], now, trajectory.params, horizon, plan)
    if job.method == NOMINAL:
        return nominal(problem, later, cancel)
    p = capture_probability(
        problem,
        disturbance=disturbances.Uniform(strength=job.strength, objects=job.objects),
        rollouts=job.rollouts,
        seed=stream(job.seed, job.index),
        cancel=cancel,
    )
    return share_by_frame(p.times, p.curve, later), p.steps


def nominal(
    problem: Any, later: NDArray[np.float64], cancel: Cancel | None = None
) -> tuple[list[float], int]:
    """Whether the undisturbed future stays captured until `later` [s], shape (H,): 1 or 0 each, and
    the steps that it took."""
    step = problem.scene.step
    ends = np.round(later / step).astype(int)
    looks = sorted({*range(0, int(ends[-1]), LOOK), *ends.tolist()})
    world = World(problem.scene) if problem.plan is None else World(problem.scene, problem.plan)
    states = world.simulate(problem.state, looks[-1], record=looks, cancel=cancel).states
    inside = np.logical_and.accumulate(problem.captured.contains(problem.scene, states))
    return share_by_frame(np.array(looks) * step, inside.astype(float), later), int(ends[-1])


def share_by_frame(
    times: NDArray[np.float64], curve: NDArray[np.float64], later: NDArray[np.float64]
) -> list[float]:
    """A curve over `times` [s] at the latest one that is not after each of `later` [s]."""
    at = np.searchsorted(times, np.asarray(later) + 1e-9, side="right") - 1
    return [float(share) for share in np.asarray(curve)[at]]


def _result(
    dataset: Dataset, settings: Settings, folder: Path, rows: Mapping[Job, Row]
) -> TaskForesight:
    """All scores of a task's states, by horizon, and what happened."""
    places = np.array(dataset.frames())
    captured = np.array([trajectory.captured for trajectory in dataset.trajectories])
    labels, counts = _labels(captured, places)
    scores = _stored(dataset, settings, folder)
    steps = {name: _tree_steps(dataset, settings, name) for name in PUBLISHED}
    left = (FRAMES - 1 - places[:, 1]) * scripted(dataset).steps / (FRAMES - 1)
    steps[CEILING] = float(settings.continuations * left[counts[1]].mean())
    for name in settings.methods():
        of_method = [(job, row) for job, row in rows.items() if _is(job, dataset.task, name)]
        scores[name] = {h: np.full(dataset.size, np.nan) for h in HORIZONS}
        for job, row in of_method:
            for h, share in enumerate(row.shares, 1):
                scores[name][h][job.index] = share
        steps[name] = float(np.mean([row.steps for _, row in of_method])) if of_method else 0.0
    scores[LEARNED] = {
        h: learned(_states(dataset), labels[h], places[:, 0], counts[h], settings.seed)
        for h in HORIZONS
    }
    _keep_learned(dataset, settings, folder, scores[LEARNED])
    steps[LEARNED] = 0.0
    failed = sum(row.error is not None for job, row in rows.items() if job.task == dataset.task)
    return TaskForesight(
        *(dataset.task, places[:, 0], labels, counts, scores, steps, failed), seed=settings.seed
    )


def _keep_learned(
    dataset: Dataset, settings: Settings, folder: Path, scores: Mapping[int, NDArray[np.float64]]
) -> None:
    """Puts the classifier's probabilities beside the paper's scores, as a run of its own, which the
    report, the viewer and `evaluate` show as any other."""
    of_horizons = {CAPTURED[h]: values for h, values in scores.items()}
    source = {"source": LEARNED, "seed": settings.seed}
    add_scores(folder / f"{dataset.task}-scores.db", dataset, of_horizons, source)


def _is(job: Job, task: str, method: str) -> bool:
    return job.task == task and job.method == method


def _states(dataset: Dataset) -> NDArray[np.float64]:
    return np.concatenate([trajectory.states for trajectory in dataset.trajectories])


def _labels(
    captured: NDArray[np.bool_], places: NDArray[np.int64]
) -> tuple[dict[int, NDArray[np.bool_]], dict[int, NDArray[np.bool_]]]:
    """By horizon, shape (N,): whether a state stays captured, and whether it counts."""
    t, k = places.T
    stays = {0: captured[t, k]}
    for h in HORIZONS:
        stays[h] = stays[h - 1] & captured[t, np.minimum(k + h, FRAMES - 1)]
    counts = {h: stays[0] & (k + h < FRAMES) for h in HORIZONS}
    return {h: stays[h] for h in HORIZONS}, counts


def _stored(
    dataset: Dataset, settings: Settings, folder: Path
) -> dict[str, dict[int, NDArray[np.float64]]]:
    """The paper's scores, the same for each horizon, and the ceiling."""
    found: dict[str, dict[int, NDArray[np.float64]]] = {}
    with ScoreStore(folder / f"{dataset.task}-scores.db") as store:
        labelled = _run_of(store, nodes=settings.nodes).labelled_scores()
    for name in PUBLISHED:
        found[name] = dict.fromkeys(HORIZONS, labelled.scores[name])
    with ScoreStore(folder / f"{dataset.task}-{CEILING}.db") as store:
        run = _run_of(store, continuations=settings.continuations)
        shares = run.labelled_scores().scores
    found[CEILING] = {h: shares[CAPTURED[h]] for h in HORIZONS}
    return found


def _run_of(store: ScoreStore, **settings: int) -> Any:
    """The run of a store with these settings."""
    for run in store.runs():
        if all(run.settings.get(name) == value for name, value in settings.items()):
            return run
    raise ValueError(f"{store.path} has no run with {settings}; remove it, and start again")


def _tree_steps(dataset: Dataset, settings: Settings, metric: str) -> float:
    """Mean steps of a state's tree, of some states."""
    from energymargin._core import capture_score, escape_effort

    numbers = np.linspace(0, dataset.size - 1, min(SAMPLED, dataset.size)).astype(int)
    total = 0.0
    for problem in dataset.problems(np.unique(numbers).tolist()):
        if metric == "capture":
            tree = capture_score(problem, nodes=settings.nodes, seed=settings.seed, warn=False).tree
        else:
            search: dict[str, Any] = {
                "nodes": settings.nodes,
                "seed": settings.seed,
                "search": "published",
            }
            tree = escape_effort(problem, "est", **search).tree
        total += float(tree.durations.sum()) / problem.scene.step
    return total / len(np.unique(numbers))


def learned(
    states: NDArray[np.float64],
    labels: NDArray[np.bool_],
    trajectory: NDArray[np.int64],
    counts: NDArray[np.bool_],
    seed: int,
) -> NDArray[np.float64]:
    """A plain classifier's probability of each state that counts, shape (N,); NaN for others.

    Gradient-boosted trees on the raw states, shape (N, n). Each fifth of the trajectories is
    foreseen by a classifier that learned from the others.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.model_selection import GroupKFold
    from threadpoolctl import threadpool_limits  # of scikit-learn

    found = np.full(len(labels), np.nan)
    chosen = np.flatnonzero(counts)
    groups = trajectory[chosen]
    folds = min(FOLDS, len(np.unique(groups)))
    if folds < 2:
        return found
    for train, test in GroupKFold(folds).split(chosen, groups=groups):
        known = labels[chosen[train]]
        if known.all() or not known.any():  # nothing to tell apart
            found[chosen[test]] = float(known[0])
            continue
        classifier = HistGradientBoostingClassifier(random_state=seed)
        with threadpool_limits(1):  # so few states: threads that wait for each other take longer
            classifier.fit(states[chosen[train]], known)
            found[chosen[test]] = classifier.predict_proba(states[chosen[test]])[:, 1]
    return found


SHOWN = ("capture", "effort/est", "hold", SCRIPT, LEARNED, "ceiling")


def figure_foresight(result: Foresight) -> Figure:
    """Above: AUC against the horizon. Below: what happened against the probability, in bins."""
    from matplotlib.figure import Figure

    columns = len(result.tasks)
    figure = Figure(figsize=(2.5 * columns + 0.6, 5.6), dpi=200, layout="constrained")
    axes = figure.subplots(2, columns, squeeze=False, sharey="row")
    for number, task in enumerate(result.tasks):
        _draw_auc(axes[0, number], task)
        _draw_reliability(axes[1, number], task)
    axes[0, 0].set_ylabel("AUC")
    axes[1, 0].set_ylabel("share that stayed captured")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=3, frameon=False, handlelength=3.2
    )
    return figure


def _draw_auc(ax: Axes, task: TaskForesight) -> None:
    from matplotlib.ticker import MaxNLocator

    from energymargin.plots.styles import PALETTE, light_grid

    for name, style in zip(SHOWN, PALETTE, strict=False):
        cells = {h: cell for h, cell in task.cells.get(name, {}).items() if cell}
        aucs = [cell.auc for cell in cells.values()]
        ax.plot(list(cells), aucs, **_look(style), linewidth=1.3, label=NAMES[name])
    ax.set_title(task.task)
    ax.set_xlim(min(HORIZONS) - 0.3, max(HORIZONS) + 0.3)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("horizon [frames]")
    light_grid(ax)


def _draw_reliability(ax: Axes, task: TaskForesight) -> None:
    from energymargin.plots.styles import CHANCE_COLOR, PALETTE, light_grid

    ax.plot([0, 1], [0, 1], color=CHANCE_COLOR, linewidth=0.8)
    for name, style in zip(SHOWN, PALETTE, strict=False):
        if name in NO_PROBABILITY or name not in task.scores:
            continue
        found = task.reliability(name, task.last)
        if found is None:
            continue
        ax.plot(found.predicted, found.happened, **_look(style), linewidth=1.0)
    ax.set_xlabel(f"probability, {task.last} frames")
    ax.set_aspect("equal")
    light_grid(ax)


def _look(style: LineStyle) -> dict[str, Any]:
    return {
        "color": style.color,
        "linestyle": style.dashes,
        "marker": style.marker,
        "markersize": 4,
    }
