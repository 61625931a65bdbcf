"""The future of a problem: its states without a disturbance, and what it asks of it in words."""

from energymargin.base.doors import check_doors
from energymargin.evaluate.futures import Undisturbed, future_rows, undisturbed, uniform_in_words

__all__ = ["Undisturbed", "future_rows", "undisturbed", "uniform_in_words"]

check_doors(globals(), __all__)
