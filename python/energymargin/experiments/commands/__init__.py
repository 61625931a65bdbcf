"""The commands of `energymargin reproduce`.

Heavy modules are imported where they are used, so that --help answers at once.
"""

from energymargin.experiments.commands import paper  # the order of --help

# isort: split
from energymargin.experiments.commands import checks

# isort: split
from energymargin.experiments.commands import everything
from energymargin.experiments.commands.shared import app

__all__ = ["app", "checks", "everything", "paper"]
