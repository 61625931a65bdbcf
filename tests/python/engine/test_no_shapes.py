"""Files of robots that collide with nothing are read, and say so."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import energymargin as em

INERTIAL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
)
BOX = '<geometry><box size=".1 .1 .1"/></geometry>'


def urdf(folder: Path, kind: str) -> Path:
    path = folder / f"{kind}.urdf"
    link = f'<link name="palm">{INERTIAL}<{kind}>{BOX}</{kind}></link>'
    path.write_text(f'<robot name="r">{link}</robot>')
    return path


def mjcf(contype: int) -> str:
    geom = f'<geom type="box" size=".1 .1 .1" contype="{contype}" conaffinity="{contype}"/>'
    return f'<mujoco><worldbody><body name="a"><freejoint/>{geom}</body></worldbody></mujoco>'


def test_a_urdf_file_with_visuals_alone_warns(tmp_path: Path) -> None:
    with pytest.warns(em.PlausibilityWarning, match="none of the file's 1 bodies collides.*'palm'"):
        em.scenes.from_urdf(urdf(tmp_path, "visual"), base="free")


def test_a_model_of_mujoco_whose_geoms_collide_with_nothing_warns() -> None:
    with pytest.warns(em.PlausibilityWarning, match="none of the file's 1 bodies collides.*'a'"):
        em.scenes.from_mjcf(mjcf(0))


def test_what_collides_does_not_warn(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        em.scenes.from_urdf(urdf(tmp_path, "collision"), base="free")
        em.scenes.from_mjcf(mjcf(1))
