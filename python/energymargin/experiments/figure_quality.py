"""The paper's qualitative figure: search trees along a failed and a successful push."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from energymargin import tasks
from energymargin.datasets import Dataset
from energymargin.datasets.generation import load_or_generate
from energymargin.evaluation.labelled import HORIZON, captured_labels
from energymargin.experiments.pictures import one_of_each
from energymargin.experiments.quality import check_labels
from energymargin.scoring import score
from energymargin.settings import SearchSettings
from energymargin.tasks.base import whole_number

__all__ = ["QUICK", "SHOWN", "FigureQuality", "Frame", "Settings", "reproduce"]

TASK = "push"
FRAMES = 10
SHOWN = (0, 3, 6)  # frames of each push


@dataclass(frozen=True)
class Settings:
    """Of the figure; raises ValueError on numbers out of range."""

    trajectories: int = 50
    """Of the dataset that the two pushes are of."""
    nodes: int = 100
    """Of each search tree."""
    seed: int = 0
    """Of the searches."""

    def __post_init__(self) -> None:
        """Checks the numbers: a mistake is said before anything is computed, or written."""
        whole_number("trajectories", self.trajectories, 2)
        _ = SearchSettings(self.nodes, self.seed)


QUICK = Settings(trajectories=10, nodes=30)
"""For a first picture in seconds."""


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
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(field.name for field in fields(Frame))
        writer.writerows(map(astuple, self.frames))
        return text.getvalue()

    def to_markdown(self) -> str:
        """The numbers of the figure."""
        s = self.settings
        rows = [
            f"| {f.push}, trajectory {f.trajectory} | {f.time:.2f} s | {f.pair} | "
            f"{'yes' if f.captured else 'no'} |"
            for f in self.frames
        ]
        return "\n".join(
            [
                "# Qualitative evaluation",
                "",
                f"{TASK}: two of {s.trajectories} trajectories of {FRAMES} states, seed 0, "
                f"{s.nodes} nodes a tree, seed {s.seed} of the search: the scores are those that "
                "the dataset gets with these.",
                "",
                f"| push | time | (success, capture) | captured over the next {HORIZON} frames |",
                "| --- | ---: | ---: | ---: |",
                *rows,
                "",
            ]
        )


def reproduce(
    settings: Settings,
    folder: Path,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FigureQuality:
    """Scores the six frames, and writes figure_quality.md and figure_quality.csv.

    `progress(done, total)` counts frames. Raises ValueError on a folder of other trajectories, and
    on trajectories that all have the same label.
    """
    folder.mkdir(parents=True, exist_ok=True)
    dataset = load_or_generate(
        folder / f"{TASK}.h5", tasks.make(TASK), settings.trajectories, FRAMES, seed=0
    )
    check_labels(dataset)
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
    result = FigureQuality(settings, dataset, frames)
    (folder / "figure_quality.md").write_text(result.to_markdown())
    (folder / "figure_quality.csv").write_text(result.to_csv())
    return result


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
