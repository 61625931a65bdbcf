"""A state with its tree, its sets and its escape as a page that turns and plays (three.js)."""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("the viewer", "viewer"):
    import fast_simplification  # noqa: F401
    import matplotlib  # noqa: F401
    import skimage  # noqa: F401

from energymargin.look.viewer.page import Page
from energymargin.look.viewer.view import view

__all__ = ["Page", "view"]

check_doors(globals(), __all__)
