"""Whether the installed package has the golden values, to the last bit."""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "golden"))
import make

import energymargin as em

golden = json.loads((make.FOLDER / "values.json").read_text())["values"]
for file in make.problem_files():
    found = make.values(file.stem, em.Problem.load(file))
    if found != golden[file.stem]:
        sys.exit(f"{file.stem} has {found}, expected {golden[file.stem]}")
print(f"{len(golden)} problems have their golden values")
