"""A recording: how bodies moved, what was repaired, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from energymargin.base.aliases import Floats, Ints
from energymargin.base.checks import whole_number
from energymargin.base.reprs import Record
from energymargin.beliefs import Uncertainty
from energymargin.records.recordings.poses import planar

PLANE = [0, 1, 5]  # x, y and the turn about z, of six errors


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Record):
    """One body over K frames: in the plane, D = 3, or in space, D = 6."""

    poses: Floats
    """x, y [m] and yaw [rad, without jumps], shape (K, 3), or x, y, z [m] and the quaternion
    x, y, z, w, shape (K, 7)."""
    velocities: Floats
    """[m/s, rad/s]: of x, y and yaw, or of x, y and z and the angular velocity about the axes of
    the scene, shape (K, D)."""
    pose_covariances: Floats | None = None
    """Covariances of the poses' errors, shape (K, D, D), from the residuals of a smoothing spline;
    None: they are not known. In space of the position and the rotation vector."""
    velocity_covariances: Floats | None = None
    """Covariances of the velocities' errors, shape (K, D, D); None also of measured velocities."""

    def at(self, frame: int, height: float = 0.0) -> dict[str, Any]:
        """A frame as the keywords that `Scene.pack` takes of a body; `height` is that of a body
        whose motion is in the plane."""
        pose, rate = self.poses[frame], self.velocities[frame]
        if planar(self.poses):
            place: dict[str, Any] = {"position": (*pose[:2], height), "yaw": pose[2]}
            rate = np.array([rate[0], rate[1], 0.0, 0.0, 0.0, rate[2]])
        else:
            place = {"position": pose[:3], "orientation": pose[3:]}
        return {**place, "velocity": rate[:3], "angular_velocity": rate[3:]}


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
    """Frames before all bodies were first seen, or after they were last seen: left out."""

    @property
    def frames(self) -> tuple[int, ...]:
        """All frames with an interpolated pose."""
        return tuple(sorted({*self.missing}.union(*self.unseen.values(), *self.outliers.values())))

    def __str__(self) -> str:
        """The counts, as text."""
        counts = {"missing frames filled": self.missing}
        counts |= {f"poses of the {body} not seen, filled": n for body, n in self.unseen.items()}
        counts |= {f"outliers of the {body} replaced": n for body, n in self.outliers.items()}
        counts["frames at its ends left out"] = self.left_out
        words = ", ".join(f"{len(n)} {what}" for what, n in counts.items() if n)
        return words or "nothing repaired"


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Record):
    """K frames of bodies that move, as a camera saw them."""

    name: str
    """The file's."""
    frames: Ints
    """The camera's number of each frame, shape (K,)."""
    times: Floats
    """[s], shape (K,); they rise, not always by the same step."""
    bodies: dict[str, Motion]
    """Their motions by name, as "object" and "effector"."""
    repairs: Repairs

    @property
    def object(self) -> Motion:
        """The motion of the body "object"."""
        return self.bodies["object"]

    @property
    def effector(self) -> Motion:
        """The motion of the body "effector"."""
        return self.bodies["effector"]

    def __len__(self) -> int:
        """K, the number of frames."""
        return len(self.times)

    def in_scene(self, object: str = "object", effector: str = "effector") -> dict[str, Motion]:
        """The motions by the names of their bodies in a scene: those of the bodies "object" and
        "effector" are given, all others keep their own. Raises ValueError if two have one name."""
        given = {"object": object, "effector": effector}
        names = [given.get(body, body) for body in self.bodies]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two bodies are both {name!r}, expected names of their own")
        return dict(zip(names, self.bodies.values(), strict=True))

    def uncertainty(
        self, frame: int, object: str = "object", effector: str = "effector"
    ) -> Uncertainty:
        """How well a frame, from 0 to K - 1, is known, for a belief about its state.

        The covariances of all bodies' poses and velocities, as the spline's residuals tell them;
        with the names of the bodies in a scene. Raises ValueError on another frame, and on a
        recording with velocities of its own, whose errors nothing tells.
        """
        frame = whole_number("frame", frame, 0, len(self) - 1)
        given: dict[str, dict[str, Floats]] = {"pose": {}, "velocity": {}}
        for name, motion in self.in_scene(object, effector).items():
            if motion.pose_covariances is None or motion.velocity_covariances is None:
                raise ValueError(
                    f"{self.name} has velocities of {name!r}, whose errors nothing tells, expected "
                    "poses alone; em.beliefs.Uncertainty(pose=..., velocity=...) takes your own"
                )
            axes = PLANE if planar(motion.poses) else list(range(6))
            known = {"pose": motion.pose_covariances, "velocity": motion.velocity_covariances}
            for quantity, covariances in known.items():
                given[quantity][name] = np.zeros((6, 6))
                given[quantity][name][np.ix_(axes, axes)] = covariances[frame]
        return Uncertainty(**given)
