"""The manipulation tasks, by name: `make("push", friction=0.3)`.

Tasks are plugins: whatever an installed package registers under the entry point group
`energymargin.tasks` is one.
"""

from energymargin.tasks.base import (
    Drive,
    FrictionTask,
    Params,
    Regions,
    ScriptedTask,
    Task,
    Trajectory,
    drawn,
)
from energymargin.tasks.registry import Registered, TaskError, make, names, overview

__all__ = [
    "Drive",
    "FrictionTask",
    "Params",
    "Regions",
    "Registered",
    "ScriptedTask",
    "Task",
    "TaskError",
    "Trajectory",
    "drawn",
    "make",
    "names",
    "overview",
]
