"""A scene in MJCF, from the same numbers: its twin in MuJoCo.

Contacts are pairs that are named one by one, since MuJoCo would take the larger of two bodies'
coefficients of friction, whatever the scene's rule is. They are as stiff as MuJoCo lets them
be at a step, their friction cones are elliptic and their friction is stiffer still: MuJoCo's own
softness and pyramids end further from a scene's ends, most take longer, and what it holds creeps.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import Any
from xml.etree import ElementTree as xml

import mujoco
import numpy as np
from numpy.typing import ArrayLike

import energymargin as em
from energymargin.base.checks import positive_number
from energymargin.mujoco.mjcf_bodies import Bodies, add, rigid

START = "start"  # the keyframe's name
TOLERANCE = 1e-8  # of the solver
CONTACT_STEPS = 2  # time constant of a contact; MuJoCo makes a shorter one so long
OF_DISC = 2 / 3  # mean distance from the middle of a disc, by its radius: of a patch
IMPRATIO = 100  # how much stiffer friction is than contacts: at MuJoCo's own 1, what sticks creeps


def to_mjcf(scene: em.Scene, state: ArrayLike | None = None, *, step: float | None = None) -> str:
    """A scene as MJCF text.

    Args:
        scene: all of it.
        state: the keyframe "start", shape (n,), by default the scene's own. Locked axes and held
            joints stay where they are in it.
        step: MuJoCo's [s], by default the scene's. The shorter, the stiffer are contacts.

    Bodies, joints and tendons have the scene's names. What drives a joint or a tendon is an
    actuator of its name whose control is the target; a body's constant force is one of its own.
    Boxes of bodies in a plane are thinner by a share of 1e-4, each by more than that before. Raises
    ValueError on what MJCF cannot express: a body with one locked axis of rotation, a joint with
    one limit for both ends, a body of the name "world" that is elsewhere, a kinematic body, a
    surface that moves, gives way or bounces.
    """
    for body in scene.bodies:
        if body.kinematic:
            raise ValueError(
                f"body {body.name!r} is kinematic, expected none: a mocap body of MuJoCo has no "
                "velocity in its contacts; a heavy body with a motor, `limits` of a plan, is near"
            )
        surface = body.surface
        acts = surface and (surface.stiffness or surface.restitution)
        if acts or np.any(body.surface_velocity):
            raise ValueError(
                f"the surface of {body.name!r} gives way, bounces or moves, expected none such, as "
                "contacts of MuJoCo have no stiffness [N/m]: leave out `surface`, or in from_urdf "
                "ignore=('contact/stiffness', 'contact/damping', 'contact/restitution')"
            )
    at = np.asarray(scene.pack() if state is None else state, dtype=float)
    timestep = positive_number("step", scene.step if step is None else step)
    # Euler's method would take the damping of actuators explicitly: light fingers would shake.
    damped = scene.joints or any(spring.damping for spring in scene.springs)
    root = xml.Element("mujoco")
    add(root, "compiler", angle="radian")
    how: dict[str, Any] = {"solver": "Newton", "cone": "elliptic", "impratio": IMPRATIO}
    how["integrator"] = "implicitfast" if damped else "Euler"
    add(root, "option", timestep=timestep, gravity=scene.gravity, tolerance=TOLERANCE, **how)
    bodies = Bodies(scene, at, root, timestep)
    tendons = add(root, "tendon")
    _add_springs(scene, bodies, tendons)
    for tendon in scene.tendons:
        bodies.add_tendon(tendon, tendons)
    for number, loop in enumerate(scene.loops):
        bodies.add_loop(loop, number)
    _add_contacts(scene, bodies, add(root, "contact"), timestep)
    frame = {key: values for key, values in bodies.start.items() if values}
    add(add(root, "keyframe"), "key", name=START, **frame)
    for section in list(root):
        if not len(section) and not section.attrib:
            root.remove(section)
    xml.indent(root)
    return xml.tostring(root, encoding="unicode")


def model_of(scene: em.Scene, state: ArrayLike | None = None, *, step: float | None = None) -> Any:
    """The `mujoco.MjModel` of a scene, from `to_mjcf`.

    `mujoco.mj_resetDataKeyframe(model, data, 0)` puts an MjData to the state. Raises ValueError as
    `to_mjcf`, and on what MuJoCo refuses.
    """
    return mujoco.MjModel.from_xml_string(to_mjcf(scene, state, step=step))


def _add_springs(scene: em.Scene, bodies: Bodies, tendons: xml.Element) -> None:
    for number, spring in enumerate(scene.springs):
        name = f"spring{number}"
        law = {"stiffness": spring.stiffness, "damping": spring.damping}
        tendon = add(tendons, "spatial", name=name, **law, springlength=spring.rest_length)
        for end, point in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b)):
            site = f"{name}/{end}"
            add(bodies.elements[end], "site", name=site, pos=point)
            add(tendon, "site", site=site)


def _add_contacts(scene: em.Scene, bodies: Bodies, contacts: xml.Element, step: float) -> None:
    apart = {frozenset(pair) for pair in scene.disabled_collisions}
    apart |= {frozenset((joint.parent, joint.child)) for joint in scene.joints}
    carriers = {joint.child: joint.parent for joint in scene.joints if rigid(joint)}
    fixed = {body.name for body in scene.bodies if body.fixed}

    def base_of(name: str) -> str:
        """What a body is one with; all that is fixed is one."""
        while name in carriers:
            name = carriers[name]
        return "" if name in fixed else name

    bases = {body.name: base_of(body.name) for body in scene.bodies}
    for a, b in combinations(bases, 2):
        if frozenset((a, b)) in apart or bases[a] == bases[b]:
            continue
        slides, surface = scene.contact_friction(a, b), scene.contact_surface(a, b)
        of_patch = slides * OF_DISC * surface.patch_radius
        torsional, rolling = max(surface.torsional_friction, of_patch), surface.rolling_friction
        condim = "6" if rolling else "4" if torsional else "3"
        friction = (slides, slides, torsional, rolling, rolling)
        law = {"condim": condim, "friction": friction, "solref": (CONTACT_STEPS * step, 1.0)}
        for one, other in product(bodies.geoms[a], bodies.geoms[b]):
            add(contacts, "pair", geom1=one, geom2=other, **law)
