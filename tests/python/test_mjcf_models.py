"""Models of packages as scenes: those that are installed here."""

from importlib.util import find_spec

import pytest

from energymargin_paper.evidence.mjcf_models import MODELS, STUDY, MjcfModels, Model, Settings, load

FEW = Settings(positions=5)


def of(name):
    return load(next(model for model in MODELS if model.name == name), FEW)


@pytest.mark.parametrize(("name", "joints"), [("Fetch gripper", 2), ("Franka hand", 2)])
def test_a_gripper_of_gymnasium_robotics_is_where_mujoco_has_it(name, joints):
    row = of(name)
    assert (row.loaded, row.joints, row.mass) == (True, joints, 0.0)
    assert row.pose < 1e-9


def test_a_hand_whose_tendons_are_missing_is_not_loaded_and_its_links_are_right():
    row = of("Shadow hand")
    assert not row.loaded
    assert "tendon" in row.without
    assert (row.joints, row.mass) == (24, 0.0)
    assert row.pose < 1e-9


def test_a_package_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr("energymargin_paper.evidence.mjcf_models.find_spec", lambda name: None)
    assert of("Jaco hand").without == "not installed"


def test_what_mujoco_says_of_a_file_is_the_reason(tmp_path, monkeypatch):
    spec = find_spec("json")
    monkeypatch.setattr(spec, "submodule_search_locations", [str(tmp_path / "json")])
    monkeypatch.setattr("energymargin_paper.evidence.mjcf_models.find_spec", lambda name: spec)
    (tmp_path / "broken.xml").write_text("<mujoco><nothing/></mujoco>")
    model = Model("robosuite/../broken.xml", "broken")
    (tmp_path / "robosuite").mkdir()
    assert load(model, FEW).without.startswith("MuJoCo: XML Error")


def test_the_tables_count_hands_and_arms_apart():
    rows = [load(m, FEW) for m in MODELS if m.name in ("Fetch gripper", "FetchPush")]
    text = MjcfModels(rows, "4").to_markdown()
    assert "## Grippers and hands: 1 of 1 loaded" in text
    assert "## Arms and scenes: 0 of 1 loaded" in text
    assert "equality/weld" in text
    assert STUDY.name == "mjcf-models"
