"""The paper's qualitative figure: search trees along a failed and a successful push."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from energymargin import tasks
from energymargin.checks import whole_number
from energymargin.datasets import Dataset
from energymargin.evaluation.labelled import HORIZON, captured_labels
from energymargin.scoring import score
from energymargin.searches import SearchSettings
from energymargin.table_text import csv_text, markdown_table
from energymargin_paper.paper.quality import FRAMES, TASK, pushes
from energymargin_paper.study import Progress, Study, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SHOWN", "STUDY", "FigureQuality", "Frame", "Settings", "figure_quality"]

SHOWN = (0, 3, 6)  # frames of each push


@dataclass(frozen=True)
class Settings:
    """The study's settings; raises ValueError on numbers out of range."""

    trajectories: int = setting(50, "Pushes of the dataset that the two are chosen from.")
    nodes: int = setting(100, "Nodes of each search tree.")
    seed: int = setting(0, "Seed of the searches.")

    def __post_init__(self) -> None:
        """Checks them, before anything is computed or written."""
        whole_number("trajectories", self.trajectories, 2)
        _ = SearchSettings(self.nodes, self.seed)


@dataclass(frozen=True)
class Frame:
    """One of the six, and its scores."""

    push: str
    """ "failed" or "successful"."""
    trajectory: int
    frame: int
    state: int
    """Its number in the dataset."""
    time: float
    """[s]"""
    success: float
    """Its score."""
    capture: float
    """Its score."""
    captured: bool
    """Whether it is captured over the next HORIZON frames."""

    @property
    def pair(self) -> str:
        """As it stands under the frame."""
        return f"({self.success:.2f}, {self.capture:.2f})"


@dataclass(frozen=True)
class FigureQuality:
    """What the figure shows."""

    settings: Settings
    dataset: Dataset
    frames: list[Frame]

    @property
    def pushes(self) -> dict[str, int]:
        """The number of each trajectory."""
        return {frame.push: frame.trajectory for frame in self.frames}

    def to_csv(self) -> str:
        """One line a frame."""
        return csv_text([field.name for field in fields(Frame)], map(astuple, self.frames))

    def to_markdown(self) -> str:
        """The numbers of the figure."""
        s = self.settings
        text = (
            f"{TASK}: two of {s.trajectories} trajectories of {FRAMES} states, seed 0, "
            f"{s.nodes} nodes a tree, seed {s.seed} of the search: the scores are those that "
            "the dataset gets with these."
        )
        captured = f"captured over the next {HORIZON} frames"
        table = markdown_table(
            ("push", "time", "(success, capture)", captured),
            [
                (
                    *(f"{f.push}, trajectory {f.trajectory}", f"{f.time:.2f} s", f.pair),
                    "yes" if f.captured else "no",
                )
                for f in self.frames
            ],
            ("left", "right", "right", "right"),
        )
        return f"# Qualitative evaluation\n\n{text}\n\n{table}\n"


class FigureQualityStudy(Study[Settings, FigureQuality]):
    """Search trees in three frames of a failed and of a successful push, with their scores.

    The paper's qualitative figure: the capture set is light blue, the success set grey, and the
    bodies at three random nodes are half transparent. Under each frame stands (success, capture),
    as the dataset's states get it from as many nodes and the same seed.

    The folder gets figure_quality.md, figure_quality.csv, figure_quality.png and the pushes
    (push.h5). It takes a few seconds.

    Example: `energymargin reproduce figure-quality --nodes 300`
    """

    name = "figure-quality"
    title, unit = "Growing trees", "frames"
    settings = Settings()
    quick = Settings(trajectories=10, nodes=30)
    resumes = False

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> FigureQuality:
        """Scores the six frames. Raises ValueError on a folder of other trajectories, and on
        trajectories that all have the same label."""
        from energymargin.plots.datasets import one_of_each

        dataset = pushes(folder, settings.trajectories)
        places = {
            t * FRAMES + k: (push, t, k) for push, t in one_of_each(dataset).items() for k in SHOWN
        }
        rising = sorted(places)
        table = score(
            dataset.problems(rising),
            ("capture", "success"),
            nodes=settings.nodes,
            seed=settings.seed,
            threads=threads,
            indices=rising,
            progress=progress,
        )
        rows = dict(zip(rising, table.to_rows(), strict=True))
        frames = [_frame(dataset, *place, rows[number]) for number, place in places.items()]
        return FigureQuality(settings, dataset, frames)

    def figures(self, result: FigureQuality) -> Iterator[tuple[str, Figure]]:
        """The six frames, with trees, sets and ghosts."""
        yield "figure_quality.png", figure_quality(result)


STUDY = FigureQualityStudy()


def _frame(dataset: Dataset, push: str, t: int, k: int, row: dict[str, float]) -> Frame:
    trajectory = dataset.trajectories[t]
    return Frame(
        push=push,
        trajectory=t,
        frame=k,
        state=int(row["index"]),
        time=float(trajectory.times[k]),
        success=row["success"],
        capture=row["capture"],
        captured=bool(captured_labels(trajectory.captured, HORIZON)[k]),
    )


def figure_quality(result: FigureQuality) -> Figure:
    """A row for each push; (success, capture) under each frame, from the trees of the scores."""
    from energymargin import plots

    dataset, settings = result.dataset, result.settings
    firsts = {frame.push: frame.state - frame.frame for frame in result.frames}
    return plots.figure_qualitative(
        tasks.make(dataset.task, **dataset.parameters),
        {push: dataset.trajectories[t] for push, t in result.pushes.items()},
        frames=SHOWN,
        nodes=settings.nodes,
        seed=settings.seed,
        first_states=firsts,
        pairs=True,
    )
