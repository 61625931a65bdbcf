"""Robots, objects and whole scenes from MuJoCo's models."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Cancel, Scene
from energymargin.base.checks import each_name, one_of
from energymargin.base.limits import Limit
from energymargin.model.pads import Pad, add_pads
from energymargin.model.scenes import additions, mjcf_model
from energymargin.model.scenes.additions import BASES, Control, FileMistakes
from energymargin.model.scenes.mjcf_bodies import Builder
from energymargin.model.scenes.mjcf_contacts import Contacts
from energymargin.model.scenes.mjcf_drives import drives
from energymargin.model.scenes.mjcf_equalities import couplings, ties
from energymargin.model.scenes.mjcf_laws import joint_drives, tendon_drives
from energymargin.model.scenes.mjcf_model import Features, Selection, name_of
from energymargin.model.scenes.poses import Pose, place, pose

FRICTION_RULE = "max"  # MuJoCo's
Names = str | Iterable[str]


def from_mjcf(
    model: Any,
    scene: Scene | None = None,
    *,
    object: Names = (),
    effector: Names = (),
    subtree: str | None = None,
    base: str = "fixed",
    prefix: str = "",
    position: Sequence[float] | None = None,
    orientation: Sequence[float] | None = None,
    data: Any = None,
    keyframe: str | int | None = None,
    joints: Control | None = None,
    pads: Mapping[str, Pad] | None = None,
    disable_collisions: str | Iterable[Sequence[str]] = (),
    self_collision: bool = True,
    mimic_limits: str = "file",
    ignore: Collection[str] = (),
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Scene:
    """A MuJoCo model, or a body of it and all that hangs on it: a new scene, or added to one.

    MuJoCo compiles the model; its numbers are the scene's. A body and a joint have MuJoCo's names,
    behind `prefix`, and a body has MuJoCo's frame. The world's geoms have their own names.

    Meshes are the convex hulls that MuJoCo collides, ellipsoids hulls of 200 points, planes have no
    end. Friction follows MuJoCo's rule, the larger of two coefficients, or a priority's or a
    pair's. Contacts are hard, whatever solref and solimp say.

    A body with several joints hangs on links between them that have a billionth of its mass. Geoms
    of one body that collide with different others, or are differently rough, become bodies fixed
    to it, as light. A body without mass that is fixed to another one is part of that.

    Position and velocity actuators are the joints' compliance, at the control of `data` or of the
    keyframe. Their force limit is that of the joint, its passive damping included. What acts on a
    joint that follows another one by an equality constraint acts on the one that leads. A joint
    starts where MuJoCo has it, or at the nearer limit.

    Args:
        model: a path, XML text, or a `mujoco.MjModel`.
        scene: the scene to add to, with `friction_rule="max"`; its gravity holds. None makes a new
            one with the model's gravity.
        object: bodies on which disturbances act, by name.
        effector: bodies of the robot, with all that hangs on them. A mocap body is kinematic.
        subtree: the body that becomes the base, with all that hangs on it; None is all.
        base: of a subtree, "fixed", "free" to move, or "kinematic", as a plan says.
        prefix: of all names.
        position: of the subtree's base, shape (3,) [m]; None is where MuJoCo has it.
        orientation: of the subtree's base, a unit quaternion x, y, z, w; None as above.
        data: a `mujoco.MjData` that says where all starts, and its control.
        keyframe: of the model, instead of `data`, by name or number.
        joints: by joint, keywords of `Scene.add_joint` such as start, held, target and stiffness,
            which replace the model's.
        pads: soft pads of single bodies, by name.
        disable_collisions: pairs of bodies that never collide, or "overlapping": bodies that joints
            move, and that overlap their own robot or a fixed body at the start.
        self_collision: whether bodies of the model can collide, objects too. Where they overlap at
            the start, as a finger what it grips, they touch; but a body that joints move and that
            overlaps its own robot or a fixed body wherever the joints are never collides with that.
        mimic_limits: "file", or "leader" to leave out the limits of joints that follow others,
            where they contradict those of the joint that leads.
        ignore: what to do without of what is not simulated, by the names in the error. A warning
            names the joints that nothing drives then, and the bodies that hang loose;
            `scene.report` lists all of it.
        timeout: [s].
        cancel: ends it once it is set.

    Returns:
        `scene`, or the new scene.

    Raises:
        FileNotFoundError: if there is no such file.
        NotSimulatedError: a ValueError that names what is not simulated.
        ValueError: that names what is wrong in the model or an argument.
        TimeoutError: after `timeout`. Cancelled: once `cancel` is set.
        ImportError: without MuJoCo.

    On an error a given scene is as it was.
    """
    limit = Limit(timeout, cancel)
    if scene is not None:
        one_of("scene.friction_rule", scene.friction_rule, (FRICTION_RULE,))
    one_of("base", base, BASES)
    one_of("mimic_limits", mimic_limits, ("file", "leader"))
    overlapping, pairs = additions.pairs_of(disable_collisions, "bodies")
    features = Features(additions.several("ignore", ignore))
    made = mjcf_model.compiled(model)
    limit.require("the model was compiled")
    start = mjcf_model.start_of(made, data, keyframe)
    _count_options(made, features)
    selection = Selection(made, subtree, base, start, features, effectors=each_name(effector))
    at = _base_pose(selection, position, orientation)
    mistakes = FileMistakes(str(model) if isinstance(model, Path) else "the model", limit)
    with mistakes.listed():
        roles = _roles(selection, {"object": object, "effector": effector})
    coupled = couplings(selection)
    every = {name_of(made, "joint", joint): joint for joint in selection.all_joints()}
    settable = {name: () if j in coupled else additions.CONTROL for name, j in every.items()}
    control = joints or {}
    with mistakes.listed():
        additions.check_control(control, settable)
    driven, tendons = drives(selection, coupled, control, leader=mimic_limits == "leader")
    tied = ties(selection)
    contacts = Contacts(selection)
    mistakes.features = features.found
    jointed = joint_drives(selection, coupled, driven, control, prefix=prefix, mistakes=mistakes)
    mistakes.check()
    controlled = [name_of(made, "joint", j) for j, drive in driven.items() if drive.controls]
    held = additions.driven_by(control).union(controlled)
    features.warn(mistakes.source, held, bytes(made.names).decode())
    limit.require("the model was read")
    own_gravity = np.zeros(3) if mjcf_model.disabled(made, "GRAVITY") else made.opt.gravity
    gravity = np.array(own_gravity if scene is None else scene.gravity)
    builder = Builder(selection, contacts, roles, at, gravity, prefix, limit)
    collide = {"self_collision": self_collision, "overlapping": overlapping}
    new = builder.additions(jointed, tied, **collide)
    add_pads(new.bodies, pads, prefix)
    new.tendons.extend(tendon_drives(made, tendons, prefix))
    new.disabled.extend((prefix + a, prefix + b) for a, b in pairs)
    new.rows.extend(features.rows(prefix))
    into = Scene(gravity, friction_rule=FRICTION_RULE) if scene is None else scene
    return additions.added(into, new, prefix, limit)


def _count_options(model: Any, features: Features) -> None:
    mujoco, option = mjcf_model.engine(), model.opt
    features.add("option/fluid", bool(option.density or option.viscosity or option.wind.any()))
    override = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    features.add("option/override", bool(option.enableflags & override))
    features.add("flex", int(model.nflex))
    features.add("plugin", int(model.nplugin))


def _base_pose(
    selection: Selection, position: Sequence[float] | None, orientation: Sequence[float] | None
) -> Pose:
    """Pose of the world, or of the subtree's base where the caller or the model has it."""
    if selection.root is None:
        if position is not None or orientation is not None:
            wrong = f"position is {position!r} and orientation {orientation!r}"
            raise ValueError(f"{wrong}, expected neither without a subtree")
        return np.eye(4)
    there = place(selection.start.poses[selection.root])
    given = {"position": position, "orientation": orientation}
    return pose(**{k: there[k].tolist() if v is None else v for k, v in given.items()})


def _roles(selection: Selection, given: Mapping[str, Names]) -> dict[int, str]:
    """By body. Raises ValueError on names that are not selected, and on an object that is fixed."""
    found: dict[str, list[int]] = {}
    for role, names in given.items():
        found[role] = []
        for name in each_name(names):
            body = mjcf_model.body_id(selection.model, role, name)
            if selection.carrier.get(body) != body:
                raise ValueError(f"{role} is {name!r}, which is no body of the scene")
            if role == "object" and body in selection.static:
                raise ValueError(f"object is {name!r}, which is fixed, expected one that moves")
            found[role].append(body)
    roles = dict.fromkeys(mjcf_model.below(selection.model, found["effector"]), "effector")
    return roles | dict.fromkeys(found["object"], "object")
