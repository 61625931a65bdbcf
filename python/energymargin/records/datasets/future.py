"""What is asked of the future of a recorded state: how far ahead, and what the robot does then."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from energymargin._core import Plan, Problem
from energymargin.base.checks import not_negative_number, positive_number, whole_number
from energymargin.tasks.base import Task
from energymargin.tasks.scripted import Following, ScriptedTask
from energymargin.tasks.trajectories import Trajectory

WHOLE = 1e-6  # of a step; a rollout's times are so near to whole steps


@dataclass(frozen=True)
class Future:
    """Does it stay captured for the next frames of what the robot does? Asked of any frame, also of
    one with fewer frames left in its trajectory: a probability needs no label.

    Raises ValueError on what cannot be.
    """

    frames: int
    """Frames to look ahead, from 1. One behind the last frame of a trajectory counts as the mean
    time between its frames."""
    plan: Following | None = "script"
    """"script": the mean of the script from the frame on, and behind its end what the task's
    `afterwards` says; "hold": the robot goes on as it moves; None: it coasts."""
    check: float | None = None
    """Time between two looks at the capture set [s]; None: that of a Problem."""
    dwell: float = 0.0
    """How long it has to be outside to be lost [s], as of a Problem."""

    def __post_init__(self) -> None:
        """Checks the fields, and gives each one type, so that a store recognizes equal futures."""
        object.__setattr__(self, "frames", whole_number("frames", self.frames, 1))
        if self.plan not in ("script", "hold", None):
            raise ValueError(f"plan is {self.plan!r}, expected 'script', 'hold' or None")
        if self.check is not None:
            object.__setattr__(self, "check", float(positive_number("check", self.check)))
        object.__setattr__(self, "dwell", not_negative_number("dwell", self.dwell))

    def __str__(self) -> str:
        """As a store's run names it: "horizon 5 frames, plan script"."""
        ahead = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        parts = [f"horizon {ahead}", f"plan {self.plan or 'none'}"]
        if self.check is not None:
            parts.append(f"check {self.check:g} s")
        if self.dwell:
            parts.append(f"dwell {self.dwell:g} s")
        return ", ".join(parts)

    def all(self) -> dict[str, Any]:
        """Its fields by their names in files, where the frames are the horizon."""
        fields = asdict(self)
        return {"horizon": fields.pop("frames"), **fields}

    def to_json(self) -> str:
        """JSON; equal futures give the same text."""
        return json.dumps(self.all(), sort_keys=True)

    @staticmethod
    def from_json(text: str) -> Future:
        """The future that `to_json` wrote."""
        fields = json.loads(text)
        return Future(fields.pop("horizon"), **fields)

    def seconds(self, trajectory: Trajectory, frame: int) -> float:
        """From a frame of a trajectory to the end of the horizon [s].

        Raises ValueError on a trajectory of one frame, which has no time between frames.
        """
        times, last = np.asarray(trajectory.times), len(trajectory) - 1
        if last == 0:
            text = f"the horizon is {self.frames} frames, but the trajectory has one frame alone"
            raise ValueError(f"{text}, expected two or more")
        end = min(frame + self.frames, last)
        behind = frame + self.frames - end
        return float(times[end] - times[frame] + behind * (times[-1] - times[0]) / last)

    def problem(self, task: Task, trajectory: Trajectory, frame: int) -> Problem:
        """The question about one frame of a trajectory of the task.

        A ScriptedTask poses it by `future`. Of another task it is that of `problem`, with a clock;
        a script is what its `plan(state, time, params, horizon)` says, and the capture set what its
        `captured_throughout(params)` says, or else that of the frame. A task whose scores without a
        clock are about another scene has a `recorded_problem`, which is asked in place of
        `problem`. Raises ValueError on a task, or a recording, that has no script.
        """
        seconds = self.seconds(trajectory, frame)
        if isinstance(task, ScriptedTask):
            if self.plan == "script":
                _require_rollout(task, trajectory)
            horizon = _whole_steps(seconds, task.step)
            at = trajectory.states[frame], float(trajectory.times[frame]), trajectory.params
            posed = task.future(*at, horizon, self.plan)
        else:
            posed = self._posed(task, trajectory, frame, seconds)
        changes = {"check": self.check, "dwell": self.dwell}
        changed = {name: value for name, value in changes.items() if value}
        return posed.replace(**changed) if changed else posed

    def _posed(self, task: Task, trajectory: Trajectory, frame: int, seconds: float) -> Problem:
        """The question about a frame of a task that is no ScriptedTask."""
        state, params = trajectory.states[frame], trajectory.params
        pose = getattr(task, "recorded_problem", task.problem)
        problem = pose(state, params, trajectory.contacts[frame])
        horizon = _whole_steps(seconds, problem.scene.step)
        robot = None
        if self.plan == "hold":
            robot = Plan.hold(problem.scene, state, horizon)
        elif self.plan == "script":
            robot = _script_of(task)(state, float(trajectory.times[frame]), params, horizon)
        throughout = getattr(task, "captured_throughout", None)
        sets = {"captured": throughout(params)} if callable(throughout) else {}
        return problem.replace(horizon=horizon, plan=robot, effector="coast", **sets)


def _whole_steps(seconds: float, step: float) -> float:
    return max(1, round(seconds / step)) * step


def _script_of(task: Task) -> Callable[..., Plan]:
    """A task's `plan`; ValueError if it has none."""
    plan: Callable[..., Plan] | None = getattr(task, "plan", None)
    if callable(plan):
        return plan
    text = f"plan is 'script', but task {task.name!r} does not say what its robot is about to do"
    text += f": give {type(task).__name__} a method `plan(state, time, params, horizon)`"
    raise ValueError(f"{text} that returns an em.Plan, or ask with plan 'hold' or none")


def _require_rollout(task: ScriptedTask, trajectory: Trajectory) -> None:
    """Raises ValueError unless the frames are at whole steps, as those of a script are."""
    steps = np.asarray(trajectory.times) / task.step
    if np.abs(steps - np.round(steps)).max() > WHOLE or steps[0] < 0:
        raise ValueError(
            "plan is 'script', but the frames are not at whole steps of the simulation, as of a "
            "recording, which follows no script: expected 'hold' or None"
        )
