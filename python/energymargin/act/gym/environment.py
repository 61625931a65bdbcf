"""A task as an environment of gymnasium: its start, its scene, and an agent in place of its script.

Between two control steps the action is held. Everything random comes from `np_random`, in the order
of the task's own trajectories: `reset(seed=3)` starts as `task.rollout(seed=3)` does. The numbers
of an action are channels: what of the drive is the agent's, and within which bounds. What is not,
such as the table that sinks under a grasp, follows the task's script.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from energymargin import tasks
from energymargin._core import Plan, Problem, World
from energymargin.base.aliases import Floats
from energymargin.base.checks import numbers_of, one_of, positive_number, require, whole_number
from energymargin.model.plans import control_period, nearest_steps, whole_steps
from energymargin.tasks import balance, grasp, push, push_multi, scoop, topple
from energymargin.tasks.base import Params, Regions, inside
from energymargin.tasks.scripted import Drive, ScriptedTask

CONTROL_STEP = 10 / 240  # s; ten steps of the simulation, 24 Hz
PATIENCE = 1.0  # s; pushes that succeed had their box outside for as long as that
DPI = 100
DETAIL = 80  # cells of the sets in a picture; a film needs no more
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class Channel:
    """One number of an action: of the wrench on a body, or the target of a joint.

    Raises ValueError unless it is of a body or of a joint, with finite bounds.
    """

    low: float
    """The least [N, N m, rad or m]."""
    high: float
    """The most, in the same unit."""
    body: str | None = None
    """Body on which the wrench acts."""
    axis: int = 0
    """Number of the wrench's axis: 0 to 2 are forces on x, y and z, 3 to 5 torques about them."""
    joint: str | None = None
    """Joint whose control gets the target."""
    offset: float = 0.0
    """What acts when the number is 0, such as the force that holds a weight."""

    @property
    def name(self) -> str:
        """Among the commanded numbers of em.Policy."""
        return self.joint or f"{self.body}.{WRENCH[self.axis]}"

    def __post_init__(self) -> None:
        """Checks them."""
        if (self.body is None) == (self.joint is None):
            raise ValueError(f"{self} is of a body and a joint, or of none: expected one of them")
        whole_number("axis", self.axis, 0, 5)
        if not (np.isfinite([self.low, self.high]).all() and self.low < self.high):
            raise ValueError(f"low is {self.low} and high {self.high}, expected finite low < high")


def acted(
    drive: Drive, channels: Sequence[Channel], action: NDArray[np.float64], rows: int | None = None
) -> Drive:
    """The drive, with the action in its channels in the first rows, or in all."""
    copied = Drive(
        {body: rows.copy() for body, rows in drive.wrenches.items()},
        {joint: rows.copy() for joint, rows in drive.targets.items()},
    )
    for channel, number in zip(channels, action, strict=True):
        _rows(copied, channel)[:rows] = channel.offset + number
    return copied


def _rows(drive: Drive, channel: Channel) -> NDArray[np.float64]:
    """A channel's numbers of each step, shape (steps,): a view of the drive's."""
    if channel.joint:
        return drive.targets[channel.joint]
    return drive.wrenches[channel.body or ""][:, channel.axis]


def action_of(drive: Drive, channels: Sequence[Channel]) -> NDArray[np.float64]:
    """The action that does what a drive does on average, as near as the bounds let it."""
    numbers = np.array([np.mean(_rows(drive, one)) - one.offset for one in channels])
    return np.asarray(np.clip(numbers, [c.low for c in channels], [c.high for c in channels]))


def _force(body: str, *bounds: tuple[float, float]) -> tuple[Channel, ...]:
    """On x, y and so on, within bounds [N]."""
    return tuple(Channel(low, high, body, axis) for axis, (low, high) in enumerate(bounds))


def _joint(name: str, opened: float, clenched: float) -> Channel:
    """Between both ends of the script's targets, and its noise beyond them [rad]."""
    low, high = sorted((opened, clenched * grasp.CLENCH_RANGE[1]))
    return Channel(low - grasp.TARGET_NOISE, high + grasp.TARGET_NOISE, joint=name)


# As much as the script ever pushes ahead, and a third of that to both sides.
PUSH_MOST = push.DRIVE_AHEAD_RANGE[1] * push.FRICTION_RANGE[1] / push.FRICTION_MIDDLE  # N
BALANCE_WEIGHT = -balance.SUPPORT_MASS * balance.GRAVITY[1]  # N
BAR_MOST = 2 * push_multi.FORCE_SPREAD  # N; twice the script's noise, which is more than its push
SCOOP_MOST = (3.0, 1.0, 3.0)  # m/s^2; the script needs at most 1.2, in its shortest bend

CHANNELS: dict[str, tuple[Channel, ...]] = {
    "push": _force("effector", (-PUSH_MOST / 3, PUSH_MOST / 3), (0.0, PUSH_MOST)),
    "balance": (
        Channel(*balance.LIFT_RANGE, "effector", 1, offset=BALANCE_WEIGHT),
        Channel(-balance.TORQUE_SPREAD, balance.TORQUE_SPREAD, "effector", 5),
    ),
    "topple": (Channel(0.0, topple.PUSH_RANGE[1], "base", 0),),
    "grasp": tuple(
        _joint(f"finger_{finger}_joint_{number}", *ends)
        for finger in grasp.FINGERS
        for number, ends in enumerate(zip(grasp.OPEN, grasp.CLENCHED, strict=True), 1)
    ),
    "scoop": _force("scoop", *((-scoop.SCOOP_MASS * a, scoop.SCOOP_MASS * a) for a in SCOOP_MOST)),
    "push-multi": (
        *_force("bar", *[(-BAR_MOST, BAR_MOST)] * 2),
        Channel(-push_multi.TORQUE_SPREAD, push_multi.TORQUE_SPREAD, "bar", 5),
    ),
}
"""By task, the channels of its environment."""


class TaskEnv(gymnasium.Env[Floats, Floats]):
    """A task with a script, driven by an agent.

    The observation is the scene's state, shape (n,); `task.scene(params).unpack` reads it. The
    action has a number for each channel, in N, N m or rad. The reward comes with the last step: the
    share of the objects that are in the success set, so 0 or 1 of a single one.

    An episode terminates once all objects are in their success sets, and once none has been
    captured for `patience`. It is truncated at the task's length.

    `info` has "time" [s], "captured" (whether any object is, now), "success" (whether all are in
    their success sets), and "lost" (whether the patience is over).
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  (gymnasium's type)
    metadata["render_fps"] = round(1 / CONTROL_STEP)
    state: Floats
    """Where the scene is, shape (n,)."""
    start: Floats
    """Where it was at the start of the episode."""
    params: Params
    """What was drawn for this episode alone, such as the friction."""
    control_step: float
    """For how long an action is held [s], in the mean."""
    _done: int
    """Steps of the simulation."""
    _actions: int
    """Steps of control."""
    _outside: float
    """Since an object was captured [s]."""
    _seen: Floats | None
    """States whose surroundings a picture shows."""

    def __init__(
        self,
        task: str | ScriptedTask,
        *,
        channels: Sequence[Channel] | None = None,
        control_step: float = CONTROL_STEP,
        patience: float = PATIENCE,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        """An environment of a task.

        Args:
            task: its name, or a task of your own.
            channels: what the agent drives; None takes CHANNELS of the task's name.
            control_step: for how long an action is held [s]. Each action begins at the step of the
                simulation that is nearest to its time, so that 50 Hz are 50 actions a second.
            patience: for how long no object may be captured before the episode is lost [s].
            render_mode: None, or "rgb_array": a picture of bodies and sets, which needs the extra
                `plots`.
            parameters: of the task, by name, such as friction=0.3.

        Raises ValueError on a task without a script or channels, and on numbers out of range.
        """
        made = tasks.make(task, **parameters) if isinstance(task, str) else task
        if not isinstance(made, ScriptedTask):
            raise ValueError(f"task is {task!r}, expected one with a script: a ScriptedTask")
        if made is task and parameters:
            raise ValueError(f"parameters are {parameters}, expected none with a task that is made")
        self.task = made
        self.channels = tuple(CHANNELS.get(made.name, ()) if channels is None else channels)
        expected = f"what the agent drives: task {made.name!r} has none of its own"
        require(self.channels, "channels", channels, expected)
        self.control_step = control_period("control_step", control_step, self.task.step)
        self.patience = positive_number("patience", patience)
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self._begin(np.random.default_rng(0))  # an episode to ask about before the first reset
        kind: Any = np.float64
        low, high = np.array([(channel.low, channel.high) for channel in self.channels]).T
        self._bounds = low, high
        self.action_space = spaces.Box(low, high, dtype=kind)
        self.observation_space = spaces.Box(-np.inf, np.inf, self.state.shape, kind)

    @property
    def time(self) -> float:
        """Since the start of the episode [s]."""
        return float(self._done * self.task.step)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """A new episode; its start and params are those of `task.rollout(seed)`. No options."""
        super().reset(seed=seed)
        self._begin(self.np_random)
        return self.state.copy(), self._info()

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Holds an action, clipped to its bounds, for a control step.

        Raises ValueError on an action of another shape, or with a number that is not finite.
        """
        drive = acted(self._rows(), self.channels, self._checked(action))
        steps = min(self._held(), self.task.steps - self._done)
        if steps < 1:
            raise ValueError("the episode is over, expected reset() before the next step")
        self.state = self._driven(self.state, drive, steps)[-1]
        self._done, self._actions = self._done + steps, self._actions + 1
        outside = self._outside + steps * self.task.step
        self._outside = 0.0 if any(self._inside(self._captured)) else outside
        info = self._info()
        terminated = info["success"] or info["lost"]
        truncated = not terminated and self._done == self.task.steps
        share = float(np.mean(self._inside(self._succeeded)))
        return self.state.copy(), share * (terminated or truncated), terminated, truncated, info

    def nominal_action(self) -> Floats:
        """What the task's script does in the next control step, on average."""
        return action_of(self._rows(), self.channels)

    def policy_arguments(self) -> dict[str, Any]:
        """Arguments of em.Policy for an agent of this environment: command, convert and period.

        Raises ValueError on a task whose script drives more than the agent.
        """
        driven = {channel.body or channel.joint for channel in self.channels}
        script = self.task.script(self.params)
        for other in sorted({*script.wrenches, *script.targets} - driven):
            way = "expected one whose drives are all the agent's"
            raise ValueError(f"env is of a task whose script drives {other!r} too, {way}")
        convert = partial(np.add, [channel.offset for channel in self.channels])
        command = [channel.name for channel in self.channels]
        return {"command": command, "convert": convert, "period": self.control_step}

    def present(self) -> Problem:
        """The question of the task at this state, without a clock."""
        return self.task.problem(self.state, self.params)

    def future(
        self, horizon: float, action: Floats | None = None, hold: float | None = None
    ) -> Problem:
        """Does it stay captured over the next `horizon` [s]?

        The robot holds `action` for `hold` [s], by default a control step, and follows the script
        afterwards; without an action it follows the script. Raises ValueError on times that are not
        whole steps of the simulation.
        """
        plan = self.task.plan(self.state, self.time, self.params, horizon)
        if action is not None:
            rows = self._held() if hold is None else whole_steps("hold", hold, self.task.step)
            drive = Drive(plan.wrenches, plan.targets)
            held = acted(drive, self.channels, self._checked(action), min(rows, plan.rows))
            plan = Plan(plan.step, wrenches=held.wrenches, targets=held.targets)
        world: Any = {"captured": self._captured, "scene": self._world.scene}
        return self.present().replace(horizon=horizon, plan=plan, effector="coast", **world)

    def render(self) -> Any:
        """The state as a picture, shape (height, width, 3) of bytes; None without a render mode."""
        if self.render_mode is None:
            return None
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        from energymargin.look.outlines import view_of
        from energymargin.look.plots import plot_state

        if self._seen is None:
            self._seen = self._driven(self.start, self._script, self.task.steps)
        problem, plane = self.present(), self.task.plane
        figure = Figure(figsize=(6.0, 5.0), dpi=DPI)
        canvas: Any = FigureCanvasAgg(figure)
        ax = figure.add_subplot()
        limits = view_of(problem.scene, self._seen, plane, around=0.25)
        plot_state(problem, ax=ax, plane=plane, limits=limits, detail=DETAIL)
        ax.set_title(f"{self.time:.2f} s", fontsize=10)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def _begin(self, random: np.random.Generator) -> None:
        """An episode, drawn in the order of `ScriptedTask.rollout`, so that seeds agree."""
        self.params = self.task.draw(random)
        self._world = World(self.task.scene(self.params))
        self.start = np.asarray(self.task.start(self._world, self.params, random))
        self._script = self.task.script(self.params)
        self._captured: Regions = self.task.captured_throughout(self.params)
        self._succeeded: Regions = self.task.succeeded(self.params)
        self.state = self.start.copy()
        self._done, self._actions = 0, 0
        self._outside, self._seen = 0.0, None

    def _driven(self, state: Floats, drive: Drive, steps: int) -> Floats:
        """A state, and where so many steps of a drive take it, shape (2, n)."""
        drives: Any = {"drives": drive.wrenches, "targets": drive.targets}
        return np.array(self._world.simulate(state, steps, record=[0, steps], **drives).states)

    def _rows(self) -> Drive:
        """The script's rows of the next control step; the last one, once it is over."""
        first = min(self._done, self.task.steps - 1)
        return self._script.between(first, min(first + self._held(), self.task.steps))

    def _held(self) -> int:
        """For how many steps the next action is held."""
        end = nearest_steps((self._actions + 1) * self.control_step, self.task.step)
        return int(end) - self._done

    def _checked(self, action: Floats) -> Floats:
        count = len(self.channels)
        numbers = numbers_of("action", action, f"{count} finite numbers", (count,))
        return np.asarray(np.clip(numbers, *self._bounds))

    def _info(self) -> dict[str, Any]:
        captured, success = any(self._inside(self._captured)), all(self._inside(self._succeeded))
        lost = self._outside >= self.patience - self.task.step / 2
        return {"time": self.time, "captured": captured, "success": success, "lost": lost}

    def _inside(self, sets: Regions) -> list[bool]:
        """Whether the state is in the set of each object, or in that of all together."""
        return list(map(bool, inside(sets, self._world.scene, self.state)))


@dataclass(frozen=True)
class ScriptedFuture:
    """Does it stay captured over a horizon, while the robot follows the task's script?

    For environments of `TaskEnv`. With an action the robot holds that first: the question of a
    filter. Raises ValueError when it is asked about another environment.
    """

    horizon: float = 0.5
    """[s]"""
    hold: float | None = None
    """For how long the action is held [s]; None: for a control step."""

    def __call__(self, env: gymnasium.Env[Any, Any], action: Floats | None = None) -> Problem:
        """The problem of the state that the environment is in."""
        return task_env(env).future(self.horizon, action, self.hold)


def present(env: gymnasium.Env[Any, Any]) -> Problem:
    """The question without a clock, for the capture score, efforts and the force score.

    For environments of `TaskEnv`; raises ValueError on another.
    """
    return task_env(env).present()


def task_env(env: gymnasium.Env[Any, Any]) -> TaskEnv:
    """The environment of this package inside of wrappers. Raises ValueError on another."""
    inner = env.unwrapped
    if not isinstance(inner, TaskEnv):
        way = "for another write problem_of(env), which returns a Problem of its state"
        raise ValueError(f"env is {env}, expected one of energymargin; {way}")
    return inner


# `EnergyMarginPush-v0` and the others, one for each task with channels; once.
for name in CHANNELS:
    identifier = f"EnergyMargin{name.title().replace('-', '')}-v0"
    if identifier not in gymnasium.registry:
        gymnasium.register(identifier, f"{__name__}:TaskEnv", kwargs={"task": name})
