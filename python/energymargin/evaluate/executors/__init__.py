"""Where problems are scored: on threads, in processes, or by the workers of a Dask cluster.

The scores are the same, to the last bit.
"""

from energymargin.evaluate.executors.choice import Executor
from energymargin.evaluate.executors.dask import Dask
from energymargin.evaluate.executors.processes import Processes
from energymargin.evaluate.executors.rows import Row
from energymargin.evaluate.executors.threads import Threads

__all__ = ["Dask", "Executor", "Processes", "Row", "Threads"]
