"""The command `energymargin import`: from recordings of a camera or a robot to a dataset.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from energymargin.cli.options import OverwriteOption, ParameterOption, parsed, require_one
from energymargin.cli.places import require_free
from energymargin.cli.terminal import say

if TYPE_CHECKING:
    from energymargin.datasets import Dataset
    from energymargin.recordings import Columns, Recording
    from energymargin.tasks import Task

BAGS = "Bags of ROS 2"
REPAIRS = "How frames are put right"

FilesArgument = Annotated[
    list[Path] | None,
    typer.Argument(help="The recordings: CSV files, a row a frame, or bags of ROS."),
]
ObjectTopicOption = Annotated[
    str | None,
    typer.Option(
        help="Of bags, the topic of the object's poses, as /box/pose, or with a frame, as /tf:box.",
        metavar="TOPIC",
        rich_help_panel=BAGS,
    ),
]
EffectorTopicOption = Annotated[
    str | None,
    typer.Option(
        help="The same of the effector, the robot's tool.", metavar="TOPIC", rich_help_panel=BAGS
    ),
]
TaskOption = Annotated[
    str | None, typer.Option(help="Whose scene and capture set these recordings have.")
]
ProblemOption = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a task, a problem file of your own, from problem.save: its scene, capture "
        "set and bounds. Its bodies with the roles object and effector were recorded.",
        metavar="P.json",
    ),
]
LabelsOption = Annotated[
    Path | None,
    typer.Option(
        help="CSV file recording,success: a row for each recording's file name. If not given, one "
        "succeeded whose last state lies in the success set."
    ),
]
OutputOption = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="The dataset; TASK-recorded.h5 or P-recorded.h5 if not given.",
    ),
]
ColumnsOption = Annotated[
    Path | None,
    typer.Option(help="JSON file that says which column is what, and in which units."),
]
CapturedOption = Annotated[
    Path | None,
    typer.Option(
        help="CSV file recording,frame,captured; if not given, labels are those of the capture set."
    ),
]
RepairOption = Annotated[
    bool,
    typer.Option(
        "--repair/--no-repair",
        help="Fill short gaps and replace outliers, or refuse them.",
        rich_help_panel=REPAIRS,
    ),
]
LongestGapOption = Annotated[
    float,
    typer.Option(
        help="The longest gap that is filled, in a body's poses or in frames [s].",
        rich_help_panel=REPAIRS,
    ),
]
SmoothingOption = Annotated[
    float,
    typer.Option(
        help="Time scale of the smoothing where the files have no velocities [s].",
        rich_help_panel=REPAIRS,
    ),
]
CausalOption = Annotated[
    bool,
    typer.Option(
        "--causal",
        help="Smooth each frame with frames up to it alone, as a robot has them: scores foresee "
        "without frames to come.",
        rich_help_panel=REPAIRS,
    ),
]
MostOverlapOption = Annotated[
    float,
    typer.Option(
        help="How far a body may be moved out of another one [m].", rich_help_panel=REPAIRS
    ),
]


def import_recordings(
    *,
    files: FilesArgument = None,
    task: TaskOption = None,
    problem: ProblemOption = None,
    labels: LabelsOption = None,
    output: OutputOption = None,
    parameter: ParameterOption = None,
    columns: ColumnsOption = None,
    object_topic: ObjectTopicOption = None,
    effector_topic: EffectorTopicOption = None,
    captured: CapturedOption = None,
    repair: RepairOption = True,
    longest_gap: LongestGapOption = 0.1,
    smoothing: SmoothingOption = 0.06,
    causal: CausalOption = False,
    most_overlap: MostOverlapOption = 0.01,
    overwrite: OverwriteOption = False,
) -> None:
    """Read recordings of a camera and make them a dataset of a task, to be scored frame by frame.

    Example: `energymargin import a.csv b.csv --task push -p friction=0.3 --labels labels.csv`

    A scene of your own: `energymargin import a.csv --problem P.json`

    Bags: `energymargin import a.mcap --object-topic /box/pose --effector-topic /tf:tool0 ...`
    """
    require_one(task=task, problem=problem)
    if not files or (task is None and problem is None):
        raise ValueError(
            "expected recordings with --task or --problem: energymargin import --help has examples"
        )
    from energymargin import recordings

    output = output or Path(f"{task or (problem or Path()).stem}-recorded.h5")
    made, bodies = _task_of(task, problem, parsed(parameter or []))
    require_free(output, overwrite=overwrite)
    rules = {"repair": repair, "longest_gap": longest_gap, "smoothing": smoothing}
    read = _read(files, columns, (object_topic, effector_topic), {**rules, "causal": causal})
    if not causal and any(_is_smooth(recording) for recording in read):
        say(
            "Velocities are smoothed over frames before and after; with --causal over those "
            "before, as a robot would know them"
        )
    dataset = recordings.dataset(
        made,
        read,
        None if labels is None else recordings.read_labels(labels),
        captured=None if captured is None else recordings.read_frame_labels(captured),
        most_overlap=most_overlap,
        notice=lambda text: say(escape(text)),
        object=bodies[0],
        effector=bodies[1],
    )
    dataset.save(output)
    _say_left_out(dataset)
    written = escape(str(output))
    successes = f"{dataset.successes.sum()} successful"
    if labels is None:
        successes += " by their last states"
    say(
        f"Wrote {len(read)} trajectories ({successes}), {dataset.size} states to {written}. "
        f"Next: [bold]energymargin score {written}[/]"
    )


def _task_of(
    task: str | None, problem: Path | None, parameters: dict[str, Any]
) -> tuple[Task, tuple[str, str]]:
    """The task, and the names of the object and the effector in its scene."""
    from energymargin import tasks
    from energymargin.tasks.from_problem import ProblemTask

    if problem is None:
        return tasks.make(task or "", **parameters), ("object", "effector")
    if parameters:
        raise ValueError("--problem has no parameters, expected no -p: its file has all of them")
    made = ProblemTask(str(problem.resolve()))
    return made, (made.body("object"), made.body("effector"))


def _read(
    files: Sequence[Path],
    columns: Path | None,
    topics: tuple[str | None, str | None],
    rules: dict[str, Any],
) -> list[Recording]:
    """`topics` of bags: the object's and the effector's; `rules` are those of both readers."""
    from energymargin import recordings
    from energymargin.recordings.bags import is_bag

    layout, read = recordings.Columns.of(columns), []
    for path in files:
        if is_bag(path):
            read.append(_read_bag(path, layout, topics, rules))
        else:
            read.append(recordings.read_csv(path, layout, **rules))
        say(f"{escape(str(path))}: {_summary(read[-1])}")
    return read


def _read_bag(
    path: Path, layout: Columns, topics: tuple[str | None, str | None], rules: dict[str, Any]
) -> Recording:
    from energymargin import recordings

    if layout.columns or layout.units:
        raise ValueError(f"--columns has columns or units, expected the origin alone for {path}")
    object_topic, effector_topic = topics
    if object_topic is None or effector_topic is None:
        known = ", ".join(f"{name} ({kind})" for name, kind in recordings.bag_topics(path).items())
        raise ValueError(
            f"{path}: expected --object-topic and --effector-topic for a bag; its topics are "
            f"{known or 'none'}"
        )
    return recordings.read_bag(
        path, object=object_topic, effector=effector_topic, origin=layout.origin, **rules
    )


def _is_smooth(recording: Recording) -> bool:
    """Whether velocities of a body come from a spline."""
    motions = (recording.object, recording.effector)
    return any(motion.velocity_covariances is not None for motion in motions)


def _say_left_out(dataset: Dataset) -> None:
    """Counts the states that cannot be simulated."""
    from energymargin.datasets.dataset import left_out_text

    _, reasons = dataset.possible_problems()
    if reasons:
        say(f"[yellow]{escape(left_out_text(reasons, dataset.size))}[/]")


def _summary(recording: Recording) -> str:
    times = recording.times
    return f"{len(recording)} frames, {times[-1] - times[0]:.3g} s; {recording.repairs}"
