"""Cavities in mesh files, and surfaces within one another."""

import numpy as np
import pytest
import trimesh
from mesh_files import objects, volume, written

import energymargin as em
from energymargin.model.meshes import convex, mesh

pytestmark = pytest.mark.usefixtures("mesh_cache")


def box(size, at=(0.0, 0.0, 0.0), *, inwards=False):
    made = trimesh.creation.box((size,) * 3)
    made.apply_translation(at)
    if inwards:
        made.invert()
    return made


def several(tmp_path, *surfaces):
    return written(tmp_path, trimesh.util.concatenate(surfaces))


@pytest.fixture
def quick(monkeypatch):
    """Other cuts than the best, in a part of the time."""
    monkeypatch.setitem(convex.SEARCH, "mcts_iterations", 10)


@pytest.mark.usefixtures("quick")
def test_a_closed_mesh_with_a_cavity_is_a_shell_with_its_mass_and_a_ball_stays_inside(tmp_path):
    shell = mesh(several(tmp_path, box(0.1), box(0.06, inwards=True)), threshold=0.5)
    assert shell.solid.volume == pytest.approx(0.1**3 - 0.06**3)
    moment = (0.1**5 - 0.06**5) / 6.0  # of one kg in a cubic metre
    assert shell.solid.moments == pytest.approx([moment / (0.1**3 - 0.06**3)] * 3, rel=1e-5)
    assert volume(shell) == pytest.approx(0.1**3 - 0.06**3, rel=0.1)
    scene = em.Scene()
    scene.add_body("shell", shell, mass=0)
    scene.add_body("ball", em.Sphere(0.01), mass=0.1, role="object")
    state = em.World(scene).rollout(scene.pack(), np.zeros(6), 0.5).state
    assert scene.unpack(state)["ball"]["position"][2] == pytest.approx(-0.02, abs=2e-3)
    turned = mesh(several(tmp_path, box(0.1, inwards=True), box(0.06)), decompose=False)
    assert turned.solid.volume == pytest.approx(shell.solid.volume)


@pytest.mark.usefixtures("quick")
def test_a_cavity_that_the_parts_fill_is_refused_with_the_way_out(tmp_path, monkeypatch):
    monkeypatch.setattr("energymargin.model.meshes.convex.LEAST_THRESHOLD", 0.5)
    monkeypatch.setattr("energymargin.model.meshes.convex.FILLED", -1.0)
    with pytest.raises(
        ValueError, match=r"solid\.stl has a cavity .* fill .*em\.Compound of boxes"
    ):
        mesh(several(tmp_path, box(0.1), box(0.06, inwards=True)), threshold=0.5)


def test_surfaces_that_contradict_each_other_are_refused(tmp_path):
    surfaces = box(0.1), box(0.06, (0.04, 0, 0), inwards=True)
    (tmp_path / "solid.obj").write_text(objects(*surfaces))
    with pytest.raises(ValueError, match="cross each other"):
        mesh(tmp_path / "solid.obj")
    with pytest.warns(em.PlausibilityWarning, match="contradict each other"):
        (hull,) = mesh(tmp_path / "solid.obj", decompose=False).parts
    assert len(hull.shape.points) == 12


@pytest.mark.parametrize("inwards", [False, True])
def test_two_bodies_in_one_file_are_two_parts_whichever_way_one_faces(tmp_path, inwards):
    both = mesh(several(tmp_path, box(0.1), box(0.1, (0.5, 0, 0), inwards=inwards)))
    assert len(both.parts) == 2
    assert both.solid.volume == pytest.approx(2e-3)
    assert both.solid.center == pytest.approx([0.25, 0, 0])


def test_a_cavity_in_a_mesh_with_holes_is_refused(tmp_path):
    outer = trimesh.creation.icosphere(2, radius=0.05)
    outer.update_faces(np.arange(len(outer.faces)) > 9)
    inner = trimesh.creation.icosphere(2, radius=0.04)
    inner.invert()
    with pytest.raises(ValueError, match="has a cavity and holes"):
        mesh(several(tmp_path, outer, inner))


# A face of many corners
