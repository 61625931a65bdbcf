"""A file of scores as one page that opens anywhere, without a network: tables, curves, and
pictures of the states that the scores get most wrong; and scores of grasps as such a page.

Needs the extra [report].
"""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("a report", "report"):
    import jinja2  # noqa: F401
    import matplotlib  # noqa: F401

from energymargin.look.report.page import Options, write, write_grasps

__all__ = ["Options", "write", "write_grasps"]

check_doors(globals(), __all__)
