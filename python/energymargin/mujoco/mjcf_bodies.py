"""Bodies, joints and their drives in MJCF.

A body with locked axes, or with two dampings, stands on slides and a hinge or a ball: one for each
axis that is free. Held joints are welds, mimics are equalities.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.base.aliases import Floats

HINGES = {"revolute": "hinge", "prismatic": "slide"}
THINNER = 1e-4  # share of a box's edge, of each body in a plane more than of that before
ALONG = 1 - 1e-9  # cosine between an edge and the axis that is locked
CENTRAL = 1e-6  # m; a centre of mass so near to a frame's origin is there
UNLIMITED = 1e6  # [rad] or [m], of one end that has no limit
EQUALITY_STEPS = 2  # time constant of a mimic, the shortest that MuJoCo has


class Bodies:
    """All bodies of a scene at a state, as elements of a document."""

    def __init__(self, scene: em.Scene, state: Floats, root: xml.Element, step: float) -> None:
        """Adds them to the document's root; `step` [s] is MuJoCo's."""
        self.elements: dict[str, xml.Element] = {}
        self.geoms: dict[str, list[str]] = {}
        """By body, the names of its parts."""
        self.start: dict[str, list[float]] = {"qpos": [], "qvel": [], "ctrl": []}
        """The state, as MuJoCo has it."""
        self._scene, self._now = scene, scene.unpack(state)
        self._rigid = (EQUALITY_STEPS * step, 1.0)
        self._by_name = {body.name: body for body in scene.bodies}
        self._assets, self._world, self._equalities, self._actuators = (
            add(root, section) for section in ("asset", "worldbody", "equality", "actuator")
        )
        links = {joint.child for joint in scene.joints}
        for body in scene.bodies:
            if body.name not in links:
                self._add(body)
        self._add_forces()

    def _add(self, body: em.Body) -> None:
        """One that hangs on no other, and its links."""
        linear, angular = _axes(body.linear_factor), _axes(body.angular_factor)
        if len(angular) == 2 and not body.fixed:
            raise ValueError(f"'{body.name}' turns about 2 axes, expected 0, 1 or 3 for MJCF")
        now = self._now.get(body.name, {})
        position = body.position if body.fixed else now["position"]
        orientation = body.orientation if body.fixed else now["orientation"]
        element = self._place(self._world, body, position, orientation)
        if not body.fixed and len(linear) == len(angular) == 3 and _alike_damped(body):
            damping = {"damping": body.linear_damping} if body.linear_damping else {}
            add(element, "joint", name=body.name, type="free", **damping)
            spin = Rotation.from_quat(orientation).inv().apply(now["angular_velocity"])
            self._begin([*position, *_scalar_first(orientation)], [*now["velocity"], *spin])
        elif not body.fixed:
            self._add_chain(element, body, linear, angular)
        self._add_links(element, body)

    def _add_chain(
        self, element: xml.Element, body: em.Body, linear: tuple[int, ...], angular: tuple[int, ...]
    ) -> None:
        now, center = self._now[body.name], np.array(inertia_of(body).center)
        turn, spin = Rotation.from_quat(now["orientation"]), now["angular_velocity"]
        speed = now["velocity"] + np.cross(spin, turn.apply(center))
        own = turn.inv().apply(np.eye(3))  # the world's axes, in the body's frame
        damping = body.angular_damping
        for axis in linear:
            slide = {"type": "slide", "axis": own[axis], "damping": body.linear_damping}
            add(element, "joint", name=f"{body.name}/slide{axis}", **slide)
            self._begin([0.0], [speed[axis]])
        if len(angular) == 3:
            ball = {"type": "ball", "pos": center, "damping": damping}
            add(element, "joint", name=f"{body.name}/ball", **ball)
            self._begin([1.0, 0.0, 0.0, 0.0], turn.inv().apply(spin))
            return
        for axis in angular:
            name = f"{body.name}/hinge{axis}"
            hinge = {"type": "hinge", "pos": center, "axis": own[axis], "damping": damping}
            add(element, "joint", name=name, **hinge)
            self._begin([0.0], [spin[axis]])

    def _add_links(self, parent: xml.Element, body: em.Body) -> None:
        for joint in self._scene.joints:
            if joint.parent == body.name:
                self._add_link(parent, joint)

    def _add_link(self, parent: xml.Element, joint: em.Joint) -> None:
        body = self._by_name[joint.child]
        turn, shift = Rotation.from_quat(joint.orientation), np.array(joint.origin)
        position, velocity = motion_of(joint, self._now.get("joints", {}))
        if joint.held:
            held = position * np.array(joint.axis)
            if joint.type == "revolute":
                turn = turn * Rotation.from_rotvec(held)
            else:
                shift = shift + turn.apply(held)
        of_child = Rotation.from_quat(joint.child_orientation)
        turn = turn * of_child.inv()
        origin = shift - turn.apply(np.array(joint.child_origin))
        element = self._place(parent, body, origin, turn.as_quat())
        if not rigid(joint):
            rotor = {"armature": joint.armature, "frictionloss": joint.friction}
            law = _limits(joint) | {name: value for name, value in rotor.items() if value}
            at = {"axis": of_child.apply(np.array(joint.axis)), "pos": joint.child_origin}
            add(element, "joint", name=joint.name, type=HINGES[joint.type], **at, **law)
            self._begin([position], [velocity])
            if joint.mimic:
                line = (joint.mimic.offset, joint.mimic.multiplier, 0.0, 0.0, 0.0)
                joints = {"joint1": joint.name, "joint2": joint.mimic.joint, "polycoef": line}
                add(self._equalities, "joint", **joints, solref=self._rigid)
            else:
                self._control(joint, joint=joint.name)
        self._add_links(element, body)

    def _control(self, of: em.Joint | em.Tendon, **transmission: str) -> None:
        stiffness, damping = of.stiffness, of.damping
        if not (stiffness or damping):
            return
        bias = (damping * of.target_velocity, -stiffness, -damping)
        law = {"gainprm": stiffness, "biastype": "affine", "biasprm": bias}
        most = of.torque_limit
        limit = {"forcerange": (-most, most)} if np.isfinite(most) else {}
        add(self._actuators, "general", name=of.name, **transmission, **law, **limit)
        self.start["ctrl"].append(of.target)

    def add_tendon(self, tendon: em.Tendon, section: xml.Element) -> None:
        """A fixed tendon, and what drives it."""
        loss = {"frictionloss": tendon.friction} if tendon.friction else {}
        element = add(section, "fixed", name=tendon.name, **_limits(tendon), **loss)
        for of in tendon.joints:
            add(element, "joint", joint=of.joint, coef=of.coefficient)
        self._control(tendon, tendon=tendon.name)

    def add_loop(self, loop: em.Loop, number: int) -> None:
        """A connection or a weld of two sites."""
        sites = {}
        for end, body, point, turn in (
            ("1", loop.body_a, loop.point_a, loop.orientation_a),
            ("2", loop.body_b, loop.point_b, loop.orientation_b),
        ):
            sites[f"site{end}"] = f"loop{number}/{body}"
            add(self.elements[body], "site", name=sites[f"site{end}"], **_pose(point, turn))
        kind = {"point": "connect", "weld": "weld"}[loop.type]
        add(self._equalities, kind, **sites, solref=self._rigid)

    def _add_forces(self) -> None:
        """At centres of mass, along the world's axes."""
        forced = [body for body in self._scene.bodies if np.any(body.force) and not body.fixed]
        if forced:
            add(self._world, "site", name="world")
        for body in forced:
            site = f"{body.name}/center"
            add(self.elements[body.name], "site", name=site, pos=inertia_of(body).center)
            at = {"site": site, "refsite": "world", "gear": [*body.force, 0.0, 0.0, 0.0]}
            law = {"gainprm": "0", "biastype": "affine", "biasprm": "1 0 0"}
            add(self._actuators, "general", name=f"{body.name}/force", **at, **law)
            self.start["ctrl"].append(0.0)

    def _place(
        self, parent: xml.Element, body: em.Body, position: Any, orientation: Any
    ) -> xml.Element:
        at = _pose(position, orientation)
        if body.name != "world":
            element = add(parent, "body", name=body.name, **at)
        elif body.fixed and not np.any(position) and at["quat"][0] == 1:
            element = self._world
        else:
            raise ValueError("body 'world' is not where MuJoCo's is, expected another name")
        self.elements[body.name], self.geoms[body.name] = element, []
        if not body.fixed:
            of = inertia_of(body)
            mass = {"mass": body.mass, "diaginertia": of.moments}
            add(element, "inertial", **mass, **_pose(of.center, of.axes))
        thinner = self._thinner(body, Rotation.from_quat(orientation))
        for solid, at in _parts(body.shape):
            name = f"{body.name}/{len(self.geoms[body.name])}"
            self.geoms[body.name].append(name)
            # Only the pairs that are named collide, and the body's own mass counts.
            off = {"contype": "0", "conaffinity": "0", "mass": "0"}
            add(element, "geom", name=name, **self._solid(solid, name, thinner), **at, **off)
        return element

    def _thinner(self, body: em.Body, turn: Rotation) -> Floats:
        """Shares of the edges of a body's boxes, shape (3,): in a plane no two are equally thick.

        Where the faces of two boxes lie in one plane, MuJoCo 3.11 finds contacts that are not
        there, and throws the boxes off.
        """
        linear, angular = _axes(body.linear_factor), _axes(body.angular_factor)
        shares = np.ones(3)
        if body.fixed or len(linear) != 2 or len(angular) > 1 or set(linear) & set(angular):
            return shares
        (axis,) = {0, 1, 2} - set(linear)
        across = np.abs(turn.inv().apply(np.eye(3)[axis]))
        if across.max() > ALONG:
            shares[across.argmax()] -= THINNER * len(self.geoms)
        return shares

    def _solid(self, solid: Any, name: str, thinner: Floats) -> dict[str, Any]:
        if isinstance(solid, em.Plane):
            normal = np.array(solid.normal)
            at = {"pos": solid.offset * normal, "zaxis": normal}
            return {"type": "plane", "size": "0 0 1", **at}
        if isinstance(solid, em.ConvexHull):
            add(self._assets, "mesh", name=name, vertex=solid.points)
            return {"type": "mesh", "mesh": name}
        if isinstance(solid, em.Box):
            return {"type": "box", "size": thinner * np.array(solid.size) / 2}
        if isinstance(solid, em.Sphere):
            return {"type": "sphere", "size": solid.radius}
        kind = "cylinder" if isinstance(solid, em.Cylinder) else "capsule"
        return {"type": kind, "size": (solid.radius, solid.length / 2)}

    def _begin(self, positions: Sequence[float], velocities: Sequence[float]) -> None:
        self.start["qpos"].extend(positions)
        self.start["qvel"].extend(velocities)


def _alike_damped(body: em.Body) -> bool:
    """Whether one number says how a free joint is damped: that of a body about its frame."""
    slides, turns = body.linear_damping, body.angular_damping
    central = np.abs(inertia_of(body).center).max() <= CENTRAL
    return bool(slides == turns and (central or not slides))


def rigid(joint: em.Joint) -> bool:
    """Whether its two bodies move as one."""
    return bool(joint.held) or joint.type == "fixed"


def motion_of(joint: em.Joint, joints: dict[str, Any]) -> tuple[float, float]:
    """Its position and velocity, from those of the joints in a state."""
    if joint.type == "fixed":
        return 0.0, 0.0
    mimic = joint.mimic
    now = joints[mimic.joint if mimic else joint.name]
    if mimic is None:
        return now["position"], now["velocity"]
    return mimic.multiplier * now["position"] + mimic.offset, mimic.multiplier * now["velocity"]


def inertia_of(body: em.Body) -> em.Inertial | em.MassProperties:
    """Its own, or that of its shape."""
    return body.inertial or em.mass_properties(body.shape, body.mass)


def add(parent: xml.Element, tag: str, **attributes: Any) -> xml.Element:
    """A new element below another; numbers and vectors are written to the last bit."""
    element = xml.SubElement(parent, tag)
    for name, value in attributes.items():
        text = value if isinstance(value, str) else " ".join(map(repr, np.ravel(value).tolist()))
        element.set(name, text)
    return element


def _limits(joint: em.Joint | em.Tendon) -> dict[str, Any]:
    low, high = joint.limits
    if getattr(joint, "mimic", None) or not (np.isfinite(low) or np.isfinite(high)):
        return {}
    if low == high:
        raise ValueError(f"limits of '{joint.name}' are {joint.limits}, expected two for MJCF")
    return {"range": (max(low, -UNLIMITED), min(high, UNLIMITED))}


def _parts(shape: Any) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Solids, each with its pose in the body's frame."""
    if isinstance(shape, em.Compound):
        for part in shape.parts:
            yield part.shape, _pose(part.position, part.orientation)
    else:
        yield shape, {}


def _pose(position: Any, orientation: Any) -> dict[str, Any]:
    return {"pos": position, "quat": _scalar_first(orientation)}


def _axes(factor: Any) -> tuple[int, ...]:
    """Those that are free."""
    return tuple(axis for axis in range(3) if factor[axis] > 0.0)


def _scalar_first(quaternion: Any) -> Floats:
    """The quaternion w, x, y, z of x, y, z, w."""
    return np.roll(quaternion, 1)
