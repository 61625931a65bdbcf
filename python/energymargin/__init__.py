"""How robust is a manipulation, right now? An answer in joules."""

from importlib import import_module
from importlib.metadata import version
from types import ModuleType

from energymargin import (
    datasets,
    disturbances,
    evaluation,
    executors,
    notebook,
    recordings,
    regions,
    scenes,
    store,
    tasks,
)
from energymargin._core import (
    Audit,
    Body,
    Box,
    Cancel,
    Cancelled,
    Capsule,
    CaptureProbability,
    CaptureScore,
    Compound,
    Contact,
    ConvexHull,
    Cylinder,
    EscapeEffort,
    EscapeEnergy,
    ForceScore,
    ForceWeights,
    Inertial,
    Joint,
    MassProperties,
    Mimic,
    Part,
    Plan,
    Plane,
    Problem,
    Rollout,
    Scene,
    Simulation,
    Sphere,
    Spring,
    Tree,
    World,
    capture_probability,
    capture_score,
    escape_effort,
    escape_energy,
    force_score,
    mass_properties,
    stream,
)
from energymargin.meshes import Mesh
from energymargin.plausibility import PlausibilityWarning
from energymargin.scoring import ScoreError, ScoreTable, score
from energymargin.settings import SearchSettings

__all__ = [
    "Audit",
    "Body",
    "Box",
    "Cancel",
    "Cancelled",
    "Capsule",
    "CaptureProbability",
    "CaptureScore",
    "Compound",
    "Contact",
    "ConvexHull",
    "Cylinder",
    "EscapeEffort",
    "EscapeEnergy",
    "ForceScore",
    "ForceWeights",
    "Inertial",
    "Joint",
    "MassProperties",
    "Mesh",
    "Mimic",
    "Part",
    "Plan",
    "Plane",
    "PlausibilityWarning",
    "Problem",
    "Rollout",
    "Scene",
    "ScoreError",
    "ScoreTable",
    "SearchSettings",
    "Simulation",
    "Sphere",
    "Spring",
    "Tree",
    "World",
    "capture_probability",
    "capture_score",
    "datasets",
    "disturbances",
    "escape_effort",
    "escape_energy",
    "evaluation",
    "executors",
    "force_score",
    "mass_properties",
    "recordings",
    "regions",
    "scenes",
    "score",
    "store",
    "stream",
    "tasks",
]

__version__ = version("energymargin")

notebook.attach()


def __getattr__(name: str) -> ModuleType:
    """`plots`, `report` and `viewer` need the extras of these names, and are imported when they are
    first asked for."""
    if name in ("plots", "report", "viewer"):
        return import_module(f"energymargin.{name}")
    raise AttributeError(f"module 'energymargin' has no attribute {name!r}")
