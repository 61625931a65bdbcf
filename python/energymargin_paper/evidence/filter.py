"""What a filter of actions does to a policy that pushes a box: pairs of episodes by their seeds.

The policy is the script of the push with noise on its forces, at 24 Hz. In the other episode of a
pair the wrapper filters its actions by their capture probabilities. Both have the same start, the
same friction and the same noise; from the first action that is changed on they go their own ways.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Cancel
from energymargin.act.choosing import LEAST_CONFIDENCE
from energymargin.actions import Noise
from energymargin.base.checks import not_negative_number, positive_number, share, whole_number
from energymargin.base.table_text import csv_text, markdown_table
from energymargin.evaluate.searches import SearchSettings
from energymargin.gym import CaptureWrapper, ScriptedFuture, TaskEnv
from energymargin_paper.jobs import pairs, resumed
from energymargin_paper.study import Progress, Study, setting

__all__ = [
    "ARMS",
    "STUDY",
    "Episode",
    "FilterStudy",
    "Filtered",
    "Outcome",
    "Settings",
    "by_seed",
    "noisy",
    "paired",
]

TASK = "push"
EPISODES_FILE = "episodes.jsonl"
ARMS = ("policy", "scored", "filtered")
SCORED = 10  # one of so many pairs also has an episode whose states are scored, for its rate
FRAME = 0.04  # s, of 25 Hz
POLICY_STREAM = 1  # of the noise, beside the environment's
Z95 = 1.959964


@dataclass(frozen=True)
class Settings:
    """Settings of the study; raises ValueError on numbers out of range."""

    episodes: int = setting(200, "Pairs of episodes.")
    seed: int = setting(0, "Of the first pair; each has the next one.")
    noise: float = setting(2.0, "Standard deviation of the policy's noise on x and y [N].")
    candidates: int = setting(5, "Actions that the filter chooses among.")
    spread: float = setting(5.0, "Standard deviation of the candidates on x and y [N].")
    rollouts: int = setting(8, "Rollouts of each candidate.")
    horizon: float = setting(0.8, "How far ahead the filter looks with each action held [s].")
    confidence: float = setting(0.8, "With which another action has to be better.")

    def __post_init__(self) -> None:
        """Checks them."""
        whole_number("episodes", self.episodes, 1)
        whole_number("seed", self.seed, 0)
        not_negative_number("noise", self.noise)
        positive_number("horizon", self.horizon)
        whole_number("rollouts", self.rollouts, 1)
        whole_number("candidates", self.candidates, 2)
        Noise(self.candidates - 1, self.spread)
        share("confidence", self.confidence, LEAST_CONFIDENCE)


@dataclass(frozen=True)
class Episode:
    """A job: an episode of a seed, in one of ARMS."""

    arm: str
    seed: int
    noise: float
    candidates: int
    spread: float
    rollouts: int
    horizon: float
    confidence: float


@dataclass(frozen=True)
class Outcome:
    """How an episode went."""

    success: bool
    steps: int
    changed: int
    """Actions that the filter changed."""
    seconds: float
    """That all steps take [s]; more where the machine has other work too."""
    longest: float
    """The longest step [s]."""
    late: int
    """Steps longer than FRAME."""


@dataclass(frozen=True, eq=False)
class Filtered:
    """What came out: outcomes by arm, those of a pair at the same place."""

    settings: Settings
    outcomes: dict[str, list[Outcome]]

    def successes(self, arm: str) -> NDArray[np.bool_]:
        """Whether each episode of an arm succeeds, shape (N,)."""
        return np.array([outcome.success for outcome in self.outcomes[arm]])

    def to_markdown(self) -> str:
        """Success and rates."""
        before, after = self.successes("policy"), self.successes("filtered")
        gained, lost = int((after & ~before).sum()), int((before & ~after).sum())
        difference, low, high, p = paired(gained, lost, len(before))
        rows = [
            [
                arm,
                f"{len(outcomes)}",
                f"{sum(o.success for o in outcomes)}",
                f"{_changed(outcomes):.1%}",
                f"{_steps(outcomes) / sum(o.seconds for o in outcomes):.0f}",
                f"{sum(o.late for o in outcomes) / _steps(outcomes):.1%}",
                f"{1e3 * max(o.longest for o in outcomes):.0f}",
            ]
            for arm, outcomes in self.outcomes.items()
        ]
        columns = ("", "episodes", "successes", "actions changed", "steps a second")
        table = markdown_table([*columns, f"above {1e3 * FRAME:.0f} ms", "longest [ms]"], rows)
        return (
            f"# A filter of actions\n\n{table}\n\n"
            f"Of {len(before)} pairs {gained} succeed with the filter alone, {lost} without it "
            f"alone. The success rate moves by {100 * difference:+.1f} points, 95 % interval "
            f"{100 * low:+.1f} to {100 * high:+.1f}; McNemar's test, exact: p = {p:.2g}.\n"
        )

    def to_csv(self) -> str:
        """A line for each episode."""
        seeds = range(self.settings.seed, self.settings.seed + self.settings.episodes)
        names = tuple(Outcome.__dataclass_fields__)
        rows = [
            (arm, seed, *asdict(outcome).values())
            for arm, outcomes in self.outcomes.items()
            for seed, outcome in zip(_seeds_of(arm, seeds), outcomes, strict=True)
        ]
        return csv_text(("arm", "seed", *names), rows)


def paired(gained: int, lost: int, pairs_of: int) -> tuple[float, float, float, float]:
    """What a change of some pairs says: the difference of the shares, the ends of its 95 % interval
    (Bonett and Price 2012), and the p-value of McNemar's test, exact and two-sided."""
    from scipy.stats import binomtest

    changed = gained + lost
    p = float(binomtest(gained, changed, 0.5).pvalue) if changed else 1.0
    up, down = (gained + 1) / (pairs_of + 2), (lost + 1) / (pairs_of + 2)
    error = Z95 * np.sqrt((up + down - (up - down) ** 2) / (pairs_of + 2))
    middle = up - down
    return (
        (gained - lost) / pairs_of,
        float(max(middle - error, -1.0)),
        float(min(middle + error, 1.0)),
        p,
    )


def noisy(env: TaskEnv, seed: int, noise: float) -> Callable[[], NDArray[np.float64]]:
    """The policy: the script's action, with normal noise of a standard deviation [N] on both."""
    random = np.random.default_rng([seed, POLICY_STREAM])
    space: Any = env.action_space

    def action() -> NDArray[np.float64]:
        wanted = env.nominal_action() + noise * random.normal(size=2)
        return np.asarray(np.clip(wanted, space.low, space.high))

    return action


def run(job: Episode, cancel: Cancel) -> Outcome:
    """One episode; cut short once `cancel` is set."""
    env = TaskEnv(TASK)
    wrapped = _wrapped(env, job)
    policy = noisy(env, job.seed, job.noise)
    wrapped.reset(seed=job.seed)
    changed, times = 0, []
    while True:
        action = policy()
        begin = time.perf_counter()
        *_, terminated, truncated, info = wrapped.step(action)
        times.append(time.perf_counter() - begin)
        changed += bool(info.get("filter", {}).get("changed"))
        if terminated or truncated or cancel.is_set:
            late = sum(duration > FRAME for duration in times)
            return Outcome(info["success"], len(times), changed, sum(times), max(times), late)


def _wrapped(env: TaskEnv, job: Episode) -> Any:
    """The environment as an arm has it."""
    if job.arm == "policy":
        return env
    if job.arm == "scored":
        return CaptureWrapper(env, ScriptedFuture(job.horizon))
    space: Any = env.action_space
    return CaptureWrapper(
        env,
        ScriptedFuture(job.horizon, hold=job.horizon),
        metric=None,
        settings=SearchSettings(rollouts=job.rollouts),
        candidates=Noise(job.candidates - 1, job.spread, space.low, space.high),
        confidence=job.confidence,
    )


def by_seed(jobs: dict[str, list[Any]]) -> list[Any]:
    """The episodes of all arms by seed, so that a study that is stopped has pairs."""
    return sorted((job for arm in jobs.values() for job in arm), key=lambda job: job.seed)


class FilterStudy(Study[Settings, Filtered]):
    """What a filter of actions does to the success of a noisy policy that pushes a box.

    Pairs of episodes with the same seeds, with the filter and without, and how many steps a second
    the wrapper makes. The folder gets filter.md and filter.csv; it goes on with the episodes that
    it has. Episodes run one after the other, since their steps are timed.

    Example: `energymargin reproduce filter --episodes 50`
    """

    name = "filter"
    title, unit = "Pushing", "episodes"
    settings = Settings()
    quick = Settings(episodes=10)
    packages = ("gymnasium",)
    threaded = False

    def compute(
        self, settings: Settings, folder: Path, threads: int, progress: Progress
    ) -> Filtered:
        """Runs the episodes of all arms."""
        seeds = range(settings.seed, settings.seed + settings.episodes)
        jobs = {arm: [_episode(arm, s, settings) for s in _seeds_of(arm, seeds)] for arm in ARMS}
        found = resumed(
            folder / EPISODES_FILE,
            by_seed(jobs),
            run,
            threads,
            lines=pairs(Episode, Outcome),
            progress=progress,
        )
        return Filtered(settings, {arm: [found[job] for job in jobs[arm]] for arm in ARMS})


STUDY = FilterStudy()


def _episode(arm: str, seed: int, settings: Settings) -> Episode:
    own = asdict(settings)
    del own["episodes"]
    return Episode(arm, **{**own, "seed": seed})


def _seeds_of(arm: str, seeds: range) -> range:
    return seeds[::SCORED] if arm == "scored" else seeds


def _steps(outcomes: list[Outcome]) -> int:
    return sum(outcome.steps for outcome in outcomes)


def _changed(outcomes: list[Outcome]) -> float:
    return sum(outcome.changed for outcome in outcomes) / _steps(outcomes)
