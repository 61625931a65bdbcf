"""Where problems are scored: on threads, in processes, or by the workers of a Dask cluster."""

from energymargin.base.doors import check_doors
from energymargin.evaluate.asking import Kept, ask
from energymargin.evaluate.executors.choice import Executor, Processes, Threads
from energymargin.evaluate.executors.dask import Dask
from energymargin.evaluate.executors.rows import Row

__all__ = ["Dask", "Executor", "Kept", "Processes", "Row", "Threads", "ask"]

check_doors(globals(), __all__)
