"""The command line: `application` joins the commands, each of which is a file beside it.

Other packages use the terminal, the progress bars and the options, and may bring a command
themselves.
"""

from energymargin.cli.application import app, main, run

__all__ = ["app", "main", "run"]
