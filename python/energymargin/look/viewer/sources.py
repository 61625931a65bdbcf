"""What can be looked at: a problem, a margin along a plan, or trajectories of a dataset or a task;
and the scores of one state with their trees."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import energymargin as em
from energymargin import MarginProfile, Problem, datasets
from energymargin.base.aliases import AnyPath, Floats, Mask
from energymargin.base.bars import Update
from energymargin.base.checks import check_type
from energymargin.base.metrics import is_likelihood
from energymargin.base.reprs import Record
from energymargin.datasets import Dataset, Future
from energymargin.look.plots.scenes import lost_objects
from energymargin.look.plots.trees import most_cost

PROBLEM, DATASET = ".json", ".h5"
Viewable = Problem | Dataset | MarginProfile | AnyPath
EFFORT = "effort"
# Share of a trajectory's frames before its loss. In the frames just before it the object leaves by
# itself, and long before it all is well: here the tasks have capture scores of 0.2 to 0.6.
BEFORE = 0.25
Columns = list[tuple[str, dict[str, float]]]
"""Titles, and scores of one state by metric."""
MOST = 100  # trajectories that are searched for a loss
LOW = 0.1  # quantile of the particles of a belief that is shown beside their mean


@dataclass(frozen=True, eq=False, repr=False)
class Frames(Record):
    """The frames of one trajectory."""

    times: Floats
    """Time of each [s], shape (K,)."""
    states: Floats
    """Shape (K, n)."""
    problem: Callable[[int], Problem]
    """The problem of a frame; raises ValueError if its state makes none."""
    numbers: Sequence[int] | None = None
    """Number of each frame's search, as of `metric_search`: with it the scores are those that
    `energymargin score` gives the dataset or, with None, `capture_score` the problem."""
    first: int = 0
    """The first frame's number among all states of a dataset."""
    captured: Mask | None = None
    """Whether each state lies in its capture set, shape (K,); None if it is not known."""
    success: bool | None = None
    captured_any: Mask | None = None
    """Whether at least one of several objects is captured, shape (K,)."""
    disturbance: Any = None
    """Disturbance of their probabilities; None: that of the settings."""


@dataclass(frozen=True, eq=False, repr=False)
class StateSource(Record):
    """What is looked at: a problem is one trajectory of one frame, a margin along a plan one with a
    frame for each moment of the nominal motion."""

    what: Problem | MarginProfile | Dataset
    title: str
    """What it is, in a few words."""
    opened: bool = False
    """Whether the dataset's file was opened for this alone."""
    future: Future | None = None
    """What is asked of the future of a dataset's states; None: they are asked about as they are."""

    @property
    def trajectories(self) -> int:
        """How many there are."""
        return len(self.what.trajectories) if isinstance(self.what, Dataset) else 1

    def frames(self, trajectory: int) -> Frames:
        """The frames of one of them; raises ValueError unless 0 <= trajectory < trajectories."""
        what = self.what
        if not 0 <= trajectory < self.trajectories:
            raise ValueError(f"trajectory is {trajectory}, expected 0 to {self.trajectories - 1}")
        if isinstance(what, Problem):
            return Frames(np.zeros(1), np.asarray(what.state)[None], lambda _: what)
        if isinstance(what, MarginProfile):
            asked: dict[str, Any] = {"captured": what.captured, "disturbance": what.disturbance}
            asked |= {"problem": what.problems.__getitem__, "numbers": [0] * len(what.times)}
            return Frames(what.times, what.states, **asked)
        recorded, first = what.trajectories[trajectory], int(what.lengths[:trajectory].sum())
        return Frames(
            recorded.times,
            recorded.states,
            lambda frame: what.problems([first + frame], future=self.future)[0],
            range(first, first + len(recorded.times)),
            first,
            recorded.captured,
            recorded.success,
            recorded.captured_any,
        )

    def close(self) -> None:
        """Lets go of the file that was opened for it, if there is one."""
        if self.opened and isinstance(self.what, Dataset):
            self.what.close()


def source_of(
    what: Viewable,
    parameters: Mapping[str, Any] | None = None,
    *,
    seed: int = 0,
    progress: Update | None = None,
) -> StateSource:
    """A problem, a dataset, the file of one, a margin along a plan, or a task's name.

    Of a task six trajectories of 30 frames are generated, with this seed. Raises
    ValueError on anything else, and OSError on a file that cannot be read.
    """
    if isinstance(what, MarginProfile):
        return StateSource(what, "along a plan")
    if isinstance(what, Problem):
        return StateSource(what, "a problem")
    if isinstance(what, Dataset):
        return StateSource(what, what.task)
    expected = "a Problem, a Dataset, the file of one, a MarginProfile, or the name of a task"
    check_type("what", what, (str, os.PathLike), expected)
    path = Path(what)
    if parameters and path.suffix in (PROBLEM, DATASET):
        raise ValueError(f"parameters are given with {path}, expected a task's name with them")
    if path.suffix == PROBLEM:
        return StateSource(Problem.load(path), path.name)
    if path.suffix == DATASET:
        return StateSource(datasets.open(path), path.name, opened=True)
    if str(what) not in em.tasks.names():
        text = f"{str(what)!r} is neither a problem file ({PROBLEM}), nor a dataset ({DATASET})"
        raise ValueError(f"{text}, nor a task: {', '.join(em.tasks.names())}")
    task = em.tasks.make(str(what), **(parameters or {}))
    size: dict[str, Any] = {"trajectories": 6, "frames": 30, "seed": seed}
    made = datasets.generate(task, progress=progress, **size)
    return StateSource(made, f"{task.name}, seed {seed}")


def first_frame(source: StateSource, trajectory: int | None, frame: int | None) -> tuple[int, int]:
    """The trajectory and its frame, where they are not given.

    The trajectory is the first one that ends outside of its capture set, or else the first. The
    frame is a quarter of all before its last loss or, without one, in its middle; of a margin along
    a plan it is the weakest moment. It is the first frame if the state of that one makes no
    problem. A frame that is given without a trajectory is the first one's.
    """
    if frame is not None:
        return trajectory or 0, frame
    if trajectory is None:
        labels = (source.frames(t).captured for t in range(min(source.trajectories, MOST)))
        lost = (t for t, own in enumerate(labels) if own is not None and own[0] and not own[-1])
        trajectory = next(lost, 0)
    if isinstance(source.what, MarginProfile):
        return trajectory, source.what.weakest.number
    return trajectory, _frame_of(source.frames(trajectory))


def _frame_of(frames: Frames) -> int:
    count, captured = len(frames.times), frames.captured
    lost = [] if captured is None else np.flatnonzero(captured[:-1] & ~captured[1:]).tolist()
    frame = max(0, lost[-1] + 1 - max(1, round(BEFORE * count))) if lost else count // 2
    try:
        frames.problem(frame)
    except ValueError:
        return 0
    return frame


@dataclass(frozen=True, eq=False, repr=False)
class FrameScores(Record):
    """Scores of all states that were computed before."""

    columns: list[tuple[str, dict[str, Floats]]]
    """Titles, and the scores of each state by metric; NaN is one that is missing."""
    search: dict[str, Any]
    """Settings with which a search gives the same scores."""
    future: Future | None = None
    """Horizon and plan of each state; None: the scores have no clock."""
    dataset: Dataset | None = None
    """Whose they are, in the engine that they are of."""

    def at(self, number: int) -> Columns:
        """The titles, and the scores of the state of that number by metric."""
        titles, scores = zip(*self.columns, strict=True)
        of_state = [{m: float(values[number]) for m, values in own.items()} for own in scores]
        return list(zip(titles, of_state, strict=True))


def profile_scores(profile: MarginProfile) -> FrameScores:
    """The scores of a margin along a plan, at each of its moments."""
    scores = {"probability": profile.probabilities, EFFORT: profile.efforts}
    search = {name: getattr(profile, name) for name in ("nodes", "seed", "rollouts")}
    search["common_random_numbers"] = True
    return FrameScores([("along the plan", scores)], search)


def stored_scores(
    path: AnyPath, dataset: Dataset, run: int | None = None, name: str = "DATASET"
) -> FrameScores:
    """The scores of a dataset's states in a file. `name` is the dataset's, in errors.

    Of a belief there is also what one particle in ten is below. Raises ValueError if the file holds
    no scores, if they are another dataset's, or if there are several runs and none is chosen;
    OSError if it cannot be read.
    """
    with em.store.ScoreStore(path) as store:
        chosen = store.run(run)
        dataset = chosen.scored(dataset, name, str(path))
        names = [own.name for own in fields(em.searches.SearchSettings)]
        search = {name: chosen.settings[name] for name in names if name in chosen.settings}
        parts = [str(chosen.settings.get("source", "stored"))]
        parts += [f"{search['nodes']:,} nodes"] if "nodes" in search else []
        parts += [] if chosen.future is None else [str(chosen.future)]
        if chosen.sampling is not None:
            parts.append(f"mean of {chosen.sampling.particles} particles")
        columns = [(", ".join(parts), chosen.labelled_scores().scores)]
        if chosen.with_quantiles:
            low = {m: chosen.quantiles(m, [LOW])[:, 0] for m in chosen.with_quantiles}
            columns.append((f"{LOW:g} quantile", low))
        return FrameScores(columns, search, chosen.future, dataset)


MOMENTS = 25  # a second of a replay, about what the eye sees

ShareProgress = Callable[[float], None]  # of the share that is done


@dataclass(frozen=True)
class Scored:
    """The scores of a state, with their trees."""

    problem: em.Problem
    escape: em.EscapeEffort
    capture: em.CaptureScore | None = None
    """None of a problem with a horizon: that score has no clock."""
    force: em.ForceScore | None = None
    """None if there is no effector, and so no baseline; and of a problem with a horizon."""
    probability: em.CaptureProbability | None = None
    """None of a problem without a horizon."""
    disturbance: Any = None
    """Disturbance of the probability; of no meaning without one."""

    @property
    def tree(self) -> em.Tree:
        """The tree that is drawn: of the capture score or, with a horizon, of the escape."""
        return self.escape.tree if self.capture is None else self.capture.tree

    @property
    def nodes(self) -> int:
        """Nodes of that tree, without the root."""
        return len(self.tree) - 1

    @property
    def values(self) -> dict[str, float]:
        """By metric the likelihoods or, with a horizon, the probabilities, each from 0 to 1."""
        found = self.capture or self.probability
        if found is None:
            return {}
        there = filter(is_likelihood, em.searches.metrics_of([self.problem]))
        return {name: em.searches.value_of(name, found) for name in there}

    @cached_property
    def lost(self) -> Mask:
        """Which object is out of its capture set in which node, shape (M + 1, k)."""
        return lost_objects(self.problem, self.tree.states)

    @cached_property
    def way_out(self) -> ReplayedWay | None:
        """The rollouts of the cheapest escape; None if none was found."""
        if len(self.escape.path) == 0:
            return None
        return replay(self.problem, self.escape.tree, self.escape.path.tolist())

    @cached_property
    def most(self) -> float:
        """Where the colours of the costs end [J]: at the costliest captured node, or at the effort
        of the way out."""
        return most_cost(self.problem, self.tree, self.escape.effort)


def score_state(
    problem: em.Problem,
    settings: em.searches.SearchSettings,
    number: int | None = None,
    progress: ShareProgress | None = None,
    *,
    disturbance: Any = None,
) -> Scored:
    """All scores of a state; with a horizon, a probability instead of the scores without a clock.

    `number` and `disturbance` are as of `metric_search`. progress(share) has the share that is
    done.
    """

    def search(metric: str, begin: float, most: int, **others: Any) -> Any:
        if progress is not None:
            others["progress"] = lambda done: progress(begin + 0.5 * done / most)
        return em.searches.metric_search(problem, metric, settings, number, warn=False, **others)

    disturbance = disturbance or settings.disturbance
    capture = force = probability = None
    if problem.horizon is None:
        capture = search("capture", 0.0, settings.nodes)
        if any(body.role == "effector" for body in problem.scene.bodies):
            force = em.searches.metric_search(problem, "force", settings)
    else:
        asked: dict[str, Any] = {"disturbance": disturbance}
        asked["success"] = problem.succeeded is not None
        asked["by_object"] = problem.captured_any is not None
        probability = search("probability", 0.0, settings.rollouts, **asked)
    escape = search("effort", 0.5, settings.nodes)
    return Scored(problem, escape, capture, force, probability, disturbance)


class ReplayedWay(NamedTuple):
    """K moments from the root of a tree to one of its nodes."""

    times: Floats
    """Since the root [s], shape (K,)."""
    states: Floats
    """Shape (K, n)."""
    costs: Floats
    """Effort since the root [J], shape (K,)."""


def replay(problem: em.Problem, tree: em.Tree, path: Sequence[int]) -> ReplayedWay:
    """Rolls out again the edges of a path, as `tree.path_to` gives it: its ends are the tree's own
    states, to the last bit. With a plan the robot follows it from each node's time on.

    A path of one node is that node alone. Raises ValueError on an empty path.
    """
    if len(path) == 0:
        raise ValueError("path is empty, expected rows of the tree from its root on")
    world, since_root = em.World(problem.scene, problem.plan), tree.times
    stride = max(1, round(1.0 / (MOMENTS * problem.scene.step)))
    times, states, costs = [0.0], [tree.states[path[0]]], [float(tree.costs[path[0]])]
    for before, node in pairwise(path):
        start, wrench = problem.edge_start(tree.states[before]), tree.controls[node]
        wrench = wrench if len(wrench) == 6 else wrench.reshape(-1, 6)  # of several objects
        begin, base = times[-1], float(tree.costs[before])
        steps = round(float(tree.durations[node]) / problem.scene.step)
        for step in [*range(stride, steps, stride), steps]:
            lasts = step * problem.scene.step
            moment = world.rollout(start, wrench, lasts, time=float(since_root[before]))
            times.append(begin + lasts)
            states.append(moment.state)
            costs.append(base + moment.effort)
    return ReplayedWay(np.array(times), np.array(states), np.array(costs))
