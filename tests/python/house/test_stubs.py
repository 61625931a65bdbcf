import subprocess
import sys
from pathlib import Path

import energymargin

WRITTEN = Path(energymargin.regions.__file__).parent / "_core"


def test_the_types_of_the_compiled_module_are_those_that_make_stubs_writes(tmp_path):
    command = [sys.executable, "-m", "pybind11_stubgen", "energymargin._core", "-o", tmp_path]
    subprocess.run([*command, "--enum-class-locations", ".+:_core"], check=True)
    fresh = tmp_path / "energymargin" / "_core"
    for stub in ("__init__.pyi", "regions.pyi"):
        assert (WRITTEN / stub).read_text() == (fresh / stub).read_text(), "run: make stubs"
