"""The tree breaks out of the capture set, in a browser (viser)."""

try:
    import fast_simplification  # noqa: F401
    import skimage  # noqa: F401
    import trimesh  # noqa: F401
    import viser  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"the viewer needs {error.name}: pip install 'energymargin[viewer]'"
    ) from error

from energymargin.viewer.view import Viewer, view

__all__ = ["Viewer", "view"]
