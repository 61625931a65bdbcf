"""The scores of one problem, of the compiled module: all but the problem is given by name.

The functions are wrapped for as long as positions are taken with a warning.
"""

import energymargin._core as core
from energymargin.deprecations import once_positional

__all__ = ["capture_score", "escape_effort", "escape_energy", "force_score"]

capture_score = once_positional("nodes", "seed", "rate", "trees", "threads", after=1)(
    core.capture_score
)
escape_effort = once_positional("planner", "nodes", "seed", "captured", after=1)(core.escape_effort)
escape_energy = once_positional("planner", "samples", "seed", "reach", "object", after=1)(
    core.escape_energy
)
force_score = once_positional("weights", after=1)(core.force_score)
for function in (capture_score, escape_effort, escape_energy, force_score):
    function.__module__, function.__qualname__ = __name__, function.__name__  # to be pickled
