"""How robust is a manipulation, right now? An answer in joules."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from energymargin import disturbances, notebook, regions
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

if TYPE_CHECKING:
    from energymargin import (
        datasets,
        evaluation,
        executors,
        recordings,
        scenes,
        store,
        tasks,
    )
    from energymargin.meshes import Mesh
    from energymargin.plausibility import PlausibilityWarning
    from energymargin.scoring import ScoreError, ScoreTable, score
    from energymargin.settings import SearchSettings

    __version__: str

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

notebook.attach()

# What a first score does not need is imported when it is first asked for: a process that scores a
# problem starts in half the time.
SUBPACKAGES = (
    "datasets",
    "evaluation",
    "executors",
    "plots",
    "recordings",
    "report",
    "scenes",
    "store",
    "tasks",
    "viewer",
)
HOMES = {
    "Mesh": "meshes",
    "PlausibilityWarning": "plausibility",
    "ScoreError": "scoring",
    "ScoreTable": "scoring",
    "SearchSettings": "settings",
    "score": "scoring",
}


def __getattr__(name: str) -> Any:
    """`plots`, `report` and `viewer` need the extras of these names."""
    if name in SUBPACKAGES:
        return import_module(f"energymargin.{name}")
    if name in HOMES:
        value = getattr(import_module(f"energymargin.{HOMES[name]}"), name)
    elif name == "__version__":
        value = import_module("importlib.metadata").version("energymargin")
    else:
        raise AttributeError(f"module 'energymargin' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *SUBPACKAGES, *HOMES, "__version__"})
