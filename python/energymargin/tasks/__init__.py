"""The manipulation tasks, by name: `make("push", friction=0.3)`.

Tasks are plugins: whatever an installed package registers under the entry point group
`energymargin.tasks` is one, and what a program gives to `register`.
"""

from energymargin.base.doors import check_doors
from energymargin.tasks.base import Params, Regions, Task, inside, parameters_of, plane_of
from energymargin.tasks.registry import TaskError, make, names, overview, register
from energymargin.tasks.scripted import Drive, ScriptedTask
from energymargin.tasks.trajectories import Trajectory

__all__ = [
    "Drive",
    "Params",
    "Regions",
    "ScriptedTask",
    "Task",
    "TaskError",
    "Trajectory",
    "inside",
    "make",
    "names",
    "overview",
    "parameters_of",
    "plane_of",
    "register",
]

check_doors(globals(), __all__)
