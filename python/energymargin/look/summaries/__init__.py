"""The summary of each class: a function of its name, as `summary` looks for it."""

from collections import ChainMap

from energymargin.look.summaries import companions, scores, searches

SUMMARIES = ChainMap(*map(vars, (searches, scores, companions)))
"""All functions by their names."""
