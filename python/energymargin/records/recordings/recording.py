"""A recording of two bodies, and its frames as states of a scene without overlaps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Scene, World
from energymargin.base.checks import positive_number, whole_number
from energymargin.base.reprs import Record
from energymargin.model.beliefs.uncertainty import Uncertainty
from energymargin.model.scenes import moved_apart

MOST_OVERLAP = 0.01  # m; an arm's error of 5 to 8 mm, and a camera's
UPRIGHT = 1e-6
PLANE = [0, 1, 5]  # x, y and the turn about z, of six errors


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Record):
    """One body in the plane, over K frames."""

    poses: NDArray[np.float64]
    """x, y [m] and yaw [rad, without jumps], shape (K, 3)."""
    velocities: NDArray[np.float64]
    """Their rates [m/s, rad/s], shape (K, 3)."""
    pose_covariances: NDArray[np.float64] | None = None
    """Covariances of the poses' errors, shape (K, 3, 3), from the residuals of a smoothing spline;
    None: they are not known."""
    velocity_covariances: NDArray[np.float64] | None = None
    """Covariances of the rates' errors, shape (K, 3, 3); None also of rates that were measured."""


@dataclass(frozen=True, repr=False)
class Repairs(Record):
    """Frames whose poses are interpolated or left out, by the camera's numbers."""

    missing: tuple[int, ...] = ()
    """Frames that the file does not have: interpolated."""
    unseen: dict[str, tuple[int, ...]] = field(default_factory=dict, hash=False)
    """By body, the frames in which its marker was not seen: interpolated."""
    outliers: dict[str, tuple[int, ...]] = field(default_factory=dict, hash=False)
    """By body, the frames in which its marker jumped: interpolated."""
    left_out: tuple[int, ...] = ()
    """Frames before both bodies were first seen, or after they were last seen: left out."""

    @property
    def frames(self) -> tuple[int, ...]:
        """All frames with an interpolated pose."""
        return tuple(sorted({*self.missing}.union(*self.unseen.values(), *self.outliers.values())))

    def __str__(self) -> str:
        """The counts, as text."""
        counts = [
            (len(self.missing), "missing frames filled"),
            *((len(n), f"poses of the {body} not seen, filled") for body, n in self.unseen.items()),
            *((len(n), f"outliers of the {body} replaced") for body, n in self.outliers.items()),
            (len(self.left_out), "frames at its ends left out"),
        ]
        return ", ".join(f"{count} {what}" for count, what in counts if count) or "nothing repaired"


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Record):
    """K frames of two bodies in the plane, as a camera saw them."""

    name: str
    """The file's."""
    frames: NDArray[np.int64]
    """The camera's number of each frame, shape (K,)."""
    times: NDArray[np.float64]
    """[s], shape (K,); they rise, not always by the same step."""
    object: Motion
    effector: Motion
    repairs: Repairs

    def __len__(self) -> int:
        """K, the number of frames."""
        return len(self.times)

    def uncertainty(
        self, frame: int, object: str = "object", effector: str = "effector"
    ) -> Uncertainty:
        """How well a frame, from 0 to K - 1, is known, for a belief about its state.

        The covariances of both bodies' poses and velocities in the plane, as the spline's residuals
        tell them; with the names of the bodies in a scene. Raises ValueError on another frame, and
        on a recording with velocities of its own, whose errors nothing tells.
        """
        frame = whole_number("frame", frame, 0, len(self) - 1)
        given: dict[str, dict[str, NDArray[np.float64]]] = {"pose": {}, "velocity": {}}
        for name, motion in ((object, self.object), (effector, self.effector)):
            if motion.pose_covariances is None or motion.velocity_covariances is None:
                raise ValueError(
                    f"{self.name} has velocities of {name!r}, whose errors nothing tells, expected "
                    "poses alone; em.beliefs.Uncertainty(pose=..., velocity=...) takes your own"
                )
            given["pose"][name] = _in_space(motion.pose_covariances[frame])
            given["velocity"][name] = _in_space(motion.velocity_covariances[frame])
        return Uncertainty(**given)


@dataclass(frozen=True, eq=False, repr=False)
class Placed(Record):
    """K frames of a recording in a scene."""

    states: NDArray[np.float64]
    """State vector of each frame, shape (K, n)."""
    moved: NDArray[np.float64]
    """Distances by which object and effector were moved out of an overlap [m], shape (K, 2)."""
    stuck: NDArray[np.bool_]
    """Frames as measured, whose bodies overlap wherever they are moved to, shape (K,)."""


def placed(
    recording: Recording,
    scene: Scene,
    *,
    object: str = "object",
    effector: str = "effector",
    most_overlap: float = MOST_OVERLAP,
) -> Placed:
    """The recording's frames as states of a scene.

    x, y, yaw and their rates are those of the recording, all else, as heights, is that of the
    scene. Bodies that overlap are moved until they touch: the object out of what
    stands in the scene, the effector out of the object. Raises ValueError on a body that is
    unknown, fixed or tilted in the scene, where a body would be moved by more than `most_overlap`
    [m], and if no frame at all has a place for both, as between two others.
    """
    most_overlap = positive_number("most_overlap", most_overlap)
    names = (object, effector)
    if object == effector:
        raise ValueError(f"object and effector are both {object!r}, expected two bodies")
    for name in names:
        _require_upright(scene, name)
    world = World(scene)
    measured = np.stack([_packed(recording, scene, names, k) for k in range(len(recording))])
    states, reasons = measured.copy(), {}
    for k, number in enumerate(recording.frames.tolist()):
        try:
            states[k] = moved_apart(world, measured[k], names)
        except ValueError as error:
            reasons[k] = f"{recording.name}, frame {number}: {error}"
    if len(reasons) == len(recording):
        raise ValueError(f"{reasons[0]}; so it is in every frame: do the shapes fit?")
    stuck = np.isin(np.arange(len(recording)), list(reasons))
    moved = np.stack([_distances(scene, name, measured, states) for name in names], axis=1)
    if moved.max() > most_overlap:
        k, body = divmod(int((moved > most_overlap).argmax()), 2)
        raise ValueError(
            f"{recording.name}, frame {recording.frames[k]}: {names[body]!r} overlaps others by "
            f"{moved[k, body]:.3g} m, expected at most most_overlap = {most_overlap:g} m: do the "
            "shapes, the units and the origin of the camera's frame fit?"
        )
    return Placed(states, moved, stuck)


def _packed(
    recording: Recording, scene: Scene, names: tuple[str, str], k: int
) -> NDArray[np.float64]:
    """The state of a frame, as measured."""
    heights = {body.name: body.position[2] for body in scene.bodies}
    bodies = {}
    for name, motion in zip(names, (recording.object, recording.effector), strict=True):
        x, y, yaw = motion.poses[k]
        vx, vy, yaw_rate = motion.velocities[k]
        bodies[name] = {
            "position": (x, y, heights[name]),
            "yaw": yaw,
            "velocity": (vx, vy, 0.0),
            "angular_velocity": (0.0, 0.0, yaw_rate),
        }
    return np.asarray(scene.pack(**bodies))


def _in_space(planar: NDArray[np.float64]) -> NDArray[np.float64]:
    """A covariance (6, 6) from that of x, y and yaw: all else is known."""
    whole = np.zeros((6, 6))
    whole[np.ix_(PLANE, PLANE)] = planar
    return whole


def _require_upright(scene: Scene, name: str) -> None:
    """Raises ValueError unless this is a free body that is turned about z alone."""
    first = scene.slice(name).start
    x, y, *_ = scene.pack()[first + 3 : first + 7]
    if math.hypot(x, y) > UPRIGHT:
        raise ValueError(
            f"body {name!r} is tilted in the scene, expected one that is turned about z alone"
        )


def _distances(
    scene: Scene, body: str, before: NDArray[np.float64], after: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How far a body was moved in each state [m], shape (K,)."""
    first = scene.slice(body).start
    return np.asarray(np.linalg.norm((after - before)[:, first : first + 3], axis=1))
