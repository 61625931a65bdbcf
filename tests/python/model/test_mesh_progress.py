"""How far a decomposition is: for Python, and as a bar that commands draw."""

import functools
import io

import pytest
from mesh_files import angle, bars, written
from rich.console import Console
from urdf_files import INERTIAL, built, chain, joint, link

import energymargin as em
from energymargin.base.bars import bar, bars_by
from energymargin.cli import application
from energymargin.cli.terminal import progress_bar
from energymargin.model.meshes import convex, mesh


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ENERGYMARGIN_CACHE", str(tmp_path / "cache"))


@pytest.mark.usefixtures("own_cache")
def test_the_solids_of_a_file_are_counted(tmp_path):
    far = bars()
    far.apply_translation((1, 0, 0))
    reports = []
    mesh(written(tmp_path, bars() + far), progress=lambda *counts: reports.append(counts))
    assert reports == [(0, 2), (1, 2), (2, 2)]


@pytest.mark.usefixtures("own_cache")
def test_a_file_of_several_solids_says_once_that_it_is_decomposed(tmp_path, caplog):
    far = bars()
    far.apply_translation((1, 0, 0))
    mesh(written(tmp_path, bars() + far))
    assert len(caplog.records) == 1


@pytest.mark.usefixtures("own_cache")
def test_a_decomposition_that_takes_long_names_a_faster_way_and_says_how_long(
    tmp_path, caplog, monkeypatch
):
    monkeypatch.setattr(convex, "PATIENCE", 0.0)
    mesh(angle(tmp_path))
    first, *others = (record.message for record in caplog.records)
    assert "angle.stl of 20 triangles" in first and "simplify_quadric_decimation" in first
    assert all(text.endswith("angle.stl for 0 s so far") for text in others[:3]) and others


@pytest.mark.usefixtures("own_cache")
def test_the_links_of_a_robot_are_counted(tmp_path):
    angle(tmp_path)
    shape = '<collision><geometry><mesh filename="angle.stl"/></geometry></collision>'
    text = chain(joint("ab", "a", "b"), links="a").replace(
        "</robot>", link("b", INERTIAL + shape) + "</robot>"
    )
    reports = []
    scene = built(
        tmp_path,
        text,
        progress=lambda *counts: reports.append(counts),
        inertia="shapes",
        self_collision=False,
    )
    assert len(scene.bodies[1].shape.parts) >= 2
    assert reports == [(0, 2), (1, 2), (2, 2)]


@pytest.mark.usefixtures("own_cache")
def test_what_a_progress_raises_ends_the_decomposition(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh(angle(tmp_path), progress=stop)
    assert not (tmp_path / "cache").exists()


@pytest.mark.usefixtures("own_cache")
def test_within_another_bar_it_is_a_row_until_its_end(tmp_path):
    file, text = angle(tmp_path), io.StringIO()
    console = Console(file=text, force_terminal=True, width=100)
    with (
        bars_by(lambda title, unit: progress_bar(title, unit, console)),
        progress_bar("Reading", "files", console) as update,
    ):
        update(0, 1)
        mesh(file)
        update(1, 1)
    drawn = text.getvalue()
    assert "Decomposing angle.stl" in drawn
    assert drawn.rindex("Reading") > drawn.rindex("Decomposing angle.stl")


def test_without_a_command_nothing_is_drawn():
    with bar("Decomposing", "pieces") as update:
        assert update is None


@pytest.mark.usefixtures("own_cache")
def test_a_command_draws_a_bar_for_a_mesh_that_is_decomposed_and_for_no_other(
    tmp_path, monkeypatch
):
    text, file = io.StringIO(), angle(tmp_path)
    console = Console(file=text, force_terminal=True, width=100)
    drawn_there = functools.partial(progress_bar, console=console)
    monkeypatch.setattr(application.terminal, "progress_bar", drawn_there)

    @application.app.command(name="angle", show=False)
    def command() -> None:
        em.mesh(file)

    try:
        for drawn in (True, False):
            text.truncate(0)
            assert application.run(["angle"]) == 0
            assert ("Decomposing angle.stl" in text.getvalue()) == drawn
    finally:
        del application.app["angle"]
