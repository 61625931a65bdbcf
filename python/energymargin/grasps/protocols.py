"""Protocols: what happens to a grasp after the hand has closed, and when it counts as lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin import motions
from energymargin.base.checks import check_type, not_negative_number, one_of, positive_number

GRAVITY = 9.81  # m/s^2
GRAVITIES = ("always", "closed", "never")
KINDS = ("hold", "lift", "turn", "shake", "swing", "open")


@dataclass(frozen=True)
class Motion:
    """A part of a protocol: one motion of the hand.

    Args:
        kind: "hold" stands still, "lift" moves by `amount`, "turn" turns by it, "shake" swings
            along an axis and "swing" about it with this amplitude, see `em.motions`; "open" opens
            the hand, which stands still.
        duration: [s]
        amount: [m], or [rad] of "turn" and "swing".
        axis: along or about which.
        frame: whose axis it is: that of the "world", or of the "hand", its grasp frame, in which x
            is the way the fingers open and z the approach. It turns with the hand.
        frequency: of "shake" and "swing" [Hz].

    Raises ValueError on what cannot be.
    """

    kind: str
    duration: float
    amount: float = 0.0
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    frame: str = "world"
    frequency: float = 0.0

    def __post_init__(self) -> None:
        """Checks all of it."""
        one_of("kind", self.kind, KINDS)
        one_of("frame", self.frame, ("world", "hand"))
        self.rows(np.eye(3), motions.STEP)

    def rows(self, hand: NDArray[np.float64], step: float) -> NDArray[np.float64]:
        """Velocities of the hand, (K, 6), from an orientation, (3, 3), on."""
        axis = hand @ np.array(self.axis) if self.frame == "hand" else np.array(self.axis)
        if self.kind in ("hold", "open"):
            return motions.hold(self.duration, step=step)
        if self.kind == "lift":
            return motions.lift(self.amount, self.duration, direction=axis, step=step)
        if self.kind == "turn":
            return motions.turn(axis, self.amount, self.duration, step=step)
        asked = (axis, self.amount, self.frequency, self.duration)
        return motions.shake(*asked, about=self.kind == "swing", step=step)


@dataclass(frozen=True)
class Protocol:
    """What is done with a grasp.

    The hand closes while the object is held in its place or stands on a table; then gravity and the
    disturbance act, and the hand goes through its motions. The grasp holds if the object stays
    where it was gripped, in the hand's frame.

    Args:
        motions: one after the other.
        radius: the object's centre of mass may move so far in the hand [m].
        angle: the object may turn so far in the hand [rad]; None: as far as it likes.
        touching: both sides of the hand have to touch it throughout; they may lose it for `dwell`.
        dwell: how long it has to be out to be lost [s].
        gravity: acts "always", from when the hand has "closed" on, or "never". None: "always" with
            a table, where nothing else can be, and else "closed".
        table: a table stands under the object, and is in the way of the hand.
        approach: how far back along its approach the open hand starts [m]. It comes at .1 m/s, and
            pushes what it meets; one that presses with more than 40 N for longer than 10 ms has
            collided. 0: it starts where the grasp says. Needs a table.
        settle: how long the hand may take to come to rest after it has closed [s].
        force, torque: the largest disturbance along and about each axis, as multiples of the
            object's weight, and of its weight times 1 cm; in "never", of the weight it would have.
        duration: the longest that one draw of the disturbance acts [s].

    Raises ValueError on what cannot be.
    """

    motions: Sequence[Motion]
    radius: float = 0.1
    angle: float | None = None
    touching: bool = True
    dwell: float = 0.05
    gravity: str | None = None
    table: bool = False
    approach: float = 0.0
    settle: float = 0.15
    force: float = 0.5
    torque: float = 0.5
    duration: float = 0.2

    def __post_init__(self) -> None:
        """Checks all of it."""
        if not self.motions:
            raise ValueError("motions is empty, expected one Motion at least, as Motion('hold', 1)")
        for motion in self.motions:
            check_type("motions", motion, Motion, "Motions")
        object.__setattr__(self, "motions", tuple(self.motions))
        if self.gravity is None:
            object.__setattr__(self, "gravity", "always" if self.table else "closed")
        one_of("gravity", str(self.gravity), GRAVITIES)
        if self.table and self.gravity != "always":
            raise ValueError(f"gravity is {self.gravity!r}, expected 'always' with a table")
        for name in ("radius", "duration"):
            positive_number(name, getattr(self, name))
        for name in ("approach", "dwell", "settle", "force", "torque"):
            not_negative_number(name, getattr(self, name))
        if self.approach and not self.table:
            why = "what it met would fly off; table=True, or the preset 'lift'"
            raise ValueError(f"approach is {self.approach:g} m, expected 0 without a table: {why}")
        if self.angle is not None:
            positive_number("angle", self.angle)

    def __hash__(self) -> int:
        """Equal protocols have equal hashes."""
        return hash(repr(self))

    @property
    def horizon(self) -> float:
        """Duration of all motions [s]."""
        return sum(motion.duration for motion in self.motions)

    def rows(self, hand: NDArray[np.float64], step: float) -> NDArray[np.float64]:
        """Velocities of the hand, (K, 6), that starts with an orientation, (3, 3)."""
        from scipy.spatial.transform import Rotation

        parts = []
        for motion in self.motions:
            rows = motion.rows(hand, step)
            hand = Rotation.from_rotvec(rows[:, 3:].sum(axis=0) * step).as_matrix() @ hand
            parts.append(rows)
        return np.concatenate(parts)

    def shares(self, step: float) -> NDArray[np.float64]:
        """How far the hand is open in each step, from 0, closed, to 1, (K,)."""
        parts, now = [np.zeros(0)], 0.0
        for motion in self.motions:
            count = len(motion.rows(np.eye(3), step))
            opens = motion.kind == "open"
            parts.append(np.linspace(now, 1.0, count) if opens else np.full(count, now))
            now = 1.0 if opens else now
        return np.concatenate(parts)

    @property
    def text(self) -> dict[str, Any]:
        """All of it, as JSON."""
        unused = set() if self.approach else {"approach"}
        return {name: value for name, value in asdict(self).items() if name not in unused}


HOLD = Protocol([Motion("hold", 1.0)])
LIFT = Protocol([Motion("lift", 1.0, 0.2), Motion("hold", 0.5)], table=True)
QUARTER = float(np.pi / 4)
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
TO, BACK = Motion("turn", 0.5, QUARTER, Y, "hand"), Motion("turn", 1.0, -2 * QUARTER, Y, "hand")
GRASPA = replace(LIFT, motions=(LIFT.motions[0], TO, BACK, TO))
SHAKEN = Motion("shake", 1.5, 0.05, Z, "hand", 2.0)
ACRONYM = Protocol([SHAKEN, Motion("swing", 1.5, 0.5, X, "hand", 2.0)], gravity="never")
SHAKES = [Motion("shake", 1.0, 0.05, axis, "hand", 3.0) for axis in (X, Y, Z)]
SHAKE = Protocol([*SHAKES, *(Motion("swing", 1.0, 0.5, axis, "hand", 2.0) for axis in (X, Y))])
RELEASE = Protocol([Motion("open", 0.4), Motion("lift", 0.6, -0.1, frame="hand")])
"""A thing is let go, and the hand backs off along its approach."""
PRESETS = {"hold": HOLD, "lift": LIFT, "graspa": GRASPA, "acronym": ACRONYM, "shake": SHAKE}
PRESETS["release"] = RELEASE


def protocol_of(protocol: Protocol | str) -> Protocol:
    """A protocol, or a preset by its name. Raises ValueError on another name."""
    if isinstance(protocol, Protocol):
        return protocol
    return PRESETS[one_of("protocol", protocol, tuple(PRESETS))]
