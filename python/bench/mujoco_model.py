"""A scene in MJCF: its twin in MuJoCo, from the same numbers.

A body with locked axes stands on slides and a hinge, one for each axis that is free. Held joints
are welds. A joint's drive is an actuator of the same stiffness, damping and torque limit. Contacts
are pairs that are named one by one, since MuJoCo would take the larger of two bodies' coefficients
of friction, where a scene takes their product. They are as stiff as MuJoCo lets them be at a step,
and their friction cones are elliptic: MuJoCo's own softness and pyramids end further from a scene's
ends, and most take longer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
from scipy.spatial.transform import Rotation

import energymargin as em
from edges import Vector, axes, inertia

__all__ = ["Twin", "turned"]

TOLERANCE = 1e-8
CONTACT_STEPS = 2  # time constant of a contact; MuJoCo makes a shorter one so long
OTHER_FRICTION = "0.005 0.0001 0.0001"  # torsional and rolling, which contacts of three axes ignore
HINGES = {"revolute": "hinge", "prismatic": "slide"}


class Twin:
    """The MJCF of a problem's scene; ValueError on what no task has."""

    def __init__(self, problem: em.Problem) -> None:
        """At the problem's state, which has the positions of locked axes and held joints."""
        self.scene = problem.scene
        self.now = self.scene.unpack(problem.state)
        self.bodies = {body.name: body for body in self.scene.bodies}
        self.geoms: dict[str, list[str]] = {}
        """By body, the names of its parts."""
        self.root = xml.Element("mujoco")
        xml.SubElement(self.root, "compiler", angle="radian")
        xml.SubElement(self.root, "option", self._options())
        self.assets = xml.SubElement(self.root, "asset")
        self.world = xml.SubElement(self.root, "worldbody")
        contacts = xml.SubElement(self.root, "contact")
        tendons = xml.SubElement(self.root, "tendon")
        self.actuators = xml.SubElement(self.root, "actuator")
        links = {joint.child for joint in self.scene.joints}
        for body in self.scene.bodies:
            if body.name not in links:
                self._add(body)
        for spring in self.scene.springs:
            self._add_spring(tendons, spring)
        for a, b in self._colliding():
            self._add_pairs(contacts, a, b)

    @property
    def text(self) -> str:
        """In XML."""
        return xml.tostring(self.root, encoding="unicode")

    def _options(self) -> dict[str, str]:
        # Euler's method would take the damping of actuators explicitly: light fingers would shake.
        integrator = "implicitfast" if self.scene.joints else "Euler"
        return {
            "timestep": repr(self.scene.step),
            "gravity": numbers(self.scene.gravity),
            "tolerance": repr(TOLERANCE),
            "solver": "Newton",
            "cone": "elliptic",
            "integrator": integrator,
        }

    def _add(self, body: em.Body) -> None:
        """One that hangs on no other, and its links."""
        if isinstance(body.shape, em.Plane):
            normal = np.asarray(body.shape.normal)
            position, up = numbers(body.shape.offset * normal), numbers(normal)
            at = {"pos": position, "zaxis": up, "size": "0 0 1"}
            self._add_geom(self.world, body, {"type": "plane", **at})
            return
        linear, angular = axes(body.linear_factor), axes(body.angular_factor)
        if body.fixed:
            element = self._place(self.world, body, body.position, body.orientation)
        elif linear == angular == (0, 1, 2):
            element = self._place(self.world, body, body.position, body.orientation)
            xml.SubElement(element, "freejoint", name=body.name)
        else:
            element = self._add_chain(body, linear, angular)
        self._add_links(element, body)

    def _add_chain(
        self, body: em.Body, linear: tuple[int, ...], angular: tuple[int, ...]
    ) -> xml.Element:
        if len(angular) > 1:
            raise ValueError(f"'{body.name}' turns about {len(angular)} axes, expected 0, 1 or 3")
        position, orientation = chain_base(body, self.now[body.name])
        element = self._place(self.world, body, position, orientation)
        back = Rotation.from_quat(orientation).inv()
        for axis in linear:
            along = numbers(back.apply(np.eye(3)[axis]))
            name = f"{body.name}/slide{axis}"
            xml.SubElement(element, "joint", name=name, type="slide", axis=along)
        for axis in angular:
            about = {"axis": numbers(np.eye(3)[axis]), "pos": numbers(inertia(body).center)}
            name = f"{body.name}/hinge{axis}"
            xml.SubElement(element, "joint", {"name": name, "type": "hinge", **about})
        return element

    def _add_links(self, parent: xml.Element, body: em.Body) -> None:
        for joint in self.scene.joints:
            if joint.parent == body.name:
                self._add_link(parent, joint)

    def _add_link(self, parent: xml.Element, joint: em.Joint) -> None:
        if joint.mimic:
            raise ValueError(f"'{joint.name}' follows another joint, expected one on its own")
        body = self.bodies[joint.child]
        turn = Rotation.from_quat(np.array(joint.orientation))
        shift = np.array(joint.origin)
        if joint.held:
            held = self.now["joints"][joint.name]["position"] * np.array(joint.axis)
            if joint.type == "revolute":
                turn *= Rotation.from_rotvec(held)
            else:
                shift += turn.apply(held)
        of_child = Rotation.from_quat(np.array(joint.child_orientation))
        turn *= of_child.inv()
        element = self._place(
            parent, body, shift - turn.apply(np.array(joint.child_origin)), turn.as_quat()
        )
        if not welded(joint):
            axis = numbers(of_child.apply(np.array(joint.axis)))
            of = {"name": joint.name, "type": HINGES[joint.type], "axis": axis}
            limits = {"range": numbers(joint.limits)} if np.isfinite(joint.limits).all() else {}
            at = {"pos": numbers(joint.child_origin)}
            xml.SubElement(element, "joint", {**of, **at, **limits})
            self._drive(joint)
        self._add_links(element, body)

    def _drive(self, joint: em.Joint) -> None:
        stiffness, damping = joint.stiffness, joint.damping
        if not (stiffness or damping):
            return
        aim = stiffness * joint.target + damping * joint.target_velocity
        law = {"biastype": "affine", "biasprm": numbers((aim, -stiffness, -damping))}
        most = joint.torque_limit
        limit = {"forcerange": numbers((-most, most))} if np.isfinite(most) else {}
        none = {"gainprm": "0"}  # of a control signal, for targets do not change
        xml.SubElement(self.actuators, "general", {"joint": joint.name, **none, **law, **limit})

    def _place(
        self, parent: xml.Element, body: em.Body, position: Any, orientation: Any
    ) -> xml.Element:
        element = xml.SubElement(parent, "body", {"name": body.name, **pose(position, orientation)})
        if not body.fixed:
            of = inertia(body)
            mass = {"mass": repr(body.mass), "diaginertia": numbers(of.moments)}
            xml.SubElement(element, "inertial", {**mass, **pose(of.center, of.axes)})
        for part, at in parts(body.shape):
            self._add_geom(element, body, {**self._solid(part, body), **at})
        return element

    def _add_geom(self, element: xml.Element, body: em.Body, of: dict[str, str]) -> None:
        names = self.geoms.setdefault(body.name, [])
        names.append(f"{body.name}/{len(names)}")
        # Only the pairs that are named collide.
        off = {"contype": "0", "conaffinity": "0"}
        xml.SubElement(element, "geom", {"name": names[-1], **of, **off})

    def _solid(self, of: Any, body: em.Body) -> dict[str, str]:
        if isinstance(of, em.Box):
            return {"type": "box", "size": numbers(np.asarray(of.size) / 2)}
        if isinstance(of, em.Sphere):
            return {"type": "sphere", "size": repr(of.radius)}
        if isinstance(of, em.Cylinder | em.Capsule):
            kind = "cylinder" if isinstance(of, em.Cylinder) else "capsule"
            return {"type": kind, "size": numbers((of.radius, of.length / 2))}
        name = f"{body.name}/{len(self.geoms.get(body.name, ()))}"
        xml.SubElement(self.assets, "mesh", name=name, vertex=numbers(of.points.ravel()))
        return {"type": "mesh", "mesh": name}

    def _add_spring(self, tendons: xml.Element, spring: em.Spring) -> None:
        name = f"{spring.body_a}-{spring.body_b}"
        of = {"stiffness": spring.stiffness, "damping": spring.damping}
        tendon = xml.SubElement(
            tendons,
            "spatial",
            {key: repr(value) for key, value in {**of, "springlength": spring.rest_length}.items()},
        )
        for end, point in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b)):
            element = self.world.find(f".//body[@name='{end}']")
            assert element is not None
            xml.SubElement(element, "site", name=f"{name}/{end}", pos=numbers(point))
            xml.SubElement(tendon, "site", site=f"{name}/{end}")

    def _colliding(self) -> Iterator[tuple[em.Body, em.Body]]:
        apart = {frozenset(pair) for pair in self.scene.disabled_collisions}
        apart |= {frozenset((joint.parent, joint.child)) for joint in self.scene.joints}
        static = {body.name for body in self.scene.bodies if self._static(body)}
        for a, b in combinations(self.scene.bodies, 2):
            if frozenset((a.name, b.name)) not in apart and not {a.name, b.name} <= static:
                yield a, b

    def _static(self, body: em.Body) -> bool:
        """Fixed, or welded to what is."""
        weld = next((j for j in self.scene.joints if j.child == body.name), None)
        if weld is None:
            return body.fixed
        return welded(weld) and self._static(self.bodies[weld.parent])

    def _add_pairs(self, contacts: xml.Element, a: em.Body, b: em.Body) -> None:
        friction = repr(a.friction * b.friction)
        law = {
            "condim": "3",
            "friction": f"{friction} {friction} {OTHER_FRICTION}",
            "solref": numbers((CONTACT_STEPS * self.scene.step, 1.0)),
        }
        for one, other in product(self.geoms.get(a.name, ()), self.geoms.get(b.name, ())):
            xml.SubElement(contacts, "pair", {"geom1": one, "geom2": other, **law})


def chain_base(body: em.Body, now: dict[str, Any]) -> tuple[Vector, Vector]:
    """Where a body with locked axes is when its slides and hinge are at 0."""
    position = np.where(body.linear_factor > 0.0, 0.0, now["position"])
    turns = bool(np.any(body.angular_factor > 0.0))
    return position, np.array((0.0, 0.0, 0.0, 1.0)) if turns else np.array(now["orientation"])


def welded(joint: em.Joint) -> bool:
    """Whether its two bodies move as one."""
    return bool(joint.held) or joint.type == "fixed"


def parts(shape: Any) -> Iterator[tuple[Any, dict[str, str]]]:
    """Solids, each with its pose in the body's frame."""
    if isinstance(shape, em.Compound):
        for part in shape.parts:
            yield part.shape, pose(part.position, part.orientation)
    else:
        yield shape, {}


def pose(position: Any, orientation: Any) -> dict[str, str]:
    """Of an element."""
    return {"pos": numbers(position), "quat": numbers(turned(np.asarray(orientation)))}


def turned(quaternion: Vector) -> Vector:
    """Or many, shape (..., 4): from x, y, z, w to w, x, y, z, as MuJoCo has them."""
    return np.roll(quaternion, 1, axis=-1)


def numbers(values: Sequence[float] | Vector) -> str:
    """In XML, to the last bit."""
    return " ".join(repr(float(value)) for value in values)
