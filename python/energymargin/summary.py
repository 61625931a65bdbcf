"""Summaries of results: rows, rendered for a terminal, for a notebook (HTML) and as Markdown."""

from energymargin.base.summary import *  # noqa: F403
from energymargin.base.summary import __all__ as __all__  # noqa: PLC0414
