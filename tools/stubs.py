"""Stubs of the compiled module: `python tools/stubs.py [FOLDER]`.

Its constructors and functions are taken as they are compiled, without what explains wrong calls.
"""

from __future__ import annotations

import sys
from inspect import isclass, unwrap

from pybind11_stubgen import main as write_stubs

from energymargin import _core


def main(folder: str = "python") -> None:
    """Writes them into a folder, of itself beside the package's sources."""
    for module in (_core, _core.disturbances, _core.regions):
        for kind in filter(isclass, vars(module).values()):
            for name, method in list(vars(kind).items()):
                compiled = unwrap(method)
                if compiled is not method:
                    is_static = isinstance(method, staticmethod)
                    setattr(kind, name, staticmethod(compiled) if is_static else compiled)
    write_stubs(("energymargin._core", "-o", folder, "--enum-class-locations", ".+:_core"))


if __name__ == "__main__":
    main(*sys.argv[1:])
