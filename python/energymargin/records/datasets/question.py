"""The question that most people mean: does it stay captured over the next frames?"""

from __future__ import annotations

import numpy as np

from energymargin.records.datasets.dataset import Dataset
from energymargin.records.datasets.future import Future
from energymargin.tasks.scripted import Following

FRAMES = 5  # as the results ask: 0.8 to 1.4 s of the tasks of this package
SECONDS = 0.5  # where frames are closer together, as those of a camera, so many as this has
PLANS: tuple[Following | None, ...] = ("script", "hold", None)
SAMPLE = 20  # states that tell whether a plan can be asked


def usual_future(dataset: Dataset, frames: int | None = None) -> Future:
    """What `energymargin score` asks of a dataset's states by default: whether each stays captured
    over the next frames of what its robot does.

    Five frames, or as many as half a second has where they are closer together, but no more than
    the longest trajectory has, if `frames` does not say how many; the plan is the task's script, or
    "hold" where there is none. Raises ValueError if each trajectory has one frame alone, or no plan
    can be asked.
    """
    frames = _usual_frames(dataset) if frames is None else frames
    return Future(frames, _usual_plan(dataset, frames))


def _usual_frames(dataset: Dataset) -> int:
    """Frames to look ahead: FRAMES, or as many as SECONDS have, but no more than the longest
    trajectory has after its first. Raises ValueError if each has one alone."""
    times = np.asarray(dataset.trajectories[int(np.argmax(dataset.lengths))].times)
    last = len(times) - 1
    if last == 0:
        raise ValueError("each trajectory has one frame alone, expected two or more")
    of_seconds = round(SECONDS * last / float(times[-1] - times[0]))
    return min(max(FRAMES, of_seconds), last)


def _usual_plan(dataset: Dataset, frames: int) -> Following | None:
    """What the robot does over the next frames: what its script says; without a script, it goes on
    as it moves; else it coasts. Raises ValueError if none of them can be asked."""
    numbers = sorted({*np.linspace(0, dataset.size - 1, SAMPLE, dtype=int).tolist()})
    for plan in PLANS:
        problems, reasons = dataset.possible_problems(numbers, future=Future(frames, plan))
        if problems:
            return plan
    raise ValueError(reasons[min(reasons)])
