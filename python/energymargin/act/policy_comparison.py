"""Two policies by what they won, episode by episode, whoever simulated or watched them.

Pairs of episodes in which one of the two did better are bets, as in a race (`racing`): the claim
that a policy is better holds however often somebody looks, and whenever he stops.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import betaln, xlog1py, xlogy

from energymargin.act.racing import Duel
from energymargin.base.aliases import Floats
from energymargin.base.checks import open_share, require
from energymargin.base.summary import Summarized

Outcomes = ArrayLike | str | Path
Start = tuple[Any, ...]  # of an episode: its seed; or group and number of its task, and its own

KINDS = ("success", "sum_reward")  # what a file says of each episode, the better one first


@dataclass(frozen=True, eq=False, repr=False)
class OutcomeComparison(Summarized):
    """What the outcomes of two policies say."""

    means: tuple[float, float]
    """Of a and b."""
    intervals: tuple[tuple[float, float], tuple[float, float]]
    """Of each success rate, which hold at every number of episodes; NaN of other scores."""
    wins: int
    """Pairs of episodes in which a did better."""
    losses: int
    """In which it did worse."""
    pairs: int
    better: str
    """"a", "b", or "" where neither is sure."""
    confidence: float
    """What was asked."""
    sure: tuple[float, float]
    """Confidence that a, and that b, does better in most pairs in which they differ: the largest at
    any number of pairs."""
    decided: int | None
    """Pairs after which the confidence that was asked for was reached; None: it was not."""


def compare(a: Outcomes, b: Outcomes, *, confidence: float = 0.95) -> OutcomeComparison:
    """Is one of two policies better, and after how many episodes is that sure?

    Args:
        a, b: outcomes in the order in which they were won, 0 or 1, or any scores of which more is
            better; or a LeRobot `eval_info.json`. Episode k of one is compared with episode k of
            the other: the same start and seed make that sharper, others keep it right. Files with
            seeds are paired by them, those of several tasks by task and episode. What only one has
            does not count.
        confidence: with which "better" is said.

    The claim is anytime-valid: it may be looked at after each episode, and outcomes be added until
    it is sure. Where both are equally good it is made with a probability of at most 1 - confidence.
    Raises ValueError on what is no list of finite numbers, and OSError on a file.
    """
    open_share("confidence", confidence)
    (first, of_first, kind), (second, of_second, other) = _read("a", a), _read("b", b)
    if {kind, other} == set(KINDS):
        way = "expected the same of both: give lists"
        raise ValueError(f"a has each episode's {kind} and b its {other}, {way}")
    if of_first and of_second and len(of_first[0]) == len(of_second[0]):
        both = [start for start in of_first if start in of_second]
        if not both:
            said = "a and b have no seed and no task in common"
            raise ValueError(f"{said}, expected episodes of the same ones")
        first = first[[of_first.index(start) for start in both]]
        second = second[[of_second.index(start) for start in both]]
    pairs = min(len(first), len(second))
    first, second = first[:pairs], second[:pairs]
    won, lost = np.cumsum(first > second).tolist(), np.cumsum(first < second).tolist()
    each = list(zip(won, lost, range(1, pairs + 1), strict=True))
    wins = np.array([Duel(a, b, n).better for a, b, n in each])
    losses = np.array([Duel(b, a, n).better for a, b, n in each])
    # Each of the two claims has half of the errors, so that both together have what was asked.
    needed = 1.0 - (1.0 - confidence) / 2.0
    sure = np.flatnonzero(np.maximum(wins, losses) >= needed)
    decided, better = None, ""
    if len(sure):
        decided, better = int(sure[0]) + 1, "a" if wins[sure[0]] >= needed else "b"
    means = (float(first.mean()), float(second.mean()))
    rates = (_rate(first, confidence), _rate(second, confidence))
    claims = (better, confidence, (float(wins.max()), float(losses.max())), decided)
    return OutcomeComparison(means, rates, won[-1], lost[-1], pairs, *claims)


def _read(name: str, given: Outcomes) -> tuple[Floats, list[Start] | None, str]:
    """Outcomes, where each episode started, and which of KINDS they are, if a file says that."""
    values: Any = given
    starts, kind = None, ""
    if isinstance(given, str | Path):
        values, each, kind = _episodes(Path(given))
        starts = each if None not in each and len(set(each)) == len(each) else None
    try:
        outcomes = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        outcomes = np.zeros((0, 0))
    right = outcomes.ndim == 1 and len(outcomes) and np.isfinite(outcomes).all()
    require(right, name, given, "a list of finite outcomes")
    return outcomes, starts, kind


def _episodes(path: Path) -> tuple[list[Any], list[Any], str]:
    """Outcomes of a LeRobot evaluation, where each episode started, and what they are. Tasks that
    ran in parallel are in the file as they ended: they are put in order, since the first to end may
    be those that went well."""
    try:
        whole = json.loads(path.read_text())
        if "per_episode" in whole:
            episodes = whole["per_episode"]
            kind = KINDS[0 if any(KINDS[0] in one for one in episodes) else 1]
            seeds = [one.get("seed") for one in episodes]
            starts = [None if seed is None else (seed,) for seed in seeds]
            return [one.get(kind) for one in episodes], starts, kind
        tasks = [
            (str(one.get("task_group", "")), one.get("task_id", number), one.get("metrics", one))
            for number, one in enumerate(whole["per_task"])
        ]
        values, places = list[Any](), list[Any]()
        for group, number, task in sorted(tasks, key=lambda one: one[:2]):
            won = np.atleast_1d(task["successes"]).tolist()
            values += won
            places += [(group, number, k) for k in range(len(won))]
        return values, places, KINDS[0]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        expected = "expected a JSON file with per_episode or per_task"
        raise ValueError(f"{path} is no evaluation of LeRobot, {expected}") from error


def _rate(outcomes: Floats, confidence: float) -> tuple[float, float]:
    """The success rates that no bet on the outcomes has refuted at any number of episodes."""
    if not np.isin(outcomes, (0.0, 1.0)).all():
        return float("nan"), float("nan")
    limit, low, high = -np.log(1.0 - confidence), 0.0, 1.0
    won = np.cumsum(outcomes)
    for number, successes in enumerate(won.tolist(), 1):
        failures, rate = number - successes, successes / number
        stake = betaln(successes + 1.0, failures + 1.0)

        def left(p: float, s: float = successes, f: float = failures, bet: float = stake) -> float:
            return float(bet - xlogy(s, p) - xlog1py(f, -p) - limit)

        if successes and left(1e-12) > 0.0:
            low = max(low, float(brentq(left, 1e-12, rate)))
        if failures and left(1.0 - 1e-12) > 0.0:
            high = min(high, float(brentq(left, rate, 1.0 - 1e-12)))
    return low, high
