"""What a URDF file says, as values: a tree of links, their shapes and the joints between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from energymargin._core import Box, Cylinder, Sphere
from energymargin.scenes.poses import Pose

__all__ = ["TYPES", "Geometry", "Joint", "Link", "MeshFile", "Robot"]

TYPES = ("revolute", "continuous", "prismatic", "fixed")


class MeshFile(NamedTuple):
    """A mesh, by the name that the file gives it."""

    filename: str
    scale: tuple[float, float, float]


class Geometry(NamedTuple):
    """One collision shape of a link."""

    shape: Box | Sphere | Cylinder | MeshFile
    pose: Pose
    """In the link's frame."""


@dataclass(frozen=True)
class Link:
    """One link; without mass it is a frame."""

    name: str
    mass: float
    center: Pose
    """Of the inertia's frame, in the link's."""
    inertia: Any
    """Matrix (3, 3) about the centre of mass [kg m^2]; None if the file has none."""
    geometries: tuple[Geometry, ...]
    friction: float | None


@dataclass(frozen=True)
class Joint:
    """One joint; for a prismatic one read m for rad and N for N m."""

    name: str
    type: str
    """One of TYPES."""
    parent: str
    child: str
    origin: Pose
    """In the parent's frame."""
    axis: Any
    """Shape (3,), as the file has it."""
    limits: tuple[float, float] | None = None
    """As the file has them [rad]; None if it has none."""
    effort: float = math.inf
    """[N m]."""
    damping: float = 0.0
    """[N m s/rad]."""
    mimic: tuple[str, float, float] | None = None
    """Joint, multiplier and offset."""


@dataclass(frozen=True)
class Robot:
    """A tree of links, by name; joints are in the file's order."""

    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    base: Pose = field(default_factory=lambda: np.eye(4))
    """The root link, in the frame of the file's root link."""
    merged: dict[str, str] = field(default_factory=dict)
    """Frames that are part of another link, and of which."""
