"""A file of scores as one page that opens anywhere, without a network: tables, curves, and"""

from energymargin.look.report import *  # noqa: F403
from energymargin.look.report import __all__ as __all__  # noqa: PLC0414
