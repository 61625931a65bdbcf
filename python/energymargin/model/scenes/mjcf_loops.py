"""Loops of a MuJoCo model: connections and welds, and ball joints, which are points that meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.model.scenes.mjcf_model import (
    Features,
    Selection,
    disabled,
    local_pose,
    name_of,
    tie_ends,
    word,
)
from energymargin.model.scenes.poses import Pose


@dataclass(frozen=True, eq=False)
class Tie:
    """A frame of one body and a frame of another that stay together."""

    kind: str
    """Of `Scene.add_loop`."""
    ends: list[tuple[int, Pose]]
    """Each body, and the frame in it."""


def ties(selection: Selection, features: Features) -> list[Tie]:
    """Those of bodies that move; counts what holds bodies of the selection to others."""
    model, found = selection.model, []
    for body, joint in selection.balls.items():
        anchor = np.asarray(model.jnt_pos[joint])
        parent = int(model.body_parentid[body])
        frames = _at(selection.at(body)[:3, :3] @ anchor + selection.at(body)[:3, 3]), _at(anchor)
        found.append(Tie("point", list(zip((parent, body), frames, strict=True))))
        features.add("joint/ball", bool(model.jnt_limited[joint]))
    if disabled(model, "EQUALITY"):
        return found
    for i in np.flatnonzero(model.eq_active0).tolist():
        kind = word("mjtEq", model.eq_type[i])
        if kind not in ("connect", "weld"):
            continue
        bodies = tie_ends(model, i)
        outside = [body for body in bodies if body not in selection.lump]
        if (outside and selection.root in bodies) or (not outside and selection.rigid(*bodies)):
            continue  # where the base is, and how it moves, the caller says
        moving = [body for body in bodies if selection.yields(body)]
        feature = f"equality/{kind}"
        if moving and (outside or feature in features.ignored):
            features.add(feature, bodies=[name_of(model, "body", body) for body in moving])
        elif moving:
            frames = _frames(model, i, kind)
            turns = kind == "weld" and model.eq_data[i][10] > 0  # by its scale of torques
            found.append(Tie("weld" if turns else "point", list(zip(bodies, frames, strict=True))))
    return found


def _frames(model: Any, equality: int, kind: str) -> tuple[Pose, Pose]:
    """In the frames of its two bodies."""
    if word("mjtObj", model.eq_objtype[equality]) == "site":
        sites = (model.eq_obj1id[equality], model.eq_obj2id[equality])
        a, b = (local_pose(model.site_pos[site], model.site_quat[site]) for site in sites)
        return a, b
    data = np.asarray(model.eq_data[equality])
    if kind == "connect":
        return _at(data[:3]), _at(data[3:6])
    return local_pose(data[3:6], data[6:10]), _at(data[:3])


def _at(point: NDArray[np.float64]) -> Pose:
    return local_pose(point, (1.0, 0.0, 0.0, 0.0))
