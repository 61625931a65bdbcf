"""The package's floors: each stands on those below it, and nobody below knows the public face."""

import ast
import re
from pathlib import Path

import pytest

import energymargin as em

PACKAGE = Path(__file__).parents[3] / "python" / "energymargin"
FLOORS = ("base", "model", "tasks", "evaluate", "records", "act", "look")
COMPANIONS = {"grasps", "mujoco", "placing"}  # they stand on the face, and are looked at
ON_THE_FACE = (
    "act/surrogates",
    "cli",
    "grasps",
    "look/report",
    "look/viewer",
    "mujoco",
    "placing",
    "records/recordings",
)
FACE = {path.stem for path in PACKAGE.glob("[a-z]*.py")} | {"grasps", "mujoco", "placing", "tasks"}
# Modules of the face that are compiled, so that every floor may ask for them.
COMPILED = {"_core", "disturbances", "regions"}
# What is imported when it is asked for: words of a result, the picture of an environment, and the
# MuJoCo inside of one.
UPWARDS = {
    ("base/summary.py", "model"),
    ("act/gym/environment.py", "look"),
    ("model/gymnasium_engine.py", "mujoco"),
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
        allowed |= FACE if name.startswith(ON_THE_FACE) else set()
        names = {part for part in imported(path) if part[0].islower() or part == "_core"}
        assert names <= allowed, f"{name} imports {sorted(names - allowed)}"


def taken(path: Path) -> set[str]:
    """What a file imports of the package, and what it takes of `em`, by their full names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Attribute):
            found.add(re.sub(r"^em\.", "energymargin.", ast.unparse(node)))
    return {name[13:] for name in found if re.fullmatch(r"energymargin\.[\w.]+", name)}


def is_public(name: str) -> bool:
    """Whether users find it: a name of `em`, or of one of the modules of its face."""
    first, *rest = name.split(".")
    if first not in FACE:
        return first in dir(em)
    module = getattr(em, first)
    names = module.__all__ if hasattr(module, "__path__") else dir(module)
    return not rest or rest[0] in names


@pytest.mark.parametrize("companion", ON_THE_FACE)
def test_a_companion_takes_public_names_alone(companion):
    """Beside those of its own floor, and the plain helpers of `base`."""
    own = (companion.partition("/")[0] + ".", "base.")
    for path in sorted((PACKAGE / companion).rglob("*.py")):
        private = {n for n in taken(path) if not (n.startswith(own) or is_public(n))}
        assert not private, f"{path.relative_to(PACKAGE)} takes {sorted(private)}"


def test_a_private_name_is_seen(tmp_path):
    path = tmp_path / "module.py"
    taking = (
        "from energymargin._core import Box",
        "em.store.file",
        "em.model",
        "em.store.load(em.Box)",
    )
    path.write_text("\n".join(["import energymargin as em", *taking]))
    private = {name for name in taken(path) if not is_public(name)}
    assert private == {"_core.Box", "store.file", "model"}


def test_the_face_is_names_alone():
    for path in sorted(PACKAGE.glob("*.py")):
        if path.stem in {"__init__", "__main__", *COMPILED}:
            continue
        kinds = {type(node) for node in ast.parse(path.read_text()).body}
        assert kinds <= {ast.Expr, ast.ImportFrom, ast.Assign}, path.name
