"""The tasks of this package that make trajectories; those of published data and of a problem file
only read some."""

from energymargin import tasks

MADE = [name for name in tasks.names() if name != "problem" and not name.startswith("published-")]
