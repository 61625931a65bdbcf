"""The command `energymargin import`: from recordings of a camera or a robot to a dataset.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from rich.markup import escape

import energymargin as em
from energymargin.cli.generate import say_written
from energymargin.cli.options import Output, Parameters, panel, parsed, require_one
from energymargin.cli.terminal import require_free, say, warn


@panel("Bags of ROS 2", "*")
@dataclass(frozen=True)
class Topics:
    """The topics of a bag."""

    object: Annotated[str | None, Parameter(name="--object-topic")] = None
    """The topic of the object's poses in a bag, as /box/pose, or with a frame, as /tf:box."""
    effector: Annotated[str | None, Parameter(name="--effector-topic")] = None
    """The topic of the poses of the effector, the robot's tool."""
    bodies: Annotated[list[str] | None, Parameter(name="--topic")] = None
    """The topic of the poses in space of a body of the scene: BODY=/cup/pose."""

    def given(self) -> dict[str, Any]:
        """Arguments of `read_bag`. Raises ValueError on another form of --topic."""
        pairs = {text: text.partition("=") for text in self.bodies or ()}
        for text, (body, equals, _) in pairs.items():
            if not (body and equals):
                raise ValueError(f"--topic is {text!r}, expected BODY=TOPIC, as cup=/cup/pose")
        named = {body: topic for body, _, topic in pairs.values()}
        of_plane = {"object": self.object, "effector": self.effector}
        return of_plane | ({"bodies": named} if named else {})


@panel("How frames are put right", "*")
@dataclass(frozen=True)
class RepairOptions:
    """Arguments of all readers."""

    repair: Annotated[bool, Parameter(negative="--no-repair")] = True
    """Fill short gaps and replace outliers, or refuse them."""
    longest_gap: float = 0.1
    """The longest gap that is filled, in a body's poses or in frames [s]."""
    smoothing: float = 0.06
    """Time scale of the smoothing where the files have no velocities [s]."""
    causal: bool = False
    """Smooth each frame with frames up to it alone, as a robot has them: scores foresee without
    frames to come."""


def importing(
    files: list[Path] | None = None,
    /,
    *,
    task: str | None = None,
    problem: Path | None = None,
    labels: Path | None = None,
    output: Output = None,
    parameter: Parameters = None,
    columns: Path | None = None,
    captured: Path | None = None,
    most_overlap: float = 0.01,
    overwrite: bool = False,
    topics: Topics = Topics(),
    rules: RepairOptions = RepairOptions(),
) -> None:
    """Read recordings of a camera and make them a dataset of a task, to be scored frame by frame.

    Example: `energymargin import a.csv b.csv --task push -p friction=0.3 --labels labels.csv`

    A scene of your own: `energymargin import a.csv --problem P.json`

    A LeRobot dataset: `energymargin import pusht --problem P.json --columns columns.json`

    Bags: `energymargin import a.mcap --object-topic /box/pose --effector-topic /tf:tool0 ...`

    Args:
        files: The recordings: CSV files, a row a frame, bags of ROS, or folders of LeRobot datasets
            (version 3), whose episodes are a recording each.
        task: The task whose scene and capture set these recordings have.
        problem: Instead of a task, a problem file of your own, from problem.save: its scene,
            capture set and bounds. Its bodies with the roles object and effector were recorded.
        labels: CSV file recording,success: a row for each recording's file name. If not given, an
            episode succeeded whose next.success was ever true, and another recording whose last
            state lies in the success set.
        output: The dataset; TASK-recorded.h5 or P-recorded.h5 if not given.
        parameter: A parameter of the task: NAME=VALUE; may be repeated.
        columns: JSON file that says which column is what, and in which units.
        captured: CSV file recording,frame,captured; if not given, labels are those of the capture
            set.
        most_overlap: How far a body may be moved out of another one [m].
        overwrite: Replace the file if it exists.
    """
    require_one(task=task, problem=problem)
    if not files or (task is None and problem is None):
        way = "energymargin import --help has examples"
        raise ValueError(f"expected recordings with --task or --problem: {way}")
    output = output or Path(f"{task or (problem or Path()).stem}-recorded.h5")
    if problem is None:
        made: Any = em.tasks.make(task or "", **parsed(parameter))
    elif parameter:
        raise ValueError("--problem has no parameters, expected no -p: its file has all of them")
    else:
        made = em.tasks.make("problem", file=str(problem.resolve()))
    require_free(output, overwrite=overwrite)
    layout, read = em.recordings.Columns.of(columns), []
    for path in files:
        found = _read(path, layout, topics, vars(rules))
        frames = sum(len(one) for one in found)
        seconds = sum(one.times[-1] - one.times[0] for one in found)
        text = f"{frames} frames, {seconds:.3g} s; {found[0].repairs}"
        if len(found) > 1:
            repaired = sum(one.repairs != em.recordings.Repairs() for one in found)
            text = f"{len(found)} episodes, {frames} frames, {seconds:.3g} s; repaired {repaired}"
        say(f"{escape(str(path))}: {text}")
        read += found
    motions = [motion for recording in read for motion in recording.bodies.values()]
    if not rules.causal and any(motion.velocity_covariances is not None for motion in motions):
        text = "Velocities are smoothed over frames before and after"
        say(f"{text}; with --causal over those before, as a robot would know them")
    roles: dict[str, Any] = {}
    if problem is not None:
        known = {body for recording in read for body in recording.bodies}
        roles = {role: made.body(role) for role in ("object", "effector") if role in known}
    told = _successes(files) if labels is None else em.recordings.read_labels(labels)
    of_frames = None if captured is None else em.recordings.read_frame_labels(captured)
    asked: dict[str, Any] = {"captured": of_frames, "most_overlap": most_overlap, **roles}
    asked["notice"] = lambda text: say(escape(text))
    dataset = em.recordings.dataset(made, read, told, **asked)
    dataset.save(output)
    _, reasons = dataset.possible_problems()
    if reasons:
        warn(em.datasets.left_out_text(reasons, dataset.size))
    judged = " by their last states" if told is None else " by next.success"
    say_written(dataset, output, "" if labels is not None else judged)


def _successes(files: Sequence[Path]) -> dict[str, bool] | None:
    """Which episodes succeeded, as LeRobot datasets say; None if none of the files does."""
    every = {path: _told(path) for path in files}
    told = {path: own for path, own in every.items() if own is not None}
    silent = [path for path in files if path not in told]
    if told and silent:
        text = f"{next(iter(told))} has next.success and {silent[0]} does not"
        raise ValueError(f"{text}: import them apart, or say with --labels which succeeded")
    return {name: own[name] for own in told.values() for name in own} if told else None


def _told(path: Path) -> dict[str, bool] | None:
    lerobot = em.recordings.kind_of(path) == "lerobot"
    return em.recordings.read_successes(path) if lerobot else None


def _read(
    path: Path, layout: em.recordings.Columns, topics: Topics, rules: dict[str, Any]
) -> list[em.recordings.Recording]:
    """The recordings of a file; `topics` are those of a bag, `rules` those of all readers."""
    kind = em.recordings.kind_of(path)
    if kind == "lerobot":
        return em.recordings.read_lerobot(path, layout, **rules)
    if kind == "csv":
        return [em.recordings.read_csv(path, layout, **rules)]
    if layout.columns or layout.units:
        raise ValueError(f"--columns has columns or units, expected the origin alone for {path}")
    if topics.bodies is None and None in (topics.object, topics.effector):
        found = em.recordings.bag_topics(path).items()
        known = ", ".join(f"{name} ({kind})" for name, kind in found)
        text = f"{path}: expected --object-topic and --effector-topic for a bag"
        raise ValueError(f"{text}; its topics are {known or 'none'}")
    return [em.recordings.read_bag(path, origin=layout.origin, **topics.given(), **rules)]
