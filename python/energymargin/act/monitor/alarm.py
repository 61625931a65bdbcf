"""An alarm, its threshold from data, and what it then announces.

Split conformal prediction by trajectory. The statistic of a trajectory is the lowest threshold that
would raise a false alarm on it: of an alarm at the first value, its least value over the frames in
which an alarm would be false. Trajectories that are drawn alike are exchangeable, so a new one has
a statistic below the k-th smallest of n with a probability of at most k / (n + 1) (Vovk, Gammerman
and Shafer, Algorithmic Learning in a Random World, 2005), whatever the score and the task.
Trajectories on which no threshold would raise a false alarm are left out of n, so the statement is
about those on which one can be false.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin.act.monitor.stream import Conditions
from energymargin.base import checks
from energymargin.base.checks import numbers_of, open_share, require, whole_number
from energymargin.base.reprs import Record

Lost = Sequence[int | None]
"""By trajectory, the frame of its loss; None if it holds to its end."""


@dataclass(frozen=True)
class Alarm:
    """An alarm with hysteresis; raises ValueError on numbers that cannot be.

    It goes on once `count` of the last `window` values are below `on`, and off once as many are at
    least `off`.
    """

    on: float
    """The threshold."""
    off: float | None = None
    """At least `on`, which it is if not given."""
    count: int = 1
    window: int = 1
    from_data: bool = False
    """Whether `on` is a threshold from data, which holds under the `conditions` alone."""
    conditions: Conditions | None = None
    """Those; None is not known, or `on` is a number of yours."""

    def __post_init__(self) -> None:
        """Checks them."""
        for name, value in (("on", self.on), ("off", self.until)):
            number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            require(number and not math.isnan(value), name, value, "a number")
        require(self.until >= self.on, "off", self.off, f"at least on = {self.on:g}")
        whole_number("window", self.window, 1)
        whole_number("count", self.count, 1, self.window)

    @property
    def until(self) -> float:
        """`off`, or `on` if that is not given."""
        return self.on if self.off is None else self.off

    def holds_for(self) -> Conditions | None:
        """What a threshold from data holds for; None of another. ValueError where that is not
        known."""
        if self.from_data and self.conditions is None:
            said = f"alarm is of a threshold of {self.on:g} that does not say what it holds for"
            way = "threshold(..., conditions=Conditions(rollouts, horizon, period))"
            raise ValueError(f"{said}, expected one of {way}")
        return self.conditions if self.from_data else None

    def after(self, recent: Sequence[float], *, is_on: bool) -> bool:
        """Whether it is on after the `recent` values, the last one last, if it was `is_on` before.

        Only the last `window` of them count.
        """
        last = np.asarray(recent, dtype=float)[-self.window :]
        if np.count_nonzero(last < self.on) >= self.count:
            return True
        return is_on and int(np.count_nonzero(last >= self.until)) < self.count

    def follow(self, values: ArrayLike) -> NDArray[np.bool_]:
        """Whether it is on at each of K values, shape (K,), one after the other.

        NaN is a frame without a value: the alarm stays as it was.
        """
        numbers = _values_of("values", values)
        states, is_on, seen = np.zeros(len(numbers), dtype=bool), False, list[float]()
        for k, value in enumerate(numbers.tolist()):
            if not math.isnan(value):
                seen = [*seen, value][-self.window :]
                is_on = self.after(seen, is_on=is_on)
            states[k] = is_on
        return states


@dataclass(frozen=True, eq=False, repr=False)
class Threshold(Record):
    """A threshold with its guarantee.

    Over draws of the n calibration trajectories and of a new one that is drawn like them, the new
    one has a false alarm with a probability of at most `level`.
    """

    value: float
    """An alarm goes on below it."""
    level: float
    """k / (n + 1), at most the share that was asked for."""
    statistics: NDArray[np.float64] = field(repr=False)
    """Lowest thresholds at which an alarm would be false, one for each of the n trajectories on
    which one can be, shape (n,), rising."""
    rank: int
    """k: the threshold is the k-th smallest statistic."""
    count: int
    """As in Alarm."""
    window: int
    """As in Alarm."""
    announced: Alarms
    """What the alarm does on the calibration trajectories themselves: the lead time it buys."""
    conditions: Conditions | None = None
    """What it holds for; None is not known, and no Monitor takes it."""

    def alarm(self, off: float | None = None) -> Alarm:
        """The alarm, which goes off at `off`."""
        return Alarm(self.value, off, self.count, self.window, True, self.conditions)

    def coverage(self, confidence: float = 0.9) -> tuple[float, float]:
        """(low, high) of the share of false alarms that these n trajectories may have led to.

        The level is its mean over calibrations at most; the share of one calibration is Beta(k, n +
        1 - k) if no two statistics are equal, and less if some are.
        """
        from scipy.stats import beta

        open_share("confidence", confidence)
        tails = ((1 - confidence) / 2, (1 + confidence) / 2)
        low, high = beta.ppf(tails, self.rank, len(self.statistics) + 1 - self.rank)
        return float(low), float(high)


@dataclass(frozen=True, eq=False, repr=False)
class Alarms(Record):
    """What an alarm does on N trajectories."""

    false: NDArray[np.bool_]
    """Whether it is on at a frame in which that is false, shape (N,)."""
    possible: NDArray[np.bool_]
    """Whether an alarm can be false, shape (N,)."""
    lost: NDArray[np.float64]
    """Frame of the loss, shape (N,); NaN of a trajectory that holds."""
    leads: NDArray[np.float64]
    """Frames from the alarm to the loss, shape (N,); 0 of a loss that comes without one, NaN of a
    trajectory that holds."""

    def announced(self, least: int = 1) -> tuple[int, int]:
        """How many losses are announced at least so many frames before, and of how many losses.

        Those count that have so many frames before them.
        """
        frames = whole_number("least", least, 1)
        can = self.lost >= frames
        return int((self.leads[can] >= frames).sum()), int(can.sum())

    @property
    def false_alarms(self) -> tuple[int, int]:
        """How many trajectories have a false alarm, and of how many that can have one."""
        return int(self.false.sum()), int(self.possible.sum())


def threshold(
    values: Sequence[ArrayLike],
    lost: Lost,
    *,
    false_alarms: float = 0.05,
    ahead: int | None = None,
    count: int = 1,
    window: int = 1,
    conditions: Conditions | None = None,
) -> Threshold:
    """The highest threshold with at most so many false alarms a trajectory.

    Args:
        values: of each calibration trajectory the scores of its frames, shape (K,), higher where it
            is safer; NaN of a frame without one. Whole trajectories that are drawn like those to
            come.
        lost: of each trajectory the frame of its loss, or None (`first_loss`).
        false_alarms: the share of the trajectories that may have one.
        ahead: an alarm is right in so many frames before a loss, and false before those. None: it
            is right anywhere before a loss. On a trajectory that holds every alarm is false.
        count: as of Alarm.
        window: as of Alarm.
        conditions: how the scores were made, for a Monitor, which makes its own so too.

    Trajectories on which no alarm can be false do not count, as they have no such frame, fewer than
    `count`, or only values of inf: the guarantee is for the others. Raises ValueError on bad
    arguments, and on too few trajectories: n have to be at least 1 / false_alarms - 1, 19 for 5 %.
    """
    open_share("false_alarms", false_alarms)
    Alarm(0.0, count=count, window=window)  # checks them
    parts = _trajectories(values, lost, ahead)
    found = [_lowest(part.values[: part.false_until], count, window) for part in parts]
    statistics = np.sort([low for low in found if low is not None])
    n = len(statistics)
    rank = math.floor(false_alarms * (n + 1) + 1e-9)
    if rank < 1:
        least = math.ceil(1 / false_alarms - 1 - 1e-9)
        expected = f"expected at least {least} for false_alarms = {false_alarms:g}"
        raise ValueError(f"values has {n} trajectories in which an alarm can be false, {expected}")
    value = float(statistics[rank - 1])
    announced = alarms(values, lost, Alarm(value, count=count, window=window), ahead=ahead)
    return Threshold(value, rank / (n + 1), statistics, rank, count, window, announced, conditions)


def alarms(
    values: Sequence[ArrayLike], lost: Lost, alarm: Alarm, *, ahead: int | None = None
) -> Alarms:
    """What an alarm does on trajectories. Arguments and errors: as `threshold`."""
    rows = []
    for part in _trajectories(values, lost, ahead):
        on, until = alarm.follow(part.values), part.false_until
        possible = _lowest(part.values[:until], alarm.count, alarm.window) is not None
        loss = np.nan if part.lost is None else part.lost
        right = np.flatnonzero(on[until:])
        lead = loss - until - right[0] if len(right) else 0.0 * loss  # NaN without a loss
        rows.append((on[:until].any(), possible, loss, lead))
    false, can_be, losses, leads = np.array(rows, float).reshape(-1, 4).T
    return Alarms(false.astype(bool), can_be.astype(bool), losses, leads)


def first_loss(captured: ArrayLike, succeeded: ArrayLike | None = None) -> int | None:
    """The first frame that is not captured, of K labels, shape (K,); None if there is none.

    `succeeded`: whether each frame is in the success set, shape (K,); such a frame is no loss.
    """
    labels = _labels_of("captured", captured, None)
    if succeeded is not None:
        labels |= _labels_of("succeeded", succeeded, len(labels))
    outside = np.flatnonzero(~labels)
    return int(outside[0]) if len(outside) else None


def _labels_of(name: str, given: ArrayLike, count: int | None) -> NDArray[np.bool_]:
    labels = np.array(given)
    checks.check_shape(name, labels, (labels.size if count is None else count,), bool)
    return labels


@dataclass(frozen=True, eq=False)
class _Part:
    """The frames of one trajectory before its loss."""

    values: NDArray[np.float64]
    lost: int | None
    false_until: int
    """An alarm is false in the frames before this one."""


def _trajectories(values: Sequence[ArrayLike], lost: Lost, ahead: int | None) -> list[_Part]:
    if len(values) != len(lost):
        raise ValueError(f"lost has {len(lost)} frames, expected {len(values)}, one a trajectory")
    near = None if ahead is None else whole_number("ahead", ahead, 1)
    parts = []
    for number, (given, frame) in enumerate(zip(values, lost, strict=True)):
        numbers = _values_of(f"values[{number}]", given)
        false_until = len(numbers)
        loss = None if frame is None else whole_number(f"lost[{number}]", frame, 0, len(numbers))
        if loss is not None:
            false_until = 0 if near is None else max(loss - near, 0)
        parts.append(_Part(numbers[:loss], loss, false_until))
    return parts


def _lowest(values: NDArray[np.float64], count: int, window: int) -> float | None:
    """An alarm goes on at some frame if its threshold is above this; None if none ever does."""
    seen = values[~np.isnan(values)]
    spans = (seen[max(0, k + 1 - window) : k + 1] for k in range(count - 1, len(seen)))
    low = float(min((np.sort(span)[count - 1] for span in spans), default=math.inf))
    return None if low == math.inf else low


def _values_of(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Values of K frames, shape (K,); ValueError with `name` on anything else."""
    numbers = numbers_of(name, values, "numbers, one a frame")
    if numbers.ndim != 1:
        raise ValueError(f"{name} has shape {numbers.shape}, expected (K,), one a frame")
    return numbers
