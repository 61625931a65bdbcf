"""The package's floors: each stands on those below it, and nobody below knows the public face."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "python" / "energymargin"
FLOORS = ("base", "model", "tasks", "evaluate", "records", "act", "look")
COMPANIONS = {"grasps", "mujoco"}  # they stand on the face, and are looked at
# Modules of the face that are compiled, so that every floor may ask for them.
COMPILED = {"_core", "disturbances", "regions"}
# What is imported when it is asked for: words of a result, and the picture of an environment.
UPWARDS = {
    ("base/summary.py", "model"),
    ("act/gym/environment.py", "look"),
}


def imported(path: Path) -> set[str]:
    """The parts of the package from which a file takes names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == PACKAGE.name:
            parts = (node.module or "").split(".")[1:2]
            found |= set(parts) if parts else {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            found |= {name[1] for name in names if name[0] == PACKAGE.name and len(name) > 1}
    return found


@pytest.mark.parametrize("floor", FLOORS)
def test_a_floor_stands_on_those_below_it(floor):
    below = {*FLOORS[: FLOORS.index(floor) + 1], *COMPILED}
    for path in sorted((PACKAGE / floor).rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        allowed = below | {other for file, other in UPWARDS if file == name}
        allowed |= COMPANIONS if floor == "look" else set()
        names = {part for part in imported(path) if part[0].islower() or part == "_core"}
        assert names <= allowed, f"{name} imports {sorted(names - allowed)}"


def test_the_face_is_names_alone():
    for path in sorted(PACKAGE.glob("*.py")):
        if path.stem in {"__init__", "__main__", *COMPILED}:
            continue
        kinds = {type(node) for node in ast.parse(path.read_text()).body}
        assert kinds <= {ast.Expr, ast.ImportFrom, ast.Assign}, path.name
