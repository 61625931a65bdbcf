"""How robust is a manipulation, right now? An answer in joules."""

import importlib
import typing

from energymargin import disturbances as disturbances, regions as regions, summary
from energymargin._core import (
    Audit as Audit,
    Body as Body,
    Box as Box,
    Cancel as Cancel,
    Cancelled as Cancelled,
    Capsule as Capsule,
    CaptureProbability as CaptureProbability,
    CaptureScore as CaptureScore,
    Compound as Compound,
    Contact as Contact,
    ConvexHull as ConvexHull,
    Cylinder as Cylinder,
    EscapeEffort as EscapeEffort,
    EscapeEnergy as EscapeEnergy,
    Feedback as Feedback,
    ForceScore as ForceScore,
    ForceWeights as ForceWeights,
    Inertial as Inertial,
    Joint as Joint,
    Loop as Loop,
    LowerBound as LowerBound,
    MassProperties as MassProperties,
    Mimic as Mimic,
    Part as Part,
    Plan as Plan,
    Plane as Plane,
    Problem as Problem,
    Rollout as Rollout,
    Scene as Scene,
    Simulation as Simulation,
    Sphere as Sphere,
    Spring as Spring,
    Surface as Surface,
    Tendon as Tendon,
    TendonJoint as TendonJoint,
    Tree as Tree,
    World as World,
)
from energymargin.base.errors import (
    DivergedError as DivergedError,
    EnergyMarginError as EnergyMarginError,
    ExecutorError as ExecutorError,
)
from energymargin.evaluate.scores import (
    capture_probability as capture_probability,
    capture_score as capture_score,
    effort_lower_bound as effort_lower_bound,
    escape_effort as escape_effort,
    escape_energy as escape_energy,
    force_score as force_score,
    mass_properties as mass_properties,
    stream as stream,
)

if typing.TYPE_CHECKING:
    from energymargin import (
        actions as actions,
        beliefs as beliefs,
        datasets as datasets,
        engines as engines,
        evaluation as evaluation,
        executors as executors,
        futures as futures,
        grasps as grasps,
        gym as gym,
        monitor as monitor,
        motions as motions,
        mujoco as mujoco,
        placing as placing,
        plots as plots,
        recordings as recordings,
        report as report,
        scenes as scenes,
        searches as searches,
        store as store,
        surrogates as surrogates,
        tasks as tasks,
        viewer as viewer,
    )
    from energymargin.actions import (
        CriticalCurve as CriticalCurve,
        CriticalValue as CriticalValue,
        Guard as Guard,
        Improvement as Improvement,
        MarginProfile as MarginProfile,
        Ranking as Ranking,
        compare as compare,
        critical_curve as critical_curve,
        critical_value as critical_value,
        critical_value_of as critical_value_of,
        critical_values as critical_values,
        improve as improve,
        margin_profile as margin_profile,
        rank as rank,
    )
    from energymargin.base.plausibility import PlausibilityWarning as PlausibilityWarning
    from energymargin.beliefs import Belief as Belief, score_belief as score_belief
    from energymargin.evaluate.engine_comparison import (
        EngineComparison as EngineComparison,
        compare_engines as compare_engines,
    )
    from energymargin.evaluate.scoring import (
        ScoreError as ScoreError,
        ScoreTable as ScoreTable,
        score as score,
    )
    from energymargin.evaluate.searches import SearchSettings as SearchSettings
    from energymargin.evaluate.steps import longest_step as longest_step
    from energymargin.meshes import mesh as mesh
    from energymargin.model.pads import Pad as Pad
    from energymargin.model.policies import Policy as Policy
    from energymargin.monitor import Monitor as Monitor
    from energymargin.placing import (
        placements as placements,
        resting_poses as resting_poses,
        settle as settle,
        stack_robustness as stack_robustness,
    )
    from energymargin.surrogates import Surrogate as Surrogate

    __version__: str

# What a first score does not need is imported when it is first asked for: a process that scores a
# problem starts in half the time.
PLAIN = (
    *("actions", "beliefs", "datasets", "engines", "evaluation", "executors", "futures", "grasps"),
    *("monitor", "motions", "placing", "recordings", "searches"),
)
EXTRAS = ("gym", "mujoco", "plots", "report", "viewer")  # each needs the extra of its name
SUBPACKAGES = (*PLAIN, "scenes", "store", "surrogates", "tasks", *EXTRAS)
NAMES = {
    "actions": [
        *("CriticalCurve", "CriticalValue", "Guard", "Improvement", "MarginProfile", "Ranking"),
        *("compare", "critical_curve", "critical_value", "critical_value_of", "critical_values"),
        *("improve", "margin_profile", "rank"),
    ],
    "beliefs": ["Belief", "score_belief"],
    "meshes": ["mesh"],
    "monitor": ["Monitor"],
    "placing": ["placements", "resting_poses", "settle", "stack_robustness"],
    "base.plausibility": ["PlausibilityWarning"],
    "model.pads": ["Pad"],
    "model.policies": ["Policy"],
    "evaluate.engine_comparison": ["EngineComparison", "compare_engines"],
    "evaluate.scoring": ["ScoreError", "ScoreTable", "score"],
    "evaluate.searches": ["SearchSettings"],
    "evaluate.steps": ["longest_step"],
    "surrogates": ["Surrogate"],
}
HOMES = {name: module for module, names in NAMES.items() for name in names}

PRESENT = {name for name, value in globals().items() if callable(value)}
__all__ = sorted(  # noqa: PLE0605
    {"disturbances", "regions", *PRESENT, *HOMES, *SUBPACKAGES}.difference(EXTRAS)
)

summary.attach()


def _lazy(name: str) -> typing.Any:
    if name in SUBPACKAGES:
        return importlib.import_module(f"energymargin.{name}")
    if name in HOMES:
        value = getattr(importlib.import_module(f"energymargin.{HOMES[name]}"), name)
        value = importlib.import_module("energymargin.base.doors").checked(value, __name__)
    elif name == "__version__":
        value = importlib.import_module("importlib.metadata").version("energymargin")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


if not typing.TYPE_CHECKING:  # for whom every name is imported above, and any other is an error
    __getattr__ = _lazy


def __dir__() -> list[str]:
    return sorted({*__all__, *SUBPACKAGES, "__version__"})
