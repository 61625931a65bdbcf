"""The study of public models: tries until they load, and where their links are."""

import os
import re
from pathlib import Path

import pytest
from urdf_files import ARM, chain, follower, joint

import energymargin as em
from energymargin_paper.evidence import models

FILES = {
    "arm.urdf": (1, ""),
    "rough_hand.urdf": (2, "adhesion, joints"),
    "gripper.urdf": (2, "mimic_limits"),
    "loop.urdf": (0, "joint 'second' is 'ball', expected one of revolute, continuous"),
    "slider.xml": (1, ""),
    "pinch_hand.xml": (1, ""),
    "two_drawers_hand.xml": (1, ""),
}
ROUGH = '<contact><adhesion value="0.1"/></contact></link>'
FOLLOWS = chain(joint("a", "a", "b"), joint("b", "b", "c", follower("a", 2.0, 0.0)), links="abc")
SLIDER = """<mujoco><worldbody><body name="a"><joint name="j" type="slide" range="0 1"/>
  <geom size="0.1"/></body></worldbody><actuator><motor joint="j"/></actuator></mujoco>"""

FINGER = """<body name="{name}" pos="{side}0.045 0 0.06">
  <joint name="{name}" type="slide" axis="{axis} 0 0" range="0 0.04" damping="5"/>
  <geom type="box" size="0.005 0.01 0.02" mass="0.05"/></body>"""
PINCH = f"""<mujoco><worldbody><body name="palm"><geom type="box" size="0.06 0.02 0.01"/>
  {FINGER.format(name="left", side="-", axis="1")}{FINGER.format(name="right", side="", axis="-1")}
  </body></worldbody><actuator>
  <position joint="left" kp="500" kv="10" ctrlrange="0 0.04" forcerange="-20 20"/>
  <position joint="right" kp="500" kv="10" ctrlrange="0 0.04" forcerange="-20 20"/>
</actuator></mujoco>"""
DRAWERS = PINCH.replace(
    "</worldbody>", FINGER.format(name="x", side="1", axis="1") + "</worldbody>"
)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robots")
    unlimited = ARM.replace('lower="-1" upper="2" ', "")
    (folder / "arm.urdf").write_text(ARM.replace("</robot>", "<transmission/></robot>"))
    (folder / "rough_hand.urdf").write_text(unlimited.replace("</link>", ROUGH, 1))
    (folder / "gripper.urdf").write_text(FOLLOWS)
    (folder / "loop.urdf").write_text(chain(joint("second", "a", "b", kind="ball"), links="ab"))
    (folder / "slider.xml").write_text(SLIDER)
    (folder / "pinch_hand.xml").write_text(PINCH)
    (folder / "two_drawers_hand.xml").write_text(DRAWERS)
    (folder / "part.xml").write_text("<mujoco><worldbody><body/></worldbody></mujoc>")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(models, "PACKAGES", ())
        patch.setenv(models.FOLDERS, str(folder))
        return models.STUDY.reproduce(models.Settings(), tmp_path_factory.mktemp("out"))


def test_tries_are_those_of_a_user_who_does_what_the_errors_say(found):
    assert {model.file for model in found.models} == set(FILES)
    for model in found.models:
        tries, asked = FILES[model.file]
        assert (model.tries, model.asked[: len(asked)]) == (tries, asked), model.file
        assert model.hand == bool(re.search("hand|gripper", model.file))
        assert not model.tries or model.distance < 1e-9 > model.angle


def test_the_table_counts_files_by_source_and_lists_those_that_never_load(found):
    text = found.to_markdown()
    assert re.search(r"\| robots0? \| 4 \| 2 \| 2 \| 0 \| 0 \|", text)
    assert "- adhesion: 1 files" in text and "loop.urdf: joint 'second' is 'ball'" in text
    assert found.to_csv().count("\n") == 1 + len(FILES)


def test_a_hand_on_its_own_closes_on_a_ball_and_holds_it_in_both_engines(found):
    (grip,) = found.grips
    assert grip.file.endswith("/pinch_hand.xml")
    assert abs(grip.fell) < 1e-4
    assert abs(grip.fell_firm) < 1e-3
    assert grip.fell_mujoco > 10 * abs(grip.fell_firm)  # its contacts creep
    assert grip.unconverged == 0
    assert "/pinch_hand.xml | 0.0" in found.to_markdown()


def test_a_link_elsewhere_would_be_seen(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    scene = em.scenes.from_urdf(tmp_path / "arm.urdf")
    (tmp_path / "arm.urdf").write_text(ARM.replace('xyz="0 0 0.05"', 'xyz="0 0 0.06"'))
    assert models._apart(scene, tmp_path / "arm.urdf")[0] == pytest.approx(0.01)


GIVEN = os.environ.get(models.FOLDERS)


@pytest.mark.skipif(not GIVEN, reason=f"{models.FOLDERS} names no folder")
def test_the_given_models_load_in_two_tries_with_their_links_where_mujoco_has_them(tmp_path):
    folders = [Path(folder) for folder in GIVEN.split(os.pathsep)]
    paths = [p for f in folders for pattern in ("*.urdf", "*hand.xml") for p in f.rglob(pattern)]
    for path in paths:
        text = re.sub(
            r'<mesh filename="assets/[^>]*/>', '<box size=".02 .02 .02"/>', path.read_text()
        )
        bare = path if text == path.read_text() else tmp_path / path.name
        if bare != path:  # a file that came without its meshes
            bare.write_text(text)
        count, asked, scene, _ = models.tries(bare)
        assert 1 <= count <= 2, (path, asked)
        assert max(models._apart(scene, bare)) < 1e-9
