"""What a guard does to a policy that pushes a box: episodes in threes by their seeds.

The policy is the script of the push with noise on its forces, at 24 Hz. One episode has the policy
alone, one has the guard before it, in one the wrapper filters each action by its capture
probability. All three have the same start, friction and noise; from the first action that is
changed on they go their own ways.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Cancel
from energymargin.act.choosing import LEAST_CONFIDENCE
from energymargin.actions import Decision, Guard, Noise
from energymargin.base.aliases import Floats
from energymargin.base.checks import not_negative_number, positive_number, share, whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.evaluate.searches import SearchSettings
from energymargin.gym import CaptureWrapper, ScriptedFuture, TaskEnv
from energymargin.monitor import Alarm, Monitor
from energymargin_paper.evidence.pairs_of_trials import paired
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = ["ARMS", "STUDY", "Episode", "GuardStudy", "Guarded", "Outcome", "Settings"]

TASK = "push"
EPISODES_FILE = "episodes.jsonl"
ARMS = ("policy", "guard", "filter")
FRAME = 0.04  # s, of 25 Hz
POLICY_STREAM = 1  # of the noise, beside the environment's

Policy = Callable[[], Floats]
Counts = tuple[int, int, int, int]
"""Counts of one step: alarm on, action changed, stopped; rollouts."""
Step = Callable[[], tuple[dict[str, Any], bool, Counts]]
"""Takes a step; returns its info, whether the episode is over, and what it counts."""


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on numbers out of range."""

    episodes: int = setting(200, "Episodes of each kind.")
    seed: int = setting(0, "Seed of the first episode; the others have the next ones.")
    noise: float = setting(2.0, "Standard deviation of the policy's noise on x and y [N].")
    on: float = setting(0.7, "The alarm goes on below this probability.")
    off: float = setting(0.9, "It goes off from this one on.")
    watched: int = setting(8, "Rollouts of the monitor for each state.")
    candidates: int = setting(4, "Actions beside the policy's.")
    spread: float = setting(5.0, "Their standard deviation on x and y [N].")
    rollouts: int = setting(8, "Rollouts of each action that is asked.")
    horizon: float = setting(0.8, "How far ahead monitor, guard and filter look [s].")
    confidence: float = setting(0.5, "With which another action has to be better.")
    least: float = setting(0.0, "Probability below which the guard stops the pusher.")

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("episodes", self.episodes, 1)
        whole_number("seed", self.seed, 0)
        not_negative_number("noise", self.noise)
        Alarm(self.on, self.off)
        whole_number("watched", self.watched, 1)
        Noise(self.candidates, self.spread)
        whole_number("rollouts", self.rollouts, 1)
        positive_number("horizon", self.horizon)
        share("confidence", self.confidence, LEAST_CONFIDENCE)
        not_negative_number("least", self.least)


@dataclass(frozen=True)
class Episode:
    """A job: an episode of a seed, in one of ARMS."""

    arm: str
    seed: int
    noise: float
    on: float
    off: float
    watched: int
    candidates: int
    spread: float
    rollouts: int
    horizon: float
    confidence: float
    least: float


@dataclass(frozen=True)
class Outcome:
    """How an episode went."""

    success: bool
    lost: bool
    """The box was not captured for the environment's patience."""
    steps: int
    alarms: int
    """Steps with the alarm on."""
    changed: int
    """Steps whose action is not the policy's."""
    stopped: int
    """Steps whose action is the fallback."""
    rollouts: int
    """Rollouts of all steps, with the monitor's."""
    seconds: float
    """That all steps take [s]; more where the machine has other work too."""
    longest: float
    """The longest step [s]."""
    late: int
    """Steps longer than FRAME."""


@dataclass(frozen=True, eq=False)
class Guarded:
    """What came out: outcomes by arm, those of a seed at the same place."""

    settings: Settings
    outcomes: dict[str, list[Outcome]]

    def to_markdown(self) -> str:
        """Success, losses and costs."""
        rows = [_row(arm, outcomes) for arm, outcomes in self.outcomes.items()]
        columns = ("", "episodes", "successes", "losses", "alarm on", "changed", "stopped")
        costs = ("rollouts a step", "steps a second", f"above {1e3 * FRAME:.0f} ms", "longest [ms]")
        table = markdown_table([*columns, *costs], rows)
        pairs_of_arms = [self._compared("guard", "policy"), self._compared("guard", "filter")]
        return f"# A guard\n\n{table}\n\n" + "\n\n".join(pairs_of_arms) + "\n"

    def to_csv(self) -> str:
        """A line for each episode."""
        first = self.settings.seed
        rows = [
            (arm, first + k, *asdict(outcome).values())
            for arm, outcomes in self.outcomes.items()
            for k, outcome in enumerate(outcomes)
        ]
        return csv_text(("arm", "seed", *Outcome.__dataclass_fields__), rows)

    def _compared(self, arm: str, other: str) -> str:
        """Two arms, pair by pair."""
        text = [
            self._difference(f"{name} with the {arm}", arm, other, of)
            for name, of in (("successes", _success), ("losses", _lost))
        ]
        return f"Against the {other}: " + " ".join(text)

    def _difference(self, name: str, arm: str, other: str, of: Callable[[Outcome], bool]) -> str:
        after, before = (np.array([of(o) for o in self.outcomes[a]]) for a in (arm, other))
        more, fewer = int((after & ~before).sum()), int((before & ~after).sum())
        difference, low, high, p = paired(more, fewer, len(before))
        return (
            f"{more} {name} alone, {fewer} without it alone ({100 * difference:+.1f} points, 95 % "
            f"interval {100 * low:+.1f} to {100 * high:+.1f}; McNemar's test, exact: p = {p:.2g})."
        )


def noisy(env: TaskEnv, seed: int, noise: float) -> Policy:
    """The policy: the script's action, with normal noise of a standard deviation [N] on both."""
    random = np.random.default_rng([seed, POLICY_STREAM])
    space: Any = env.action_space

    def action() -> Floats:
        wanted = env.nominal_action() + noise * random.normal(size=2)
        return np.asarray(np.clip(wanted, space.low, space.high))

    return action


def run(job: Episode, cancel: Cancel) -> Outcome:
    """One episode; cut short once `cancel` is set."""
    env = TaskEnv(TASK)
    env.reset(seed=job.seed)
    policy = noisy(env, job.seed, job.noise)
    counts, times, over = np.zeros(4, dtype=int), list[float](), False
    with STEPS[job.arm](env, job, policy) as step:
        while not (over or cancel.is_set):
            begin = time.perf_counter()
            info, over, counted = step()
            times.append(time.perf_counter() - begin)
            counts += counted
    alarms, changed, stopped, rollouts = counts.tolist()
    return Outcome(
        success=info["success"],
        lost=info["lost"],
        steps=len(times),
        alarms=alarms,
        changed=changed,
        stopped=stopped,
        rollouts=rollouts,
        seconds=sum(times),
        longest=max(times),
        late=sum(duration > FRAME for duration in times),
    )


@contextmanager
def _alone(env: TaskEnv, _: Episode, policy: Policy) -> Iterator[Step]:
    def step() -> tuple[dict[str, Any], bool, Counts]:
        *_, terminated, truncated, info = env.step(policy())
        return info, terminated or truncated, (0, 0, 0, 0)

    yield step


@contextmanager
def _guarded(env: TaskEnv, job: Episode, policy: Policy) -> Iterator[Step]:
    with guard_of(env, job, policy) as guard:

        def step() -> tuple[dict[str, Any], bool, Counts]:
            action = guard(env.state, time=env.time, state=env.state)
            *_, terminated, truncated, info = env.step(action)
            assert guard.last is not None
            return info, terminated or truncated, _counts(guard.last, job.watched)

        yield step


@contextmanager
def _filtered(env: TaskEnv, job: Episode, policy: Policy) -> Iterator[Step]:
    space: Any = env.action_space
    wrapped = CaptureWrapper(
        env,
        ScriptedFuture(job.horizon, hold=job.horizon),
        metric=None,
        settings=SearchSettings(rollouts=job.rollouts),
        candidates=Noise(job.candidates, job.spread, space.low, space.high),
        confidence=job.confidence,
    )
    wrapped.reset(seed=job.seed)

    def step() -> tuple[dict[str, Any], bool, Counts]:
        *_, terminated, truncated, info = wrapped.step(policy())
        told = info["filter"]
        asked = int(np.isfinite(told["probabilities"]).sum())
        return info, terminated or truncated, (0, int(told["changed"]), 0, job.rollouts * asked)

    yield step


STEPS = {"policy": _alone, "guard": _guarded, "filter": _filtered}


def guard_of(env: TaskEnv, job: Episode, policy: Policy) -> Guard:
    """The guard of an episode. The monitor looks at what the script does, the guard holds actions;
    the fallback is no force."""
    space: Any = env.action_space
    return Guard(
        lambda _: policy(),
        Monitor(
            lambda state, time: env.future(job.horizon),
            alarm=Alarm(job.on, job.off),
            rollouts=job.watched,
            seed=job.seed,
            threads=1,
        ),
        (lambda _: np.zeros(space.shape)) if job.least else None,
        problem_of=lambda state, time, action: env.future(job.horizon, action, job.horizon),
        candidates=Noise(job.candidates, job.spread, space.low, space.high),
        confidence=job.confidence,
        least=job.least,
        rollouts=job.rollouts,
        seed=job.seed,
        threads=1,
    )


def _counts(decision: Decision, watched: int) -> Counts:
    return (
        int(decision.reason == "alarm"),
        int(decision.source != "policy"),
        int(decision.source == "fallback"),
        watched + decision.rollouts,
    )


def _success(outcome: Outcome) -> bool:
    return outcome.success


def _lost(outcome: Outcome) -> bool:
    return outcome.lost


def _row(arm: str, outcomes: list[Outcome]) -> list[str]:
    steps = sum(o.steps for o in outcomes)
    return [
        arm,
        f"{len(outcomes)}",
        f"{sum(map(_success, outcomes))}",
        f"{sum(map(_lost, outcomes))}",
        *(
            f"{sum(count) / steps:.1%}"
            for count in zip(*((o.alarms, o.changed, o.stopped) for o in outcomes), strict=True)
        ),
        f"{sum(o.rollouts for o in outcomes) / steps:.1f}",
        f"{steps / sum(o.seconds for o in outcomes):.0f}",
        f"{sum(o.late for o in outcomes) / steps:.1%}",
        f"{1e3 * max(o.longest for o in outcomes):.0f}",
    ]


class GuardStudy(Study[Settings, Guarded]):
    """What a guard does to the losses of a noisy policy that pushes a box.

    Episodes with the same seeds: the policy alone, with the guard, and with the filter in each
    step. The folder gets guard.md and guard.csv; it goes on with the episodes that it has. Episodes
    run one after the other, since their steps are timed.

    Example: `energymargin reproduce guard --episodes 50`
    """

    name = "guard"
    title, unit = "Pushing", "episodes"
    settings = Settings()
    quick = Settings(episodes=10)
    packages = ("gymnasium",)
    threaded = False

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Guarded:
        """Runs the episodes of all arms."""
        jobs = {arm: _episodes(arm, settings) for arm in ARMS}
        found = resumed(
            folder / EPISODES_FILE,
            # by seed, so that a study that is stopped has episodes in threes
            sorted(chain(*jobs.values()), key=lambda job: job.seed),
            run,
            1,
            lines=pairs(Episode, Outcome),
            progress=progress,
        )
        return Guarded(settings, {arm: [found[job] for job in jobs[arm]] for arm in ARMS})


STUDY = GuardStudy()


def _episodes(arm: str, settings: Settings) -> list[Episode]:
    own = asdict(settings)
    count, seed = own.pop("episodes"), own.pop("seed")
    return [Episode(arm, seed=number, **own) for number in range(seed, seed + count)]
