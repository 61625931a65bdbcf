import subprocess
import sys
from pathlib import Path

import energymargin

TOOL = Path(__file__).parents[3] / "tools" / "stubs.py"
WRITTEN = Path(energymargin.regions.__file__).parent / "_core"


def test_the_types_of_the_compiled_module_are_those_that_make_stubs_writes(tmp_path):
    subprocess.run([sys.executable, TOOL, tmp_path], check=True)
    fresh = tmp_path / "energymargin" / "_core"
    for stub in ("__init__.pyi", "regions.pyi"):
        assert (WRITTEN / stub).read_text() == (fresh / stub).read_text(), "run: make stubs"
