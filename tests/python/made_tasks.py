"""The tasks of this package that make trajectories; those of published data only read some."""

from energymargin import tasks

MADE = [name for name in tasks.names() if not name.startswith("published-")]
