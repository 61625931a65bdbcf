"""The search behind one metric of one problem, as of `em.score`: with its tree or rollouts."""

from energymargin.base.doors import check_doors
from energymargin.evaluate.searches import (
    SearchSettings,
    algorithm,
    metric_search,
    metrics_of,
    value_of,
)

__all__ = ["SearchSettings", "algorithm", "metric_search", "metrics_of", "value_of"]

check_doors(globals(), __all__)
