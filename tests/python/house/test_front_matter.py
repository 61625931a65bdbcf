import calendar
import re
from importlib.metadata import Distribution, version
from pathlib import Path

import pytest
import yaml
from scikit_build_core.build import prepare_metadata_for_build_wheel

from energymargin.evaluate.searches import ALGORITHM, ALGORITHM_IMPROVED

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text()
PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
MOST_LINES = {"README.md": 80, "CONTRIBUTING.md": 120}
WIDEST = 160  # characters
SCREEN = 64  # lines
# The model of the README's example of MuJoCo.
CUP = """<mujoco><worldbody><geom type="plane" size="1 1 0.1"/><body name="cup" pos="0 0 0.05">
<freejoint/><geom type="cylinder" size="0.03 0.05" mass="0.3"/></body></worldbody></mujoco>"""
# Those that Citation File Format 1.2.0 asks of every file, and of every reference.
OF_CITATION = {"cff-version", "message", "title", "authors"}
OF_REFERENCE = {"type", "title", "authors"}


def cmake_version():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"^project\(energymargin VERSION (\S+)", text, re.MULTILINE)[1]


def changelog_versions():
    return re.findall(r"^## \[(\d.*?)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)


def citation():
    return yaml.safe_load((ROOT / "CITATION.cff").read_text())


def parts(number):
    return tuple(int(part) for part in number.split("."))


def test_the_version_stands_in_cmakelists_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    folder = prepare_metadata_for_build_wheel(str(tmp_path))
    assert Distribution.at(tmp_path / folder).version == cmake_version()
    assert cmake_version() not in (ROOT / "pyproject.toml").read_text()


def test_the_installed_package_has_that_version():
    assert version("energymargin") == cmake_version()


def test_debians_library_has_the_name_of_that_version():
    name = f"libenergymargin{'.'.join(cmake_version().split('.')[:2])}"
    assert f"Package: {name}\n" in (ROOT / "debian/control").read_text()
    assert (ROOT / f"debian/{name}.install").exists()


def test_changelog_and_citation_have_that_version():
    assert changelog_versions()[0] == cmake_version()
    assert citation()["version"] == cmake_version()


def test_the_changelog_has_each_version_once_the_newest_first():
    found = [parts(number) for number in changelog_versions()]
    assert found == sorted(set(found), reverse=True)


def test_a_version_of_the_changelog_fits_a_screen():
    sections = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert {text.split()[0] for text in sections[1:] if text.count("\n") > SCREEN} == set()


def test_the_changelog_says_of_the_version_that_moved_scores_last_that_it_did():
    sections = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    for algorithm, name in ((ALGORITHM, "ALGORITHM"), (ALGORITHM_IMPROVED, "ALGORITHM_IMPROVED")):
        (section,) = (text for text in sections if text.startswith(f"[{algorithm}]"))
        assert f"`{name}`" in section


def test_the_citation_has_the_keys_that_its_format_requires():
    cited = citation()
    assert cited["cff-version"] == "1.2.0"
    assert cited.keys() >= OF_CITATION
    assert cited["license"] == "BSD-3-Clause"
    assert cited["preferred-citation"].keys() >= OF_REFERENCE
    for author in (*cited["authors"], *cited["preferred-citation"]["authors"]):
        assert "name" in author or {"family-names", "given-names"} <= author.keys()


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_short_and_its_lines_are(page):
    lines = (ROOT / page).read_text().splitlines()
    assert len(lines) <= MOST_LINES.get(page, len(lines))
    assert [line for line in lines if len(line) >= WIDEST] == []


def test_the_readme_names_the_two_commands_of_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for target in ("demo", "test"):
        assert re.search(rf"^make {target} ", README, re.MULTILINE)
        assert re.search(rf"^{target}:", makefile, re.MULTILINE)
    assert "\nmake test\n" in (ROOT / ".ci" / "run").read_text()


def test_the_readme_s_examples_print_what_they_say(tmp_path, monkeypatch, capsys):
    (tmp_path / "scene.xml").write_text(CUP)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    examples = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        printed = re.search(r"((?:^# .*\n)*)\Z", example, re.MULTILINE)[1]
        exec(compile(example, "README.md", "exec"), names)
        out = capsys.readouterr().out
        assert printed in ("", re.sub("^", "# ", out.rstrip("\n"), flags=re.MULTILINE) + "\n")
        assert out


def test_each_figure_of_the_readme_is_on_the_page_of_its_command():
    """With the version and the date of its block."""
    results = ROOT / "docs/results"
    index = (results / "index.md").read_text()
    asked = re.search(r"\| what came out \((\S+), (.*?); \[all", README)
    rows = re.findall(
        r"^\| [^|]+ \| (.*) \(`(energymargin reproduce .*?)`(?:, (\S+), (.*))?\) \|$",
        *(README, re.MULTILINE),
    )
    assert len(rows) == 5
    for figures, command, build, date in rows:
        (line,) = (line for line in index.splitlines() if f"| `{command}` |" in line)
        block = r"\((\w+\.md)\) \| (\S+) \| \w* *\| (\S+)-(\S+)-(\S+) \|"
        page, version_of_block, year, month, day = re.search(block, line).groups()
        assert version_of_block == (build or asked[1])
        made = date or asked[2]
        assert str(int(day)) in made.split() and f"{calendar.month_name[int(month)]} {year}" in made
        text = (results / page).read_text()
        assert [n for n in re.findall(r"\d*\.?\d+", figures) if n not in text] == []


@pytest.fixture
def metadata(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    return Distribution.at(tmp_path / prepare_metadata_for_build_wheel(str(tmp_path))).metadata


def test_a_wheel_has_the_licence_of_each_library_within_it(metadata):
    table = (ROOT / "licenses/README.md").read_text()
    texts = {f"licenses/{name}" for name in re.findall(r"\[(\w+\.txt)\]", table)}
    assert len(texts) == 7
    assert {"LICENSE", *texts} <= set(metadata.get_all("License-File"))


def test_the_recipe_of_conda_has_that_version_and_the_dependencies_of_the_package(metadata):
    recipe = yaml.safe_load((ROOT / "conda/recipe.yaml").read_text())
    assert recipe["context"]["version"] == cmake_version()
    assert recipe["about"]["license"] == metadata["License-Expression"]
    needed = {spec.replace(" ", "") for spec in recipe["requirements"]["run"][1:]}
    assert needed == {spec for spec in metadata.get_all("Requires-Dist") if "extra" not in spec}
