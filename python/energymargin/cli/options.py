"""Options of several commands: their types, and what their words mean."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.terminal import say

if TYPE_CHECKING:
    from energymargin.beliefs.uncertainty import Sampling
    from energymargin.datasets import Future
    from energymargin.executors import Dask, Executor
    from energymargin.tasks.scripted import Following

WHERE = "Where it runs"
PICTURE_NODES = 100  # of the trees in the pictures of the tasks; the paper's

ScoresArgument = Annotated[
    Path, typer.Argument(help="A file of scores, from `energymargin score`.")
]
SeedOption = Annotated[
    int, typer.Option(help="The same seed gives the same numbers, to the last bit.")
]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        help="Threads; all cores if not given. Scores do not depend on it.", rich_help_panel=WHERE
    ),
]
ParameterOption = Annotated[
    list[str] | None,
    typer.Option("--parameter", "-p", help="A parameter of the task: NAME=VALUE."),
]
OverwriteOption = Annotated[
    bool, typer.Option("--overwrite", help="Replace the file if it exists.")
]
OverwriteFolderOption = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        help="Take a folder that has files of others too, and replace those of the same names.",
    ),
]
RunOption = Annotated[
    int | None,
    typer.Option(
        "--run", help="Which run, if there are several; `energymargin export` lists them."
    ),
]
LastOption = Annotated[
    int, typer.Option(help="Frames of a trajectory whose success scores count: k-bar.")
]
DrawsOption = Annotated[
    int, typer.Option(help="Of the bootstrap intervals: with many states, fewer are faster.")
]
BootstrapSeedOption = Annotated[int, typer.Option(help="Of the bootstrap intervals.")]
TimeoutOption = Annotated[
    float | None,
    typer.Option(
        help="Seconds after which it ends with what is done; exit code 124.", rich_help_panel=WHERE
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        help="The workers of a Dask cluster instead: its scheduler, tcp://HOST:PORT.",
        rich_help_panel=WHERE,
    ),
]

PLANS: dict[str, Following | None] = {"script": "script", "hold": "hold", "none": None}


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

    return Dask(scheduler, notice=lambda text: say(f"[yellow]{escape(text)}[/]"))


def require_one(**options: Any) -> None:
    """Raises ValueError if more than one of these options is given."""
    given = [name for name, value in options.items() if value is not None]
    if len(given) > 1:
        raise ValueError(f"--{given[0]} and --{given[1]} are given, expected one of them")


def chosen_future(
    horizon: int | None,
    plan: str | None,
    check: float | None = None,
    dwell: float | None = None,
) -> Future | None:
    """The Future of these options; None without a horizon. Raises ValueError on an unknown plan, on
    a number that is out of range, and on options that need a horizon without one."""
    from energymargin.checks import not_negative_number, positive_number, whole_number
    from energymargin.datasets import Future

    if plan is not None and plan not in PLANS:
        raise ValueError(f"--plan is {plan!r}, expected script, hold or none")
    if horizon is None:
        _refuse_without_horizon(plan, check=check, dwell=dwell)
        return None
    return Future(
        whole_number("--horizon", horizon, 1),
        PLANS[plan or "script"],
        None if check is None else positive_number("--check", check),
        0.0 if dwell is None else not_negative_number("--dwell", dwell),
    )


def chosen_sampling(belief: str | None, particles: int | None) -> Sampling | None:
    """The Sampling of these options; None without a belief. Raises ValueError on particles without
    one, and on what is no uncertainty."""
    from energymargin.beliefs.uncertainty import PARTICLES, Sampling, Uncertainty

    if belief is None:
        if particles is not None:
            raise ValueError(f"--particles is {particles}, expected --belief beside it")
        return None
    text = belief if belief.lstrip().startswith("{") else Path(belief).read_text()
    return Sampling(Uncertainty.from_json(text), PARTICLES if particles is None else particles)


def _refuse_without_horizon(plan: str | None, **times: float | None) -> None:
    if plan is not None:
        raise ValueError(
            f"--plan is {plan}, but there is no horizon over which it would be followed: "
            "add --horizon FRAMES, or leave --plan out"
        )
    for name, value in times.items():
        if value is not None:
            raise ValueError(
                f"--{name} is {value:g}, but a state as it is has no time at which to look: "
                f"add --horizon FRAMES, or leave --{name} out"
            )


def refuse_probability_settings(given: dict[str, Any]) -> None:
    """Raises ValueError on a setting of probabilities: without a horizon nothing asks for one."""
    for name in ("rollouts", "strength", "objects", "common_random_numbers"):
        if given[name] is not None:
            what = f"--{name} is {given[name]}"
            if name == "common_random_numbers":
                what = "--common is given"
            raise ValueError(f"{what}, but no probability is asked for: add --horizon FRAMES")


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
