"""A compiled MuJoCo model: its start, the bodies of it that become a scene's, and what of it is not
simulated: counted, named, and left out if that is meant."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type
from energymargin.base.errors import needs_extra
from energymargin.base.plausibility import warn
from energymargin.base.reprs import Record
from energymargin.model.scenes import reports
from energymargin.model.scenes.additions import counted, warn_of_loose
from energymargin.model.scenes.files import require_robot
from energymargin.model.scenes.poses import Pose, pose
from energymargin.model.scenes.reports import ReportRow

COPYING = ("replicate", "composite", "flexcomp")
# Of a model with copies; MuJoCo 3.11 takes 4 s for 10,000 geoms, and grows with the square of that.
MOST_ELEMENTS = 100_000
CENTRAL = 1e-6  # m; a centre of mass so near to a frame's origin is there
MASSLESS = 1e-15  # kg; MuJoCo's least mass of what moves
WORLD = 0


def engine() -> Any:
    """The module `mujoco`; ImportError that names the extra."""
    with needs_extra("a model of MuJoCo", "mujoco"):
        import mujoco
    return mujoco


def control_address(model: Any, actuator: int) -> int:
    """Where an actuator's control is in `ctrl`; in MuJoCo 4 one may have several."""
    addresses = getattr(model, "actuator_ctrladr", None)
    return actuator if addresses is None else int(addresses[actuator])


def compiled(source: Any) -> Any:
    """The MjModel of a file, of XML text, or itself.

    Raises FileNotFoundError, and ValueError with what MuJoCo says of the file.
    """
    mujoco = engine()
    if isinstance(source, mujoco.MjModel):
        return source
    check_type("model", source, str | Path, "a path, XML or an MjModel")
    text = isinstance(source, str) and "<" in source
    if not text:
        require_robot(source)
    if not text and not Path(source).is_file():
        raise FileNotFoundError(f"there is no file {str(source)!r}")
    try:
        root = ET.fromstring(str(source)) if text else ET.parse(source).getroot()
        _require_few(root, Path() if text else Path(source).parent)
    except (ET.ParseError, OSError, RecursionError):
        pass  # MuJoCo says what is wrong
    load = mujoco.MjModel.from_xml_string if text else mujoco.MjModel.from_xml_path
    return load(str(source))


def _require_few(root: ET.Element, folder: Path) -> None:
    """Raises ValueError if the copies that a file asks for would fill the memory."""
    asked, seen = list[str](), set[Path]()

    def size(element: ET.Element) -> int:
        """Number of elements that one becomes."""
        copies, file = 1, folder / element.get("file", "")
        if element.tag in COPYING and element.get("count"):
            asked.append(f"<{element.tag} count={element.get('count')!r}>")
            counts = element.get("count", "").split()
            copies = math.prod(int(count) for count in counts if count.isdecimal())
        if element.tag == "include" and file.is_file() and file not in seen:
            seen.add(file)
            return size(ET.parse(file).getroot())
        return copies * (1 + sum(map(size, element)))

    elements = size(root)
    if asked and elements > MOST_ELEMENTS:
        wrong = f"the model asks for {elements} elements by {', '.join(asked[:3])}"
        raise ValueError(f"{wrong}, expected at most {MOST_ELEMENTS}")


def word(enum: str, value: Any) -> str:
    """A member of an enum of MuJoCo's: ("mjtGeom", 2) is "sphere"."""
    name: str = getattr(engine(), enum)(int(value)).name
    return name.partition("_")[2].lower()


def disabled(model: Any, what: str) -> bool:
    """Whether the model switches something off, as "CONTACT"."""
    flag = getattr(engine().mjtDisableBit, f"mjDSBL_{what}")
    return bool(int(model.opt.disableflags) & int(flag))


def name_of(model: Any, kind: str, number: int) -> str:
    """The name of a "body", "joint" or "geom"; of one without: `body3`."""
    return getattr(model, kind)(number).name or f"{kind}{number}"


def local_pose(position: Any, quaternion: Any) -> Pose:
    """From MuJoCo's position (3,) and quaternion w, x, y, z."""
    return pose(position, np.roll(np.asarray(quaternion), -1).tolist())


@dataclass(frozen=True, eq=False, repr=False)
class ModelStart(Record):
    """Where a model is when its scene begins."""

    positions: Floats
    """MuJoCo's qpos (nq,)."""
    velocities: Floats
    """MuJoCo's qvel (nv,)."""
    control: Floats
    """MuJoCo's ctrl, within the actuators' ranges."""
    poses: list[Pose]
    """Poses of the bodies in the world."""
    twists: Floats
    """Angular and linear velocity of the bodies' frames along the world's axes, (nbody, 6)."""


def start_of(model: Any, data: Any, keyframe: str | int | None) -> ModelStart:
    """That of an MjData, of a keyframe, or of a fresh MjData.

    Raises ValueError if both are given, and on an unknown keyframe.
    """
    mujoco = engine()
    own = mujoco.MjData(model)
    if data is not None and keyframe is not None:
        raise ValueError(f"keyframe is {keyframe!r} beside data, expected one of the two")
    if keyframe is not None:
        mujoco.mj_resetDataKeyframe(model, own, _keyframe(model, keyframe))
    elif data is not None:
        for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
            getattr(own, name)[:] = getattr(data, name)
    for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
        step(model, own)
    twists = np.zeros((model.nbody, 6))
    for body in range(model.nbody):
        of = (mujoco.mjtObj.mjOBJ_XBODY, body, twists[body], 0)
        mujoco.mj_objectVelocity(model, own, *of)
    poses = [local_pose(p, q / np.linalg.norm(q)) for p, q in zip(own.xpos, own.xquat, strict=True)]
    control = np.array(own.ctrl)
    limited = np.asarray(model.actuator_ctrllimited, bool)
    if control.size == limited.size and not disabled(model, "CLAMPCTRL"):
        low, high = np.asarray(model.actuator_ctrlrange).T
        control[limited] = np.clip(control, low, high)[limited]
    return ModelStart(np.array(own.qpos), np.array(own.qvel), control, poses, twists)


def _keyframe(model: Any, keyframe: str | int) -> int:
    names = [model.key(i).name for i in range(model.nkey)]
    if isinstance(keyframe, str) and keyframe in names:
        return names.index(keyframe)
    if isinstance(keyframe, int) and 0 <= keyframe < model.nkey:
        return keyframe
    raise ValueError(f"keyframe is {keyframe!r}, expected one of {names}")


class Features:
    """Counts what is not simulated, but for what is ignored, and names what that leaves loose."""

    def __init__(self, ignore: Collection[str]) -> None:
        """`ignore`: names of what is left out; docs/guides/robots.md has all of them."""
        self.ignored = frozenset(ignore)
        self.found: Counter[str] = Counter()
        self._left_out: Counter[str] = Counter()
        self._bodies: dict[str, str] = {}
        self._loose: dict[str, list[str]] = {}

    def add(
        self, name: str, count: int = 1, loose: Iterable[str] = (), bodies: Iterable[str] = ()
    ) -> None:
        """Something that is not simulated is there. `loose`, `bodies`: the joints and bodies that
        it moves or holds, by name, which nothing does without it."""
        if name in self.ignored:
            self.leave(name, count, loose, bodies)
        elif count:
            self.found[name] += int(count)

    def leave(
        self, name: str, count: int, loose: Iterable[str] = (), bodies: Iterable[str] = ()
    ) -> None:
        """As `add`, of what is left out, with a warning if it is not ignored."""
        if count:
            self._left_out[name] += int(count)
            self._bodies.update((body, name) for body in bodies)
            own = self._loose.setdefault(name, [])
            own.extend(one for one in loose if one not in own)

    def rows(self, prefix: str) -> list[ReportRow]:
        """Of the report: what is ignored, and the bodies that this leaves loose."""
        left_out = [ReportRow(reports.LEFT_OUT, name, str(n)) for name, n in self._left_out.items()]
        bodies = self._bodies.items()
        return left_out + [
            ReportRow(reports.LOOSE, prefix + b, f"without {of}") for b, of in bodies
        ]

    def warn(self, source: str, held: Collection[str], fingerprint: str) -> None:
        """Warns, once for a fingerprint, of what is left out, and of what nothing drives or holds
        without what is ignored; `held` are the joints that something else does."""
        left = {name: n for name, n in self._left_out.items() if name not in self.ignored}
        text = f"{source}: left out, as it moves nothing here, or next to nothing: {counted(left)}."
        warn([(text, text)] if left else [], fingerprint)
        for name, loose in self._loose.items():
            names = [one for one in loose if one not in held]
            names += [f"body {body!r}" for body, of in self._bodies.items() if of == name]
            warn_of_loose(source, name, names, fingerprint)


class Selection:
    """The bodies of a model that become a scene's, and what holds them together.

    Bodies are in MuJoCo's order: parents first. `lump`: the topmost body that a body is rigid with.
    `balls`: bodies on a ball joint alone, which are free, and that joint. `moved`: mocap bodies
    that something is tied to, or to what is on them, or that are effectors, and a kinematic base.
    """

    def __init__(
        self,
        model: Any,
        subtree: str | None,
        base: str,
        start: ModelStart,
        features: Features,
        *,
        effectors: Collection[str] = (),
    ) -> None:
        """Raises ValueError on an unknown `subtree`, and on a base that moves without one."""
        self.model, self.start, self.features = model, start, features
        self.root = None if subtree is None else body_id(model, "subtree", subtree)
        if self.root is None and base != "fixed":
            raise ValueError(f"base is {base!r}, expected 'fixed', or subtree=... that names it")
        self.bodies = below(model, [WORLD if self.root is None else self.root])
        self.lump: dict[int, int] = {}
        self.static: set[int] = set()
        self.free: set[int] = set()
        self.balls: dict[int, int] = {}
        self.moved: set[int] = {
            int(body)
            for equality in np.flatnonzero(model.eq_active0)
            if (kind := word("mjtEq", model.eq_type[equality])) in ("connect", "weld")
            and f"equality/{kind}" not in features.ignored
            for body in model.body_rootid[tie_ends(model, int(equality))]
            if model.body_mocapid[body] >= 0
        }
        mocaps = np.flatnonzero(model.body_mocapid >= 0).tolist()
        self.moved |= {body for body in mocaps if name_of(model, "body", body) in effectors}
        self.moved |= {self.root} if base == "kinematic" and self.root is not None else set()
        self.joints: dict[int, list[int]] = {}
        self.carrier: dict[int, int] = {}
        self.offset: dict[int, Pose] = {}
        for body in self.bodies:
            self._add(body, base)
            self._carry(body)

    def _add(self, body: int, base: str) -> None:
        model, features = self.model, self.features
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        kinds = {j: word("mjtJoint", model.jnt_type[j]) for j in range(first, first + count)}
        parent = int(model.body_parentid[body])
        self.joints[body] = []
        self.lump[body] = body
        if body == self.root:
            (self.static if base == "fixed" else self.free).add(body)
        elif body == WORLD or (model.body_mocapid[body] >= 0 and body not in self.moved):
            self.static.add(body)
        elif body in self.moved or "free" in kinds.values():
            self.free.add(body)
        elif list(kinds.values()) == ["ball"] and "joint/ball" not in features.ignored:
            self.free.add(body)
            self.balls[body] = first
        else:
            self.joints[body] = [joint for joint, kind in kinds.items() if kind != "ball"]
            features.add("joint/ball", len(kinds) - len(self.joints[body]))
            if not self.joints[body]:
                self.lump[body] = self.lump[parent]
                if parent in self.static:
                    self.static.add(body)

    def _carry(self, body: int) -> None:
        """A massless body that is fixed to another one that moves becomes part of it."""
        self.carrier[body], self.offset[body] = body, np.eye(4)
        own = self.lump[body] == body or body in self.static
        if not own and self.model.body_mass[body] <= MASSLESS:
            parent = int(self.model.body_parentid[body])
            self.carrier[body] = self.carrier[parent]
            self.offset[body] = self.offset[parent] @ self.at(body)

    def at(self, body: int) -> Pose:
        """A body's frame in its parent's, before its joints; on a ball joint that is ignored, as it
        starts."""
        model, loose = self.model, body in self.joints and body not in self.balls
        if loose and not self.joints[body] and model.body_jntnum[body]:
            poses = self.start.poses
            return np.linalg.inv(poses[int(model.body_parentid[body])]) @ poses[body]
        return local_pose(model.body_pos[body], model.body_quat[body])

    def all_joints(self) -> list[int]:
        """Hinge and slide joints of the selected bodies."""
        return [joint for body in self.bodies for joint in self.joints[body]]

    def rigid(self, body_a: int, body_b: int) -> bool:
        """Whether two bodies move as one, or not at all."""
        return self.lump[body_a] == self.lump[body_b] or {body_a, body_b} <= self.static

    def yields(self, body: int) -> bool:
        """Whether a body is selected, and forces move it."""
        return body not in self.static and self.lump.get(body) not in {None, *self.moved}


def damps(model: Any, body: int) -> bool:
    """Whether the damping of a body's free or ball joint is that of a body about its centre."""
    central = float(np.abs(model.body_ipos[body]).max()) < CENTRAL
    still = int(model.body_weldid[model.body_parentid[body]]) == WORLD
    alike = still if int(model.body_dofnum[body]) == 3 else central
    return alike and not disabled(model, "DAMPER")


def tie_ends(model: Any, equality: int) -> list[int]:
    """The two bodies of a connection or a weld."""
    ends = [int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])]
    if word("mjtObj", model.eq_objtype[equality]) == "site":
        ends = [int(model.site_bodyid[site]) for site in ends]
    return ends


def body_id(model: Any, argument: str, name: str) -> int:
    """Number of a body; ValueError that lists the names that there are."""
    names = [name_of(model, "body", body) for body in range(model.nbody)]
    if name not in names:
        raise ValueError(f"{argument} is {name!r}, expected one of {', '.join(names)}")
    return names.index(name)


def below(model: Any, tops: Iterable[int]) -> list[int]:
    """Some bodies and all that hang on them, in MuJoCo's order."""
    reached = set(tops)
    parents: Sequence[int] = model.body_parentid
    for body in range(1, model.nbody):
        if int(parents[body]) in reached:
            reached.add(body)
    return sorted(reached)
