"""The manipulation tasks, by name: `make("push", friction=0.3)`.

Tasks are plugins: whatever an installed package registers under the entry point group
`energymargin.tasks` is one.
"""

from energymargin.tasks.base import Drive, FrictionTask, Params, Regions, ScriptedTask, Task, drawn
from energymargin.tasks.registry import Registered, TaskError, make, names, overview
from energymargin.trajectories import Trajectory

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
