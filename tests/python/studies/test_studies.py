"""What all studies share, their commands, and that the product does not need them."""

import ast
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import invoke, run
from cyclopts import CoercionError

import energymargin
from energymargin.cli import app
from energymargin_paper import STUDIES, load
from energymargin_paper.commands import command, make
from energymargin_paper.pieces import PIECES
from energymargin_paper.reproduce import _chosen
from energymargin_paper.study import Study, setting

PRODUCT = Path(energymargin.__file__).parent


@dataclass(frozen=True)
class Settings:
    """Of a study that squares numbers."""

    numbers: tuple[int, ...] = setting((1, 2, 3), "To be squared, with commas between.")
    power: int = setting(2, "Of each number.", shown="two")
    sign: float = 1.0

    def __post_init__(self):
        if self.power < 1:
            raise ValueError(f"power is {self.power}, expected at least 1")


@dataclass(frozen=True)
class Squares:
    """What came out."""

    values: list[float]

    def to_markdown(self):
        return f"# Squares\n\n{self.values}\n"

    def to_csv(self):
        return "".join(f"{value}\n" for value in self.values)


class SquaresStudy(Study[Settings, Squares]):
    """What becomes of numbers."""

    name = "squares-of-numbers"
    title, unit = "Squaring", "numbers"
    settings = Settings()
    quick = Settings(numbers=(7,))

    def compute(self, settings, folder, threads, progress):
        for done in range(len(settings.numbers)):
            progress(done, len(settings.numbers))
        return Squares([settings.sign * n**settings.power for n in settings.numbers])

    def figures(self, result):
        from matplotlib.figure import Figure

        yield "squares.png", Figure()


STUDY = SquaresStudy()


def test_a_study_writes_its_tables_and_numbers_and_returns_its_result(tmp_path):
    seen = []
    folder = tmp_path / "new" / "folder"
    result = STUDY.reproduce(Settings(), folder, progress=lambda *counts: seen.append(counts))
    assert result.values == [1, 4, 9]
    assert (folder / "squares_of_numbers.md").read_text() == "# Squares\n\n[1.0, 4.0, 9.0]\n"
    assert (folder / "squares_of_numbers.csv").read_text() == "1.0\n4.0\n9.0\n"
    assert seen == [(0, 3), (1, 3), (2, 3)]


def test_bad_threads_are_named_before_anything_is_written(tmp_path):
    with pytest.raises(ValueError, match="threads is 0"):
        STUDY.reproduce(Settings(), tmp_path / "new", threads=0)
    assert not (tmp_path / "new").exists()


def called(*words):
    """What the command of the study does with words; its errors are raised."""
    app.command(command(STUDY))
    try:
        app([STUDY.name, *map(str, words)])
    finally:
        del app[STUDY.name]


def test_its_settings_are_the_options_of_its_command(tmp_path, capsys):
    called("--numbers", "2, 5", "--power", 3, "--output", tmp_path / "a")
    assert (tmp_path / "a" / "squares_of_numbers.csv").read_text() == "8.0\n125.0\n"
    assert (tmp_path / "a" / "squares.png").exists()
    shown = capsys.readouterr()
    assert "# Squares" in shown.out
    assert "squares.png, squares_of_numbers.csv, squares_of_numbers.md" in shown.err
    called("--help")
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "What becomes of numbers." in text
    assert "To be squared, with commas between. [default: 1,2,3]" in text
    assert "[default: two]" in text and "--sign" not in text
    assert "A first picture: --numbers 7." in text
    assert "out/squares-of-numbers, or out/squares-of-numbers-quick" in text


def test_quick_takes_what_is_given_beside_it_and_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    called("--quick", "--power", 1)
    folder = tmp_path / "out" / "squares-of-numbers-quick"
    assert (folder / "squares_of_numbers.csv").read_text() == "7.0\n"


def test_what_cannot_be_is_named_before_anything_is_written(tmp_path):
    for words, message in (
        (("--power", 0), "power is 0"),
        (("--numbers", "1,few"), "numbers has 'few', expected whole numbers"),
    ):
        with pytest.raises((ValueError, CoercionError), match=message):
            called(*words, "--output", tmp_path / "new")
    assert not (tmp_path / "new").exists()


class StoppedStudy(SquaresStudy):
    """Somebody presses Ctrl-C."""

    def compute(self, settings, folder, threads, progress):
        raise KeyboardInterrupt


def test_ctrl_c_says_that_it_goes_on(tmp_path, capsys):
    with pytest.raises(KeyboardInterrupt):
        make(StoppedStudy(), Settings(), tmp_path)
    assert "the same command goes on from there" in capsys.readouterr().err


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_of_the_list_has_its_name_and_a_command_with_help(name):
    one = load(name)
    assert one.name == name
    assert one.quick != one.settings
    done = invoke(["reproduce", name, "--help"])
    text = " ".join(done.output.replace("│", " ").split())
    assert done.exit_code == 0 and "--quick" in text and "--output" in text
    assert f"Example: energymargin reproduce {name}" in text
    assert ("--threads" in text) == one.threaded


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("all --only table3", "only has 'table3', expected some of tosses"),
        ("all --only published", "only has 'published', which needs --data DIR"),
        ("all --minutes 0", "minutes is 0"),
        ("foresight --tasks juggle", "juggle"),
        ("guard --episodes 0", "episodes is 0"),
        ("perturbation --levels some", "levels has 'some', expected numbers"),
        ("perturbation --levels 0,2", "levels has 2.0, expected numbers from 0 to 1"),
        ("perturbation --levels 0,nan", "levels has nan"),
        ("perturbation --draws 0", "draws is 0"),
        ("perturbation --nodes 0", "nodes is 0"),
        ("perturbation --trajectories 2", "expected so many that some fail and some succeed"),
        ("table2 --combinations cube-jaw", "combinations has 'cube-jaw', expected some of"),
        ("table2 --nodes 0", "nodes is 0"),
    ],
)
def test_a_bad_option_is_named_and_no_result_is_written(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = invoke(["reproduce", *words.split()])
    assert done.exit_code == 2 and message in " ".join(done.output.split())
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".md", ".csv", ".png")]


def test_help_lists_all_studies_and_imports_none():
    code = (
        "import sys\nfrom energymargin.cli import app\n"
        "app(['reproduce', '--help'])\n"
        "print([name for name in sys.modules if name.startswith('energymargin_paper.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert all(f" {name} " in done.stdout for name in (*STUDIES, "all"))
    modules = ast.literal_eval(done.stdout.splitlines()[-1])
    assert "energymargin_paper.reproduce" in modules
    studies = ("energymargin_paper.paper.", "energymargin_paper.evidence.")
    assert not [name for name in modules if name.startswith(studies)]


def test_the_product_imports_no_study():
    importing = []
    for path in PRODUCT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if any(name.partition(".")[0] == "energymargin_paper" for name in names):
                importing.append(path)
    assert importing == []


def test_a_command_says_which_package_it_needs(tmp_path, monkeypatch):
    """As `energymargin reproduce` where the package of the studies was removed."""
    about = tmp_path / "absent-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: absent\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[energymargin.commands]\nstudy-them = absent_studies.commands:app\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = run("study-them", "table1", "--quick", cwd=tmp_path)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "`energymargin study-them` needs the package absent_studies" in done.stderr
    assert "install absent_studies" in done.stderr
    shown = run("--help", cwd=tmp_path)
    assert shown.returncode == 0
    assert "study-them" in shown.stdout and "reproduce" in shown.stdout


def test_a_piece_is_chosen_by_its_name_and_all_pieces_of_a_study_by_its():
    def names(only):
        return [piece.name for piece in _chosen(PIECES, only, Path("data"))]

    assert names("table1") == ["table1"]
    assert names("grasps") == ["grasps-b", "grasps-c", "grasps-a"]
    assert names("act,table1-bullet") == ["act", "table1-bullet"]
