"""Options of several commands: their help, and what their words mean."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from energymargin.cli.terminal import warn

if TYPE_CHECKING:
    from energymargin.datasets import Future
    from energymargin.executors import Dask, Executor
    from energymargin.model.beliefs.uncertainty import Sampling

PlanWord = Literal["script", "hold", "none"]
PICTURE_NODES = 100  # of the trees in the pictures of the tasks; the paper's

# The help of options that several commands have, by its heading in the commands' help.
SHARED: dict[str | None, dict[str, str]] = {
    None: {
        "scores": "A file of scores, from `energymargin score`.",
        "seed": "The same seed gives the same numbers, to the last bit.",
        "parameter": "A parameter of the task: NAME=VALUE.",
        "overwrite": "Replace the file if it exists.",
        "run": "Which run, if there are several; `energymargin export` lists them.",
        "last": "Frames of a trajectory whose success scores count: k-bar.",
        "draws": "Bootstrap resamples of each interval: with many states, fewer do.",
    },
    "Where it runs": {
        "threads": "Threads; all cores if not given. Scores do not depend on it.",
        "processes": "So many processes instead of threads: a crash loses a second of work.",
        "timeout": "Seconds after which it ends with what is done; exit code 124.",
        "scheduler": "The workers of a Dask cluster instead: its scheduler, tcp://HOST:PORT.",
    },
}


def chosen_executor(
    threads: int | None, processes: int | None = None, scheduler: str | None = None
) -> Executor:
    """Executor that these options choose, of which one may be given; threads if none is."""
    from energymargin.executors import Processes, Threads

    require_one(threads=threads, processes=processes, scheduler=scheduler)
    if scheduler is not None:
        return cluster(scheduler)
    return Threads(threads) if processes is None else Processes(processes)


def cluster(scheduler: str) -> Dask:
    """A Dask cluster; what its workers lack is printed."""
    from energymargin.executors import Dask

    return Dask(scheduler, notice=warn)


def require_one(**options: Any) -> None:
    """Raises ValueError if more than one of these options is given."""
    given = [name for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"--{given[0]} and --{given[1]} are given, expected one of them")


def chosen_future(
    frames: int | None, plan: PlanWord | None, **times: float | None
) -> Future | None:
    """The Future of these options; None without frames. Raises ValueError on what cannot be."""
    from energymargin.datasets import Future

    require_beside("frames", frames, plan=plan, **times)
    if frames is None:
        return None
    given: dict[str, Any] = {name: time for name, time in times.items() if time is not None}
    return Future(frames, None if plan == "none" else plan or "script", **given)


def chosen_sampling(belief: str | None, particles: int | None) -> Sampling | None:
    """The Sampling of these options; None without a belief. Raises ValueError on particles without
    one, and on what is no uncertainty."""
    from energymargin.model.beliefs.uncertainty import PARTICLES, Sampling, Uncertainty

    require_beside("belief", belief, particles=particles)
    if belief is None:
        return None
    text = belief if belief.lstrip().startswith("{") else Path(belief).read_text()
    return Sampling(Uncertainty.from_json(text), PARTICLES if particles is None else particles)


def require_beside(option: str, value: object, **others: object) -> None:
    """Raises ValueError if one of the other options is given without this one, its condition."""
    for name, other in others.items():
        if value is None and other is not None:
            raise ValueError(f"--{name} is {other}, expected --{option} beside it")


def parsed(parameters: list[str]) -> dict[str, Any]:
    """NAME=VALUE, where a value is JSON, or else a word. Raises ValueError on another text."""
    values = {}
    for text in parameters:
        name, equals, value = text.partition("=")
        if not (equals and name.isidentifier()):
            raise ValueError(f"--parameter is {text!r}, expected NAME=VALUE")
        try:
            values[name] = json.loads(value)
        except json.JSONDecodeError:
            values[name] = value
    return values
