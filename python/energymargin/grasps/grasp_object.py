"""What is gripped: its shape, mass and friction; shapes travel to other processes as the calls that
make them again."""

from __future__ import annotations

import copyreg
import hashlib
import pickle
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import energymargin as em
from energymargin import Inertial, Scene, World, mass_properties
from energymargin.base.checks import not_negative_number, positive_number, require
from energymargin.grasps.grasp_set import ObjectFacts
from energymargin.scenes import from_urdf, shape_parts

HEAVY = 50.0  # kg; what no hand lifts


@dataclass(frozen=True)
class GraspObject:
    """What is gripped.

    Args:
        shape: of `em.mesh`, or a primitive, in the frame in which the grasps are given.
        mass: [kg]
        friction: coefficient; that of a contact is its product with the hand's.
        inertial: centre of mass and inertia, of an object of `mass`; None: those of the shape, of
            even density.

    Raises ValueError on numbers that cannot be, and warns of a density that no solid has.
    """

    shape: Any
    mass: float
    friction: float = 0.5
    inertial: Inertial | None = None

    def __post_init__(self) -> None:
        """Checks all of it."""
        positive_number("mass", self.mass)
        not_negative_number("friction", self.friction)
        if self.mass > HEAVY:
            most = f"expected at most {HEAVY:g} kg: grams take 0.001"
            raise ValueError(f"mass is {self.mass:g} kg, {most}")
        scene = Scene()
        scene.add_body("object", self.shape, mass=self.mass, inertial=self.inertial)
        World(scene)  # warns of a mass that cannot be, as one in grams

    def __str__(self) -> str:
        """Shape, mass and friction."""
        parts, deviation = getattr(self.shape, "parts", ()), getattr(self.shape, "deviation", None)
        shape = f"{len(parts)} convex part{'s' * (len(parts) > 1)}"
        shape = shape if parts else type(self.shape).__name__
        if deviation is not None:
            shape += f" (at most {1e3 * deviation.distance:.2g} mm from the mesh)"
        return f"{shape}, {self.size_text}, {self.mass:.4g} kg, friction {self.friction:.3g}"

    @staticmethod
    def load(
        path: str | Path,
        *,
        mass: float | None = None,
        density: float | None = None,
        friction: float | None = None,
        scale: float = 1.0,
        **options: Any,
    ) -> GraspObject:
        """An object from a mesh file or a URDF of one link, whose frame is that of the grasps.

        Args:
            path: of the file.
            mass: [kg]; None: that of a URDF.
            density: in place of the mass [kg/m^3].
            friction: coefficient; None: that of a URDF, or 0.5.
            scale: what makes metres of a mesh's numbers.
            options: of `em.mesh`, as accuracy, or `em.scenes.from_urdf`, as inertia.

        Raises ValueError unless a mesh has either a mass or a density, on a URDF of several links,
        and OSError on the file.
        """
        if Path(path).suffix.lower() == ".urdf":
            require(scale == 1.0, "scale", scale, "none with a URDF, which has its own")
            bodies = from_urdf(path, base="free", role="object", density=density, **options).bodies
            if len(bodies) != 1:
                which = f"which has {len(bodies)} links that move"
                expected = "expected one: a grasp is of one rigid object"
                raise ValueError(f"path is {str(path)!r}, {which}, {expected}")
            (body,) = bodies
            given = body.friction if friction is None else friction
            if density is not None:
                mass = density * mass_properties(body.shape).volume
            if mass is None:
                return GraspObject(body.shape, body.mass, given, body.inertial)
            return GraspObject(body.shape, mass, given)
        if (mass is None) == (density is None):
            both = f"mass is {mass} and density is {density}"
            raise ValueError(f"{both}, expected one: [kg] or [kg/m^3]")
        shape = em.mesh(path, scale=scale, **options)
        if mass is None:
            mass = positive_number("density", density or 0.0) * mass_properties(shape).volume
        return GraspObject(shape, mass, 0.5 if friction is None else friction)

    @staticmethod
    def of(
        facts: ObjectFacts | None,
        *,
        mesh: str | Path | None = None,
        mass: float | None = None,
        density: float | None = None,
        friction: float | None = None,
        scale: float | None = None,
        **options: Any,
    ) -> GraspObject:
        """The object of a file of grasps, `grasps.object`; what is given here counts instead.

        Args:
            facts: what the file says. Of centre of mass and inertia, which is about it, the one
                that it does not say is that of the shape, of even density.
            mesh: its mesh file.
            mass: [kg]; its centre of mass and inertia are then those of the shape.
            density: in place of the mass [kg/m^3].
            friction: coefficient.
            scale: what makes metres of the mesh's numbers.
            options: of `em.mesh`, as accuracy.

        Raises ValueError on what neither the file nor the call says, and OSError on the mesh.
        """
        said = ObjectFacts() if facts is None else facts
        path = said.mesh if mesh is None else Path(mesh)
        if path is None:
            none = "mesh is None, and the file of grasps names none"
            raise ValueError(f"{none}: expected a mesh or a URDF")
        own = mass is None and density is None
        options |= {"mass": said.mass if own else mass, "density": density}
        options["friction"] = said.friction if friction is None else friction
        known = GraspObject.load(path, scale=said.scale if scale is None else scale, **options)
        if not own or (said.com is None and said.inertia is None):
            return known
        even = known.inertial or mass_properties(known.shape, known.mass)
        inertia: dict[str, Any] = {"inertia": even.moments, "axes": even.axes}
        if said.inertia is not None:
            inertia = {"inertia": said.inertia}
        center = even.center if said.com is None else said.com
        return replace(known, inertial=Inertial(center, **inertia))

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Centre of mass in its frame [m], (3,)."""
        return np.array((self.inertial or mass_properties(self.shape)).center)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Points whose hull holds the object, in its frame [m], (k, 3)."""
        return np.concatenate(shape_parts(self.shape))

    @property
    def size_text(self) -> str:
        """Its sides along its axes, in words."""
        return f"{' x '.join(f'{side:.3g}' for side in np.ptp(self.corners, axis=0))} m"

    @property
    def text(self) -> dict[str, Any]:
        """What it is, as JSON."""
        own = {"shape": digest(self.shape), "mass": self.mass, "friction": self.friction}
        return own if self.inertial is None else own | {"inertial": digest(self.inertial)}


FIELDS: dict[Any, tuple[str, ...]] = {
    em.Box: ("size",),
    em.Sphere: ("radius",),
    **dict.fromkeys((em.Cylinder, em.Capsule), ("radius", "length")),
    em.ConvexHull: ("points",),
    em.Part: ("shape", "position", "orientation"),
    em.MassProperties: ("volume", "center", "moments", "axes"),
    em.Inertial: ("center", "moments", "axes"),
    em.Compound: ("parts", "solid"),
}
"""By kind, what it is made of, in the order of its arguments."""


def _reduced(one: Any) -> tuple[Any, tuple[Any, ...]]:
    """The call that makes a shape again, and its arguments, of plain numbers."""
    given = [getattr(one, name) for name in FIELDS[type(one)]]
    make = _inertial if isinstance(one, em.Inertial) else type(one)
    return make, tuple(value.tolist() if hasattr(value, "tolist") else value for value in given)


def _inertial(center: list[float], moments: list[float], axes: list[float]) -> em.Inertial:
    return em.Inertial(center, inertia=moments, axes=axes)


for kind in FIELDS:
    copyreg.pickle(kind, _reduced)


def digest(shape: Any) -> str:
    """A text that is the same for equal shapes alone."""
    return hashlib.sha256(pickle.dumps(shape, protocol=4)).hexdigest()
