"""Where problems are scored: on threads, in processes, or by the workers of a Dask cluster."""

from energymargin.evaluate.executors import *  # noqa: F403
from energymargin.evaluate.executors import __all__ as __all__  # noqa: PLC0414
