import base64
import io
import re
import runpy
from pathlib import Path

import nbformat
import numpy as np
import pytest
from PIL import Image

FOLDER = Path(__file__).parents[2] / "docs/tutorials"
RUN = runpy.run_path(str(FOLDER / "run.py"))
TUTORIALS = RUN["tutorials"]()
# Of this machine, or of a run: folders, addresses of objects, times, warnings.
OF_ONE_RUN = re.compile(r"/tmp|/home|/root|site-packages|0x[0-9a-f]{6}|\d\d:\d\d|Warning|Traceback")
MOST_BYTES = 300_000


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def texts(cell):
    """What a cell prints, as text and as HTML, in order."""
    found = []
    for output in cell.outputs:
        data = output.get("data", {})
        found += [output.get("text")] + [data.get(kind) for kind in ("text/plain", "text/html")]
    return [text for text in found if text is not None]


def pictures(cell):
    """Its PNG pictures as arrays (height, width, 3)."""
    encoded = [output.get("data", {}).get("image/png") for output in cell.outputs]
    return [
        np.array(Image.open(io.BytesIO(base64.b64decode(image))).convert("RGB"))
        for image in encoded
        if image is not None
    ]


@pytest.fixture(scope="module", params=TUTORIALS, ids=lambda path: path.stem)
def tutorial(request):
    """As it is stored, and as a fresh run makes it."""
    return nbformat.read(request.param, as_version=4), RUN["executed"](request.param)


def test_there_are_three_tutorials_and_the_page_of_them_names_each():
    assert [path.stem[0] for path in TUTORIALS] == ["1", "2", "3"]
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


def test_a_tutorial_prints_what_is_stored_in_it_to_the_character(tutorial):
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


def test_the_command_names_the_cell_that_fails_and_leaves_the_file_as_it_was(tmp_path):
    from nbclient.exceptions import CellExecutionError

    path = tmp_path / "broken.ipynb"
    cells = [nbformat.v4.new_code_cell("1 / 0")]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), path)
    before = path.read_bytes()
    with pytest.raises(CellExecutionError, match="ZeroDivisionError"):
        RUN["main"]([path])
    assert path.read_bytes() == before
