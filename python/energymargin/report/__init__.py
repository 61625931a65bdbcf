"""A file of scores as one page that opens anywhere, without a network: tables, curves, and
pictures of the states that the scores get most wrong.

Needs the extra [report].
"""

try:
    import jinja2  # noqa: F401
    import matplotlib  # noqa: F401
except ImportError as error:
    raise ImportError(f"a report needs {error.name}: pip install 'energymargin[report]'") from error

from energymargin.report.page import Options, write

__all__ = ["Options", "write"]
