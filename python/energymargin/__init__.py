"""How robust is a manipulation, right now? An answer in joules."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from energymargin import disturbances, regions
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
    LowerBound,
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
)
from energymargin.errors import DivergedError, EnergyMarginError
from energymargin.scores import (
    capture_probability,
    capture_score,
    effort_lower_bound,
    escape_effort,
    escape_energy,
    force_score,
    mass_properties,
    stream,
)
from energymargin.summary import attach

if TYPE_CHECKING:
    from energymargin import actions as actions
    from energymargin import beliefs as beliefs
    from energymargin import datasets as datasets
    from energymargin import evaluation as evaluation
    from energymargin import executors as executors
    from energymargin import gym as gym
    from energymargin import monitor as monitor
    from energymargin import mujoco as mujoco
    from energymargin import plots as plots
    from energymargin import recordings as recordings
    from energymargin import report as report
    from energymargin import scenes as scenes
    from energymargin import store as store
    from energymargin import tasks as tasks
    from energymargin import viewer as viewer
    from energymargin.actions import (
        Guard,
        Improvement,
        MarginProfile,
        Ranking,
        improve,
        margin_profile,
        rank,
    )
    from energymargin.beliefs import Belief, score_belief
    from energymargin.meshes import mesh
    from energymargin.monitor import Monitor
    from energymargin.plausibility import PlausibilityWarning
    from energymargin.scoring import ScoreError, ScoreTable, score
    from energymargin.searches import SearchSettings

    __version__: str

__all__ = [
    "Audit",
    "Belief",
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
    "DivergedError",
    "EnergyMarginError",
    "EscapeEffort",
    "EscapeEnergy",
    "ForceScore",
    "ForceWeights",
    "Guard",
    "Improvement",
    "Inertial",
    "Joint",
    "LowerBound",
    "MarginProfile",
    "MassProperties",
    "Mimic",
    "Monitor",
    "Part",
    "Plan",
    "Plane",
    "PlausibilityWarning",
    "Problem",
    "Ranking",
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
    "actions",
    "beliefs",
    "capture_probability",
    "capture_score",
    "datasets",
    "disturbances",
    "effort_lower_bound",
    "escape_effort",
    "escape_energy",
    "evaluation",
    "executors",
    "force_score",
    "improve",
    "margin_profile",
    "mass_properties",
    "mesh",
    "monitor",
    "rank",
    "recordings",
    "regions",
    "scenes",
    "score",
    "score_belief",
    "store",
    "stream",
    "tasks",
]

attach()

# What a first score does not need is imported when it is first asked for: a process that scores a
# problem starts in half the time.
SUBPACKAGES = (
    "actions",
    "beliefs",
    "datasets",
    "evaluation",
    "executors",
    "gym",
    "monitor",
    "mujoco",
    "plots",
    "recordings",
    "report",
    "scenes",
    "store",
    "tasks",
    "viewer",
)
HOMES = {
    "MarginProfile": "actions",
    "Belief": "beliefs",
    "Guard": "actions",
    "Improvement": "actions",
    "Monitor": "monitor",
    "PlausibilityWarning": "plausibility",
    "Ranking": "actions",
    "ScoreError": "scoring",
    "ScoreTable": "scoring",
    "SearchSettings": "searches",
    "margin_profile": "actions",
    "improve": "actions",
    "mesh": "meshes",
    "rank": "actions",
    "score": "scoring",
    "score_belief": "beliefs",
}


def _lazy(name: str) -> Any:
    """`gym`, `mujoco`, `plots`, `report` and `viewer` need the extras of these names."""
    if name in SUBPACKAGES:
        return import_module(f"energymargin.{name}")
    if name in HOMES:
        value = getattr(import_module(f"energymargin.{HOMES[name]}"), name)
    elif name == "__version__":
        value = import_module("importlib.metadata").version("energymargin")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


if not TYPE_CHECKING:  # for whom every name is imported above, and any other is an error
    __getattr__ = _lazy


def __dir__() -> list[str]:
    return sorted({*__all__, *SUBPACKAGES, "__version__"})
