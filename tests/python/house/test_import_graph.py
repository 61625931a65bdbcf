"""Imports of the package's modules: no circles, and the product stands without the studies.

Every import counts: those inside functions, and those of types alone (TYPE_CHECKING), too.
"""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import energymargin

PACKAGE = Path(energymargin.__file__).parent
STUDIES = "energymargin_paper"


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path):
    """What each import names: a module, and what of it; of `import a` the latter is a itself."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            yield from ((node.module, f"{node.module}.{alias.name}") for alias in node.names)


def import_graph(modules):
    """By module, the modules that it imports: of the root, which is lazy, what is named."""
    return {
        name: {
            member if member in modules else module
            for module, member in imported(path)
            if (module in modules or member in modules)
        }
        - {PACKAGE.name}
        for name, path in modules.items()
    }


def circle_in(graph):
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return None


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def test_no_two_modules_import_each_other():
    graph = import_graph(MODULES)
    assert sum(map(len, graph.values())) > 300
    assert circle_in(graph) is None


def test_a_circle_would_be_found(tmp_path):
    """Also one whose imports never run at once."""
    (tmp_path / "a.py").write_text("def f():\n    import b\n")
    (tmp_path / "b.py").write_text("if TYPE_CHECKING:\n    from c import Name\n")
    (tmp_path / "c.py").write_text("from a import f\n")
    modules = {name: tmp_path / f"{name}.py" for name in "abc"}
    assert set(circle_in(import_graph(modules))) == {"a", "b", "c"}


def test_the_product_does_not_import_the_studies():
    importers = [
        name
        for name, path in MODULES.items()
        for module, _ in imported(path)
        if module.split(".")[0] == STUDIES
    ]
    assert not importers
