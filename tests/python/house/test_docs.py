"""The documentation: it has every name and command, its links lead somewhere, its examples run."""

import importlib
import inspect
import re
import shlex
from pathlib import Path

import pytest
from command_line import every_command, invoke

import energymargin as em
import reference
import reference_headers
from energymargin import _core
from energymargin.act.surrogates import surrogate
from energymargin.evaluate.store import schema
from energymargin.records.datasets import files

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]

API = "\n".join(page.read_text() for page in sorted((DOCS / "api/python").glob("*.md")))
MODULES = re.findall(r"<!-- reference: (energymargin[\w.]*)(?: but .*)? -->", API)
NAMED = {
    name
    for names in re.findall(r"<!-- reference: energymargin[\w.]*: (.*) -->", API)
    for name in names.split(", ")
}
EXTRAS = ("gym", "plots", "report", "viewer")  # of energymargin, imported when they are asked for

# Pages whose Python runs from top to bottom as it is written.
RUNNING = [
    "index.md",
    "ten_minutes.md",
    "formats/datasets.md",
    "formats/grasps.md",
    "guides/grasps.md",
    "guides/choose_and_improve.md",
    "guides/many_states.md",
    "guides/recordings.md",
    "guides/own_problem.md",
    "guides/will_it_hold.md",
    "guides/how_much.md",
    "guides/policies.md",
    "guides/robots.md",
    "guides/set_it_down.md",
]


def documented(thing):
    return bool((inspect.getdoc(thing) or "").strip())


def public(module):
    return getattr(module, "__all__", ())


@pytest.mark.parametrize("name", sorted({*em.__all__, *EXTRAS}))
def test_each_public_name_has_a_docstring_and_is_on_a_page_of_the_interface(name):
    thing = getattr(em, name)
    assert documented(thing)
    of_modules = {
        inside for module in MODULES for inside in public(importlib.import_module(module))
    }
    named = NAMED | of_modules
    on_a_page = f"energymargin.{name}" in MODULES if inspect.ismodule(thing) else name in named
    assert on_a_page, f"docs/api/python has no {name}"


@pytest.mark.parametrize("name", MODULES)
def test_each_public_name_of_a_module_has_a_docstring(name):
    module = importlib.import_module(name)
    assert documented(module)
    things = [getattr(module, name) for name in public(module)]
    without = [t.__name__ for t in things if inspect.isroutine(t) or inspect.isclass(t)]
    assert not [n for n in without if not documented(getattr(module, n, None))]


@pytest.mark.parametrize("module", [_core, _core.regions, _core.disturbances])
def test_each_member_of_a_compiled_class_has_a_docstring(module):
    without = [
        f"{kind.__name__}.{name}"
        for _, kind in inspect.getmembers(module, inspect.isclass)
        for name, member in vars(kind).items()
        if not name.startswith("_") and not documented(member)
    ]
    assert without == []


@pytest.mark.parametrize("page", sorted(reference.pages()), ids=lambda page: page.stem)
def test_a_page_of_the_reference_is_current(page):
    assert page.read_text() == reference.current(page), "python tools/reference.py"


def test_each_module_has_its_public_values_on_its_page():
    page = (DOCS / "api/python/pictures.md").read_text()
    assert "| `CAPTURED_COLOR` | `'#" in page and "| `LOST_COLOR` | `'#" in page


def test_each_public_thing_has_its_heading_its_arguments_and_its_members():
    for name in sorted({*em.__all__} & NAMED):
        assert re.search(rf"(?m)^##+ em\.{name}$", API), name
    (rank,) = re.findall(r"(?ms)^## em\.rank$(.*?)^## ", API)
    arguments = inspect.signature(em.rank).parameters
    assert [name for name in arguments if f"- `{name}`: " not in rank] == []
    (ranking,) = re.findall(r"(?ms)^## em\.Ranking$(.*?)^## ", API)
    assert "| `standings` | The best first:" in ranking and ".to_csv() -> str" in ranking


def test_each_command_and_option_is_on_the_page_of_commands():
    page = (DOCS / "cli.md").read_text()
    found = every_command()
    assert len(found) > 20
    for name, command in found.items():
        (text,) = re.findall(rf"(?ms)^#+ {name}$(.*?)(?=^#|\Z)", page)
        options = [each for each in command.assemble_argument_collection() if each.parse]
        names = [word for each in options for word in each.parameter.name]
        assert all(word in text for word in names if word.startswith("-")), name


def test_each_header_is_on_a_page_with_all_that_it_declares():
    pages = "".join(page.read_text() for page in (DOCS / "api/cpp").glob("*.md"))
    for folder in (".", "metrics", "search"):
        assert f"<!-- reference: headers {folder} -->\n" in pages
        for path in reference_headers.headers(folder):
            text = path.read_text()
            (code,) = re.findall(rf"(?ms)^## {path.stem}$(.*?)(?=^## |^<!-- end)", pages)
            declared = re.findall(r"(?m)^(?:struct|class|enum class) (\w+)\b(?!;)", text)
            assert reference_headers.introduction(text)
            assert all(re.search(rf"\b{name}\b", code) for name in declared), path.name
            assert "namespace energymargin" not in code


def links(page):
    """Relative ones, of a page's Markdown."""
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(), flags=re.DOTALL)
    found = re.findall(r"\]\(([^)\s]+)\)", text)
    return [link for link in found if not re.match(r"[a-z]+:|#", link)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_each_link_of_a_page_leads_to_a_file(page):
    missing = [n for n in links(page) if not (page.parent / n.partition("#")[0]).exists()]
    assert not missing


def test_the_comparison_with_others_denies_nothing_that_the_package_does():
    page = (DOCS / "compared_with.md").read_text()
    for name in ("rank", "improve", "Guard", "Belief", "capture_probability"):
        assert hasattr(em, name) and f"`em.{name}`" in page


def test_the_page_of_promises_has_the_versions_of_the_files():
    page = (DOCS / "stability.md").read_text()
    header = (ROOT / "cpp/include/energymargin/problem_io.hpp").read_text()
    newest, oldest = (
        int(re.search(rf" {name}problem_format_version = (\d+)", header)[1])
        for name in ("", "oldest_")
    )
    for row in (
        rf"problem file\]\(.*\) \| version {newest} \| {oldest} to {newest}",
        rf"dataset\]\(.*\) \| version {files.VERSION} \| {files.VERSION}",
        rf"scores\]\(.*\) \| version {schema.VERSION} \| {schema.VERSION}",
        rf"surrogate\]\(.*\) \| version {surrogate.VERSION} \| {surrogate.VERSION}",
    ):
        assert re.search(rf"(?m)^\| \[.*{row} \|", page), row


def test_each_page_is_in_the_tree_and_each_picture_on_a_page():
    trees = {
        (page.parent / entry).with_suffix("")
        for page in PAGES
        for tree in re.findall(r"```{toctree}\n(.*?)```", page.read_text(), flags=re.DOTALL)
        for entry in tree.split()
        if not entry.startswith(":")
    }
    pages = {page.with_suffix("") for page in PAGES[1:]} - {DOCS / "index"}
    assert pages <= trees
    shown = {(page.parent / link).resolve() for page in PAGES[1:] for link in links(page)}
    assert set(DOCS.rglob("*.png")) <= shown


@pytest.mark.parametrize("page", RUNNING)
def test_each_example_of_a_page_runs_as_it_is_written(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    names: dict = {"__name__": "example"}
    blocks = re.findall(r"(?m)^```(python|sh)\n(.*?)^```", (DOCS / page).read_text(), re.DOTALL)
    for language, text in blocks:
        if language == "python":
            exec(compile(text, page, "exec"), names)
        elif page == "ten_minutes.md":
            run(text)
    pyplot.close("all")


def run(text):
    """Commands of a shell block."""
    for line in text.splitlines():
        if line.startswith("energymargin"):
            done = invoke(shlex.split(line, comments=True)[1:])
            assert done.exit_code == 0, done.output


def test_a_way_that_the_pages_name_is_there():
    """What a newcomer looks for, and what is asked for in its place."""
    assert "suction" in (DOCS / "limits.md").read_text() and hasattr(em.Scene, "add_loop")
    consumer = (ROOT / "tests/cpp/consumer/run.cmake").read_text()
    for page in ((DOCS / "install.md").read_text(), consumer):
        assert "-DCMAKE_PREFIX_PATH=" in page
