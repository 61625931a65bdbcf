"""Where problems are scored: on threads, in processes, or by the workers of a Dask cluster.

The scores are the same, to the last bit.
"""

from energymargin.doors import check_doors
from energymargin.executors.choice import Executor
from energymargin.executors.dask import Dask
from energymargin.executors.processes import Processes
from energymargin.executors.rows import Row
from energymargin.executors.threads import Threads

__all__ = ["Dask", "Executor", "Processes", "Row", "Threads"]

check_doors(globals(), __all__)
