"""How well scores tell robust states from fragile ones (Section VI-E, Table I)."""

from energymargin.records.evaluation import *  # noqa: F403
from energymargin.records.evaluation import (
    __all__ as __all__,  # noqa: PLC0414
    bootstrap as bootstrap,  # noqa: PLC0414
    curves as curves,  # noqa: PLC0414
)
