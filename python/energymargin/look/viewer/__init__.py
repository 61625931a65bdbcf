"""The tree breaks out of the capture set, in a browser (viser)."""

from energymargin.base.doors import check_doors
from energymargin.base.errors import needs_extra

with needs_extra("the viewer", "viewer"):
    import fast_simplification  # noqa: F401
    import skimage  # noqa: F401
    import trimesh  # noqa: F401
    import viser  # noqa: F401

from energymargin.look.viewer.view import Viewer, view

__all__ = ["Viewer", "view"]

check_doors(globals(), __all__)
