"""A scene in MJCF, from the same numbers: its twin in MuJoCo.

Contacts are pairs that are named one by one, since MuJoCo would take the larger of two bodies'
coefficients of friction, whatever the scene's rule is. They are as stiff as MuJoCo lets them
be at a step, and their friction cones are elliptic: MuJoCo's own softness and pyramids end further
from a scene's ends, and most take longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
from numpy.typing import ArrayLike

from energymargin._core import Body, Scene, Spring
from energymargin.checks import positive_number
from energymargin.mujoco.mjcf_bodies import Bodies, add, rigid
from energymargin.scenes.additions import base_of
from energymargin.scenes.mjcf_model import engine

START = "start"  # the keyframe's name
TOLERANCE = 1e-8  # of the solver
CONTACT_STEPS = 2  # time constant of a contact; MuJoCo makes a shorter one so long
OTHER_FRICTION = "0.005 0.0001 0.0001"  # torsional and rolling, which contacts of three axes ignore


def to_mjcf(scene: Scene, state: ArrayLike | None = None, *, step: float | None = None) -> str:
    """A scene as MJCF text.

    Args:
        scene: all of it.
        state: the keyframe "start", shape (n,), by default the scene's own. Locked axes and held
            joints stay where they are in it.
        step: MuJoCo's [s], by default the scene's. The shorter, the stiffer are contacts.

    Bodies and joints have the scene's names. A joint's drive is an actuator of the joint's name
    whose control is the target; a body's constant force is an actuator without control. Boxes of
    bodies in a plane are thinner by a share of 1e-4, each by more than that before. Raises
    ValueError on what MJCF cannot express: a body with one locked axis of rotation, a joint with
    one limit for both ends, a body of the name "world", a kinematic body.
    """
    for body in scene.bodies:
        if body.kinematic:
            raise ValueError(
                f"body {body.name!r} is kinematic, expected none: a mocap body of MuJoCo has no "
                "velocity in its contacts; a heavy body with a motor, `limits` of a plan, is near"
            )
    at = np.asarray(scene.pack() if state is None else state, dtype=float)
    return _Document(scene, at, positive_number("step", scene.step if step is None else step)).text


def model_of(scene: Scene, state: ArrayLike | None = None, *, step: float | None = None) -> Any:
    """The `mujoco.MjModel` of a scene, from `to_mjcf`.

    `mujoco.mj_resetDataKeyframe(model, data, 0)` puts an MjData to the state. Raises ValueError as
    `to_mjcf`, and on what MuJoCo refuses; ImportError without the extra `mujoco`.
    """
    return engine().MjModel.from_xml_string(to_mjcf(scene, state, step=step))


class _Document:
    def __init__(self, scene: Scene, state: np.ndarray[Any, Any], step: float) -> None:
        self.scene = scene
        self.step = step
        self.root = xml.Element("mujoco")
        add(self.root, "compiler", angle="radian")
        # Euler's method would take the damping of actuators explicitly: light fingers would shake.
        damped = scene.joints or any(spring.damping for spring in scene.springs)
        add(
            self.root,
            "option",
            timestep=step,
            gravity=scene.gravity,
            tolerance=TOLERANCE,
            solver="Newton",
            cone="elliptic",
            integrator="implicitfast" if damped else "Euler",
        )
        self.bodies = Bodies(scene, state, self.root, step)
        tendons = add(self.root, "tendon")
        for number, spring in enumerate(scene.springs):
            self._add_spring(tendons, f"spring{number}", spring)
        self._add_contacts()
        frame = {key: values for key, values in self.bodies.start.items() if values}
        add(add(self.root, "keyframe"), "key", name=START, **frame)
        for section in list(self.root):
            if not len(section) and not section.attrib:
                self.root.remove(section)

    @property
    def text(self) -> str:
        xml.indent(self.root)
        return xml.tostring(self.root, encoding="unicode")

    def _add_spring(self, tendons: xml.Element, name: str, spring: Spring) -> None:
        law = {"stiffness": spring.stiffness, "damping": spring.damping}
        tendon = add(tendons, "spatial", name=name, **law, springlength=spring.rest_length)
        for end, point in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b)):
            site = f"{name}/{end}"
            add(self.bodies.elements[end], "site", name=site, pos=point)
            add(tendon, "site", site=site)

    def _add_contacts(self) -> None:
        contacts = add(self.root, "contact")
        for a, b in self._colliding():
            friction = repr(self.scene.contact_friction(a.name, b.name))
            law = {
                "condim": "3",
                "friction": f"{friction} {friction} {OTHER_FRICTION}",
                "solref": (CONTACT_STEPS * self.step, 1.0),
            }
            for one, other in product(self.bodies.geoms[a.name], self.bodies.geoms[b.name]):
                add(contacts, "pair", geom1=one, geom2=other, **law)

    def _colliding(self) -> Iterator[tuple[Body, Body]]:
        apart = {frozenset(pair) for pair in self.scene.disabled_collisions}
        apart |= {frozenset((joint.parent, joint.child)) for joint in self.scene.joints}
        carriers = {joint.child: joint.parent for joint in self.scene.joints if rigid(joint)}
        fixed = {body.name for body in self.scene.bodies if body.fixed}

        def base(name: str) -> str:
            """That it is one with; all that is fixed is one."""
            top = base_of(name, carriers)
            return "" if top in fixed else top

        for a, b in combinations(self.scene.bodies, 2):
            if frozenset((a.name, b.name)) not in apart and base(a.name) != base(b.name):
                yield a, b
