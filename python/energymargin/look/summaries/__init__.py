"""The summary of each class: a function of its name, as `summary` looks for it."""

from collections import ChainMap

from energymargin.look.summaries import grasps, limits, placing, plans, scores, searches

SUMMARIES = ChainMap(*map(vars, (searches, scores, plans, limits, grasps, placing)))
"""All functions by their names."""
