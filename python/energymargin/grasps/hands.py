"""Hands that grasp: a parallel gripper by numbers or by name, or any hand of a file.

A hand's **grasp frame** is where a grasp's pose puts it: its origin is midway between the pads, z
is the approach, and the fingers open along x.
"""

from __future__ import annotations

import hashlib
import json
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from energymargin import Box, Compound, Joint, Mimic, Pad, Part, Scene, Surface, Tendon, scenes
from energymargin.base import checks
from energymargin.base.checks import numbers_of, positive_number, require
from energymargin.base.plausibility import kept_warnings
from energymargin.grasps.frames import FRAMES, frame_in_hand, pose
from energymargin.grasps.grasp_object import digest

SQUEEZE = 1e-3  # m; how far beyond the object the target is when the drive gives its full force
BEND = 0.02  # rad; the same of a joint that turns: 1 mm at 5 cm
LAG = 5e-3  # s; damping over stiffness of a drive that a file does not have


class Fitted(NamedTuple):
    """A hand in a scene."""

    base: str
    """Its kinematic body, which moves all others."""
    frame: NDArray[np.float64]
    """The grasp frame in the frame of the base, (4, 4)."""
    fingers: tuple[str, ...]
    """Bodies that have to touch a gripped object: one at least on each side."""
    bodies: tuple[str, ...]
    """All bodies of the hand."""
    start: dict[str, float]
    """Positions of the joints while it is open [rad] or [m]."""
    targets: dict[str, tuple[float, float]]
    """Of the driven joints and tendons, open and closed."""


class Hand:
    """A hand: what it adds to a scene, and how long it takes to close."""

    closing: float
    """Time from open to closed, if nothing is between the fingers [s]."""
    friction_rule: str = "product"
    """Of the scene, as of `em.Scene`."""

    @abstractmethod
    def add_to(self, scene: Scene, *, force: float, opening: float) -> Fitted:
        """Adds the hand, at the world's origin, to a scene: a grip with a force [N] of each finger,
        from an opening [m], NaN for the hand's own. Raises ValueError on what it cannot do."""

    @property
    @abstractmethod
    def force(self) -> float:
        """Force of the grip, of each finger [N]; of a file's hand a share of the drives' 1."""

    @property
    @abstractmethod
    def text(self) -> dict[str, Any]:
        """What it is, as JSON: scores of other hands are others."""


SILICONE = Pad()


@dataclass(frozen=True)
class ParallelGripper(Hand):
    """A gripper with two flat fingers that slide towards each other.

    Args:
        opening: the widest, between the pads [m].
        pad: a finger's width, across opening and approach, and length, along the approach [m].
        force: of each finger on what is between them [N].
        friction: coefficient of the fingers; that of a contact is its product with the object's.
        torsional_friction: of the pads [m], as of `em.Surface`: soft ones resist a turn about the
            line between them.
        pads: how soft the fingers are, under the force of the grip: 2 mm of silicone; None: rigid.
        tip: how far the fingers reach beyond the grasp frame, along the approach [m]; None: half
            the pad's length, so that the frame is midway between the pads.
        finger: length of the fingers, from their tips to the palm [m].
        thickness: of a finger, along the opening [m].
        mass: of a finger [kg].
        palm: size of the palm along x, y, z of the grasp frame [m].
        speed: of each finger as it closes [m/s].
        coupled: one drive moves both fingers, so that they meet in the middle and push an object
            that is not there; False: each has its own, and yields.

    Raises ValueError on numbers that cannot be.
    """

    opening: float
    pad: tuple[float, float] = (0.02, 0.02)
    force: float = 20.0
    friction: float = 1.0
    torsional_friction: float = 0.0
    pads: Pad | None = SILICONE
    tip: float | None = None
    finger: float = 0.045
    thickness: float = 0.01
    mass: float = 0.05
    palm: tuple[float, float, float] = (0.2, 0.06, 0.06)
    speed: float = 0.1
    coupled: bool = True

    def __post_init__(self) -> None:
        """Checks all of it."""
        for name in ("pad", "palm"):
            for axis, number in enumerate(getattr(self, name)):
                positive_number(f"{name}[{axis}]", number)
        for name in ("opening", "force", "finger", "thickness", "mass", "speed"):
            positive_number(name, getattr(self, name))
        for name in ("friction", "torsional_friction"):
            checks.not_negative_number(name, getattr(self, name))
        if self.pads is not None:
            checks.check_type("pads", self.pads, Pad, "an em.Pad, or None")
        metres = f"{self.opening:g} m, expected at most 1 m: lengths are in metres"
        if self.opening > 1:
            raise ValueError(f"opening is {metres}")

    @property
    def closing(self) -> float:  # type: ignore[override]
        """As Hand.closing."""
        return self.opening / 2 / self.speed

    @property
    def reach(self) -> float:
        """How far the fingers reach beyond the grasp frame [m]."""
        return self.pad[1] / 2 if self.tip is None else self.tip

    def add_to(self, scene: Scene, *, force: float, opening: float) -> Fitted:
        """As Hand.add_to. Raises ValueError on an opening that it does not have."""
        wide = self.opening if np.isnan(opening) else opening
        if not 0 < wide <= self.opening * 1.001:
            expected = f"expected above 0 and at most the hand's, {self.opening:g} m"
            why = "a wider hand, or another unit of length?"
            raise ValueError(f"opening is {wide:g} m, {expected}: {why}")
        depth = self.finger + self.palm[2] / 2 - self.reach
        palm = Compound([Part(Box(self.palm), position=(0, 0, -depth))])
        rough: dict[str, Any] = {"friction": self.friction, "role": "effector"}
        scene.add_body("hand", palm, mass=1.0, kinematic=True, **rough)
        soft = Surface(torsional_friction=self.torsional_friction)
        if self.pads is not None:
            soft = replace(self.pads, load=force).surface(soft, most=min(self.pad) / 2)
        start = min(wide, self.opening) / 2
        # The drive's force beyond SQUEEZE, damped critically with the masses of what it moves.
        limit, moved = (2 * force, 2 * self.mass) if self.coupled else (force, self.mass)
        drive: Any = {"start": start, "target": 0.0, "limits": (0.0, self.opening / 2)}
        drive |= {"stiffness": limit / SQUEEZE, "torque_limit": limit}
        drive["damping"] = 2 * np.sqrt(limit / SQUEEZE * moved)
        for side, sign in (("left", -1), ("right", 1)):
            place = (sign * self.thickness / 2, 0, self.reach - self.finger / 2)
            shape = Compound([Part(Box((self.thickness, self.pad[0], self.finger)), place)])
            scene.add_body(side, shape, mass=self.mass, surface=soft, **rough)
            joint = {"mimic": Mimic("left")} if side == "right" and self.coupled else drive
            ends: dict[str, Any] = {"parent": "hand", "child": side, "axis": (sign, 0, 0)}
            scene.add_joint(side, type="prismatic", **ends, **joint)
        sides = ("left", "right")
        driven = sides[:1] if self.coupled else sides
        scene.disable_collisions(*sides)
        moves = dict.fromkeys(driven, start), dict.fromkeys(driven, (start, 0.0))
        return Fitted("hand", np.eye(4), sides, ("hand", *sides), *moves)

    @property
    def text(self) -> dict[str, Any]:
        """As Hand.text."""
        rigid = {"pads"} if self.pads is None else set()
        return {name: one for name, one in asdict(self).items() if name not in rigid}


XML_OF_MUJOCO = b"<mujoco"


@dataclass(frozen=True, eq=False)
class HandFile(Hand):
    """A hand of a URDF or MJCF file, moved by its root as a kinematic body.

    Args:
        path: of the file.
        close: by driven joint, or by tendon: where it is when the hand is open, and its target when
            the hand is closed [rad] or [m].
        fingers: links that touch a gripped object, all of them.
        frame: where the grasp frame is: midway between the centres of the pads, z the approach, x
            the way the fingers open. A link of the file that is so; in the frame of the root a
            distance along z [m], a pose (4, 4), or x, y, z and a quaternion x, y, z, w; or a name
            of `em.grasps.FRAMES`.
        closing: time from open to closed [s].
        pads: soft pads of links, by name; others are rigid.
        options: keywords of `em.scenes.from_urdf` or `from_mjcf`, as subtree and joints. A joint of
            `close` in a URDF without a stiffness there gives its effort (`torque_limit`) where it
            is 1 mm or 0.02 rad off its target, with a damping of 5 ms times that stiffness.

    The hand opens as wide as `close` says; the openings of grasps do not count. Raises ValueError
    on what cannot be, and what the readers raise.
    """

    path: str | Path
    close: Mapping[str, tuple[float, float]]
    fingers: Sequence[str]
    frame: ArrayLike | str = field(default_factory=lambda: np.eye(4))
    closing: float = 1.0
    pads: Mapping[str, Pad] | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks all of it but for names, which the first scene does."""
        positive_number("closing", self.closing)
        if self._link is None:
            frame_in_hand(self.frame)
        if not self.close:
            raise ValueError("close is empty, expected the joints that close the hand")
        for name, ends in self.close.items():
            numbers_of(f"close[{name!r}]", ends, "two finite numbers, open and closed", (2,))
        right = self.fingers and not isinstance(self.fingers, str)
        require(right, "fingers", self.fingers, "a list of links, one at least")

    @property
    def friction_rule(self) -> str:  # type: ignore[override]
        """As Hand.friction_rule."""
        return "max" if self._is_mjcf else "product"

    @property
    def force(self) -> float:
        """As Hand.force."""
        return 1.0

    def add_to(self, scene: Scene, *, force: float, opening: float) -> Fitted:
        """As Hand.add_to."""
        way = "leave it out of the belief, or state another torque_limit of its joints in options"
        require(force == 1.0, "force", force, f"that of the file's drives, 1: {way}")
        before = len(scene.bodies)
        self._read(scene)
        bodies = scene.bodies[before:]
        names = [body.name for body in bodies]
        joints = {joint.name for joint in scene.joints}
        driven = joints | {tendon.name for tendon in scene.tendons}
        _require("fingers", self.fingers, names)
        _require("close", self.close, sorted(driven))
        self._require_drives(scene)
        base = next(body.name for body in bodies if body.kinematic)
        start = {name: float(ends[0]) for name, ends in self.close.items() if name in joints}
        targets = {name: (float(a), float(b)) for name, (a, b) in self.close.items()}
        own = (tuple(self.fingers), tuple(names))
        return Fitted(base, self._frame(scene, base), *own, start, targets)

    @property
    def text(self) -> dict[str, Any]:
        """As Hand.text."""
        pads = {link: asdict(pad) for link, pad in (self.pads or {}).items()}
        scene = Scene()
        with kept_warnings():  # those of the reading that counts come
            self._read(scene)
        bodies = [digest((one.shape, one.mass, one.inertial)) for one in scene.bodies]
        read = f"{bodies}{scene.joints}{scene.tendons}".encode()  # as meshes are other files
        return {
            "file": hashlib.sha256(Path(self.path).read_bytes() + read).hexdigest(),
            "close": {name: list(map(float, ends)) for name, ends in self.close.items()},
            "fingers": list(self.fingers),
            "frame": self._link or frame_in_hand(self.frame).tolist(),
            "closing": self.closing,
            "options": json.loads(json.dumps(dict(self.options), default=repr)),
        } | ({"pads": pads} if pads else {})

    @property
    def _link(self) -> str | None:
        """The link that `frame` names."""
        return self.frame if isinstance(self.frame, str) and self.frame not in FRAMES else None

    def _frame(self, scene: Scene, base: str) -> NDArray[np.float64]:
        """The grasp frame in the frame of the base."""
        if self._link is None:
            return frame_in_hand(self.frame)
        places = scenes.body_poses(scene, scene.pack())
        links = {name: pose("frame", (*at, *turn)) for name, (at, turn) in places.items()}
        for row in scene.report:
            if place := getattr(row, "place", None):  # of a frame that is no body
                links[row.name] = links[place[0]] @ pose("frame", place[1])
        known = f"a link of {self.path}, one of {', '.join(links)}, a name of {', '.join(FRAMES)}"
        way = f"a distance along z [m] from the root {base!r}, or a pose"
        require(self._link in links, "frame", self._link, f"{known}, {way}")
        return np.asarray(np.linalg.inv(links[base]) @ links[self._link])

    @property
    def _is_mjcf(self) -> bool:
        return XML_OF_MUJOCO in Path(self.path).read_bytes()

    def _read(self, scene: Scene) -> None:
        where: dict[str, Any] = {"position": (0, 0, 0), "orientation": (0, 0, 0, 1)}
        given = where | {"base": "kinematic", "pads": self.pads} | dict(self.options)
        if not self._is_mjcf:
            scenes.from_urdf(self.path, scene, **{"role": "effector"} | given | self._joints)
            return
        if (root := given.get("subtree")) is None:
            raise ValueError("options has no subtree, expected the body of the model that is moved")
        scenes.from_mjcf(str(self.path), scene, **{"effector": (root,)} | given)

    @cached_property
    def _joints(self) -> dict[str, Any]:
        """Of the joints of a URDF, their drives: what is said, and else the file's efforts."""
        joints = dict(self.options.get("joints", {}))
        for name, (start, target) in self.close.items():
            joints[name] = {"start": start, "target": target} | joints.get(name, {})
        if all("stiffness" in joints[name] for name in self.close):
            return {"joints": joints}
        with kept_warnings():  # those of the reading that counts come
            read = scenes.from_urdf(self.path, **dict(self.options) | {"joints": joints})
        for joint in read.joints:
            name = joint.name.removeprefix(self.options.get("prefix", ""))
            if name in self.close and np.isfinite(joint.torque_limit):
                bend = SQUEEZE if joint.type == "prismatic" else BEND
                drive = {"stiffness": joint.torque_limit / bend}
                joints[name] = drive | {"damping": LAG * drive["stiffness"]} | joints[name]
        return {"joints": joints}

    def _require_drives(self, scene: Scene) -> None:
        """What closes the hand has a drive."""
        driven: list[Joint | Tendon] = [*scene.joints, *scene.tendons]
        for one in driven:
            if one.name in self.close and not one.stiffness > 0:
                way = f"options={{'joints': {{{one.name!r}: {{'torque_limit': 20.0}}}}}}"
                has = "position control" if self._is_mjcf else f"an effort there, or {way}"
                why = f"which {self.path} does not drive, expected one with {has}"
                raise ValueError(f"close names {one.name!r}, {why}")


def _require(name: str, given: Any, there: Sequence[str]) -> None:
    for one in given:
        if one not in there:
            raise ValueError(f"{name} names {one!r}, expected one of {', '.join(there)}")


COLUMNS = ("opening", "pad", "force", "finger", "palm", "thickness", "tip")
ROWS: dict[str, tuple[Any, ...]] = {
    "panda": (0.08, (0.02, 0.02), 40.0, 0.0463, (0.204, 0.063, 0.092), 0.012, 0.0088),
    "robotiq_2f85": (0.085, (0.022, 0.0375), 60.0, 0.07, (0.15, 0.075, 0.09), 0.014),
    # Pads and reach of the model of ros-industrial, force of the maker.
    "robotiq_2f140": (0.14, (0.027, 0.065), 125.0, 0.12, (0.15, 0.075, 0.09), 0.014),
    # Of the model of Drake.
    "wsg_50": (0.11, (0.02, 0.02), 80.0, 0.082, (0.146, 0.05, 0.0725), 0.012),
}
"""By name the COLUMNS of a gripper [m] and [N]; the tip is left out where it is usual."""
PRESETS = {n: ParallelGripper(**dict(zip(COLUMNS, row, strict=False))) for n, row in ROWS.items()}
PANDA = PRESETS["panda"]


def preset(name: str) -> ParallelGripper:
    """A gripper of PRESETS. Raises ValueError on another name."""
    if name not in PRESETS and Path(str(name)).suffix in (".urdf", ".xml"):
        options = "close={'JOINT': (open, closed)}, fingers=['LINK', 'LINK'], frame='LINK'"
        way = f"or of a file em.grasps.HandFile({name!r}, {options})"
        raise ValueError(f"hand is {name!r}, expected one of {', '.join(PRESETS)}, {way}")
    return PRESETS[checks.one_of("hand", name, tuple(PRESETS))]
