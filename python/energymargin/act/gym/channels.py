"""The numbers of an action: what of a task's drive is the agent's, and within which bounds.

What is not, such as the table that sinks under a grasp, follows the task's script.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from energymargin.base.checks import whole_number
from energymargin.tasks import balance, grasp, push, push_multi, scoop, topple
from energymargin.tasks.scripted import Drive

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
    copied = deepcopy(drive)
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
