"""How well can a score of the state predict at all? The ceiling of a dataset's AUC and AP.

What becomes of a state also depends on noise that comes after it. The ceiling is the score of one
who knows the robot's script: from each recorded state the script goes on many times, with fresh
noise, and the share of the continuations that stay captured, or succeed, is the score. No score of
the state ranks better, but for chance: that of the labels, and that of finitely many continuations.
With several objects there is a share for all of them, and one for at least one.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Cancel, World, stream
from energymargin.base.checks import whole_number
from energymargin.base.limits import Limit
from energymargin.base.metrics import ANY
from energymargin.datasets import Dataset
from energymargin.evaluate.executors.rows import Row
from energymargin.evaluate.store.schema import state_digest
from energymargin.evaluation import Evaluation, LabelledScores, evaluate
from energymargin.executors import ask
from energymargin.records.evaluation.labelled import HORIZONS, SUCCESS
from energymargin.store import Run, ScoreStore
from energymargin.tasks.scripted import ScriptedTask
from energymargin.tasks.trajectories import Trajectory

__all__ = [
    "CEILING",
    "ceiling_dataset",
    "ceiling_run",
    "evaluate_ceiling",
    "scripted",
    "state_ceiling",
]

CEILING = "ceiling"
CONTINUATIONS = 100
CAPTURED = {horizon: f"captured/{horizon}" for horizon in HORIZONS}


def ceiling_dataset(
    dataset: Dataset,
    path: str | os.PathLike[str],
    continuations: int = CONTINUATIONS,
    seed: int = 0,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> bool:
    """The shares of every state of a dataset, kept in the file at `path` as soon as they are there.

    The file is a store: "captured/h" for each horizon h, and "success". Returns whether all
    are there: False if `timeout` [s] was over, or `cancel` was set, before. Then, or on
    KeyboardInterrupt, or any other error, all that was finished is in it, and the same call goes on
    to the same bits, on any number of threads. Raises ValueError on a task without a script, or
    numbers out of range. `progress(done, total)` counts all states of the dataset.
    """
    limit = Limit(timeout, cancel)
    task = scripted(dataset)
    frames = dataset.frames()
    advance = progress or (lambda _done, _total: None)

    def row(index: int, stop: Cancel) -> Row:
        start = time.perf_counter()
        t, k = frames[index]
        shares = state_ceiling(
            task, dataset.trajectories[t], k, continuations, stream(seed, index), cancel=stop
        )
        return Row(index, shares, {next(iter(shares)): time.perf_counter() - start})

    def of_states(numbers: Sequence[int], stop: Cancel) -> list[Row]:
        return [row(index, stop) for index in numbers]

    with ScoreStore(path, create=True) as store:
        run = ceiling_run(store, dataset, continuations, seed)
        advance(*run.counts())

        def keep(answers: Sequence[tuple[int, Row]]) -> None:
            run.pose({number: state_digest(run.digest, number) for number, _ in answers})
            run.add_rows([row for _, row in answers])
            advance(*run.counts())

        ask([run.missing()], of_states, keep, most=1, threads=threads, **limit.rest())
        scored, total = run.counts()
    return scored == total


def ceiling_run(store: ScoreStore, dataset: Dataset, continuations: int, seed: int) -> Run:
    """The run of these settings; ValueError if they cannot be."""
    shares, first = [*CAPTURED.values(), SUCCESS], dataset.trajectories[0]
    if first.captured_any is not None:
        shares += [name + ANY for name in CAPTURED.values()]
    if first.success_any is not None:
        shares.append(SUCCESS + ANY)
    settings = {
        "continuations": whole_number("continuations", continuations, 1),
        "seed": whole_number("seed", seed, 0, 2**64 - 1),
    }
    questions = dict.fromkeys(shares, settings)
    run = store.begin(dataset, settings, questions, known_by=" by place")
    return run


def state_ceiling(
    task: ScriptedTask,
    trajectory: Trajectory,
    frame: int,
    continuations: int = CONTINUATIONS,
    seed: int = 0,
    *,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> dict[str, float]:
    """Shares of the continuations of one recorded state that stay captured, and that succeed.

    "captured/h": over the next h frames, or to the last frame if it comes first; so for h = 0 it is
    the label itself. "success": at the end; for the last frame, the label itself. If there are
    labels of at least one object, their shares have the same names with "/any" at the end. Raises
    TimeoutError after `timeout` [s], and Cancelled once `cancel` is set: there are no half shares.
    """
    limit = Limit(timeout, cancel)
    state, params = trajectory.states[frame], trajectory.params
    now, *later = trajectory.times[frame:].tolist()
    scene = task.scene(params)
    world = World(scene)
    several = not (trajectory.captured_any is None and trajectory.success_any is None)
    of_all, of_any = [], []  # labels of each continuation: captured, and succeeded
    for number in range(continuations if later else 0):
        limit.require("the shares were done")
        states = task.resume(
            state, now, params, stream(seed, number), later, world=world, **limit.rest()
        )
        of_all.append(task.labels(states, params, scene=scene))
        if several:
            of_any.append(task.labels_any(states, params, scene=scene))
    shares = _captured_shares(trajectory.captured, frame, [labels[0] for labels in of_all])
    shares[SUCCESS] = _success_share(trajectory.success, [labels[1] for labels in of_all])
    if trajectory.captured_any is not None:
        some = _captured_shares(trajectory.captured_any, frame, [labels[0] for labels in of_any])
        shares |= {name + ANY: share for name, share in some.items()}
    if trajectory.success_any is not None:
        later_any = [labels[1] for labels in of_any]
        shares[SUCCESS + ANY] = _success_share(trajectory.success_any, later_any)
    return shares


def _captured_shares(
    labels: NDArray[np.bool_], frame: int, later: Sequence[NDArray[np.bool_] | None]
) -> dict[str, float]:
    """By horizon, from the labels of the trajectory and those of each continuation."""
    continued = np.array([[labels[frame], *own] for own in later if own is not None])
    rows = continued if len(later) else labels[frame : frame + 1, None]
    stayed = np.logical_and.accumulate(rows, axis=1).mean(axis=0)
    return {name: float(stayed[min(h, len(stayed) - 1)]) for h, name in CAPTURED.items()}


def _success_share(label: bool, later: Sequence[NDArray[np.bool_] | None]) -> float:
    """From the label of the trajectory and those of each continuation."""
    return float(np.mean([own[-1] for own in later if own is not None] if later else [label]))


def evaluate_ceiling(labelled: LabelledScores, seed: int = 0) -> Evaluation:
    """AUC and AP of the shares in a file of `ceiling_dataset`, each against its own label.

    The row of states is called "ceiling", that of at least one object "ceiling/any".
    """

    def alone(share: str, horizon: int) -> Evaluation:
        one = replace(labelled, scores={share: labelled.scores[share]})
        return evaluate(one, frames=[horizon], seed=seed)

    states = {
        CEILING + which: {h: alone(n + which, h).states[n + which][h] for h, n in CAPTURED.items()}
        for which in ("", ANY)
        if CAPTURED[0] + which in labelled.scores
    }
    last = alone(SUCCESS, 0)
    if SUCCESS + ANY in labelled.scores:
        last = replace(last, success_any=alone(SUCCESS + ANY, 0).success_any)
    return replace(last, frames=tuple(CAPTURED), states=states)


def scripted(dataset: Dataset) -> ScriptedTask:
    """The task of a dataset, whose robot follows a script; ValueError if there is none."""
    task = tasks.make(dataset.task, **dataset.parameters)
    if isinstance(task, ScriptedTask):
        return task
    raise ValueError(f"task {dataset.task!r} has no script that could go on from a state")
