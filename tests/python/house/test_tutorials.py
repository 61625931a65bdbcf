import ast
import base64
import io
import re
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from PIL import Image

import energymargin as em
from code_lines import code_lines

FOLDER = Path(__file__).parents[3] / "docs/tutorials"
RUN = runpy.run_path(str(FOLDER / "run.py"))
TUTORIALS = RUN["tutorials"]()
GRIPPER = FOLDER / "7_your_gripper_your_object.ipynb"
# Of this machine, or of a run: folders, addresses of objects, times, warnings.
OF_ONE_RUN = re.compile(r"/tmp|/home|/root|site-packages|0x[0-9a-f]{6}|\d\d:\d\d|Warning|Traceback")
MOST_BYTES = 300_000
LONG = re.compile(r"\d+\.\d{12,}")  # numbers whose last digits a processor chooses, in numpy
# Whose bytes have the version of what drew it; it is compared as a picture.
EMBEDDED = re.compile(r"data:image/png;base64,([\w+/=]+)")


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def texts(cell):
    """What a cell prints, as text and as HTML, in order."""
    found = []
    for output in cell.outputs:
        data = output.get("data", {})
        found += [output.get("text")] + [data.get(kind) for kind in ("text/plain", "text/html")]
    told = [EMBEDDED.sub("a picture", text) for text in found if text is not None]
    return [LONG.sub(lambda number: f"{float(number[0]):.10g}", text) for text in told]


def pictures(cell):
    """Its PNG pictures as arrays (height, width, 3)."""
    encoded = []
    for output in cell.outputs:
        data = output.get("data", {})
        encoded += [data["image/png"]] if "image/png" in data else []
        encoded += EMBEDDED.findall(data.get("text/html", ""))
    opened = (Image.open(io.BytesIO(base64.b64decode(image))) for image in encoded)
    return [np.array(image.convert("RGB")) for image in opened]


@pytest.fixture(scope="module", params=TUTORIALS, ids=lambda path: path.stem)
def tutorial(request):
    """As it is stored, and as a fresh run makes it."""
    return nbformat.read(request.param, as_version=4), RUN["executed"](request.param)


def test_there_are_nine_tutorials_and_the_page_of_them_names_each():
    assert [path.stem[0] for path in TUTORIALS] == list("123456789")
    page = (FOLDER / "index.md").read_text()
    assert all(f"({path.name})" in page for path in TUTORIALS)


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_a_stored_tutorial_is_small_and_holds_nothing_of_one_run_alone(path):
    stored = nbformat.read(path, as_version=4)
    nbformat.validate(stored)
    assert path.stat().st_size < MOST_BYTES
    assert [cell.execution_count for cell in code_cells(stored)] == list(
        range(1, len(code_cells(stored)) + 1)
    )
    for cell in code_cells(stored):
        assert {output.get("name", "stdout") for output in cell.outputs} <= {"stdout"}
        assert not [text for text in texts(cell) if OF_ONE_RUN.search(text)]


def test_a_tutorial_prints_what_is_stored_in_it_with_numbers_to_ten_digits(tutorial):
    stored, fresh = tutorial
    assert any(texts(cell) for cell in code_cells(stored))
    for before, now in zip(code_cells(stored), code_cells(fresh), strict=True):
        assert now.id == before.id
        assert texts(now) == texts(before), before.id


def test_a_tutorial_draws_its_pictures_and_none_is_blank(tutorial):
    stored, fresh = tutorial
    assert any(pictures(cell) for cell in code_cells(stored))
    for before, now in zip(code_cells(stored), code_cells(fresh), strict=True):
        assert len(pictures(now)) == len(pictures(before)), before.id
        for picture in pictures(before) + pictures(now):
            assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10, before.id


def ranked_grasps():
    """The cells of the fourth tutorial up to its ranked list, and what each seed printed below."""
    cells = code_cells(nbformat.read(FOLDER / "4_grasps_from_mjcf.ipynb", as_version=4))
    ranking = next(place for place, cell in enumerate(cells) if "sorted(" in cell.source)
    return cells[: ranking + 1], "".join(texts(cells[-1])).splitlines()


def test_five_grasps_are_ranked_in_at_most_twenty_statements():
    cells, _ = ranked_grasps()
    nodes = [node for cell in cells for node in ast.walk(ast.parse(cell.source))]
    lone = [node for node in nodes if isinstance(node, ast.Expr)]
    docstrings = [node for node in lone if isinstance(node.value, ast.Constant)]
    statements = [node for node in nodes if isinstance(node, ast.stmt) and node not in docstrings]
    assert len(statements) <= 20
    ranked = [float(line.split()[0]) for line in "".join(texts(cells[-1])).splitlines()]
    assert len(ranked) == 5
    assert ranked == sorted(ranked, reverse=True)
    assert ranked[0] > ranked[-1]


def test_more_force_and_more_friction_hold_the_grasp_better_with_each_seed():
    _, lines = ranked_grasps()
    assert len(lines) == 5
    for line in lines:
        low, middle, high, smooth, usual, rough = map(float, re.findall(r"\d\.\d\d(?!,)", line))
        assert low < middle < high
        assert smooth < usual < rough


def gripped(change=str):
    """The seventh tutorial's probability, its code changed, from its cells up to the last."""
    names = {}
    for cell in code_cells(nbformat.read(GRIPPER, as_version=4))[:-1]:
        exec(change(cell.source), names)
    plt.close("all")
    return em.capture_probability(names["grip"].replace(horizon=1.0), rollouts=100)


def test_a_gripper_and_an_object_take_fifteen_lines_and_the_words_say_what_comes_out():
    notebook = nbformat.read(GRIPPER, as_version=4)
    assert sum(code_lines(cell.source) for cell in code_cells(notebook)) <= 15
    words = r"(\d\.\d\d) of the futures, with a 95 % interval from (\d\.\d\d) to (\d\.\d\d)"
    said = list(map(float, re.search(words, notebook.cells[-1].source).groups()))
    found = gripped()
    assert [found.captured, *found.interval()] == pytest.approx(said, abs=0.1)


@pytest.mark.parametrize(
    "more",
    ["damping=50, torque_limit=40)})", "damping=50)}, frictions=dict.fromkeys(PADS, 1.5))"],
    ids=["force", "rubber"],
)
def test_what_the_seventh_tutorial_says_would_help_does(more):
    pads = "PADS = ('panda_leftfinger', 'panda_rightfinger')\n"
    changed = gripped(lambda source: pads + source.replace("damping=50)})", more))
    assert changed.captured > 0.97


def test_a_policy_takes_25_lines_and_holds_better_than_its_plan_unless_it_is_late():
    cells = code_cells(nbformat.read(FOLDER / "8_how_robust_is_my_policy.ipynb", as_version=4))
    assert sum(code_lines(cell.source) for cell in cells) <= 25
    told = "".join(texts(cells[-1])[:1]).splitlines()
    plan, policy, late = (list(map(float, re.findall(r"\d\.\d\d", line))) for line in told)
    assert all(np.array(policy) > plan)
    assert late[0] > plan[0] and late[-1] < plan[-1]


def test_the_command_names_the_cell_that_fails_and_leaves_the_file_as_it_was(tmp_path):
    from nbclient.exceptions import CellExecutionError

    path = tmp_path / "broken.ipynb"
    cells = [nbformat.v4.new_code_cell("1 / 0")]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), path)
    before = path.read_bytes()
    with pytest.raises(CellExecutionError, match="ZeroDivisionError"):
        RUN["main"]([path])
    assert path.read_bytes() == before
