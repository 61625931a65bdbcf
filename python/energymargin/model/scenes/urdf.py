"""Robots and objects from URDF files: links become bodies, joints those of a scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from energymargin._core import Cancel, Compound, Scene, mass_properties
from energymargin.base.bars import Update
from energymargin.base.checks import one_of, positive_number
from energymargin.base.limits import Limit
from energymargin.base.plausibility import warn
from energymargin.model.meshes.files import shape_of, warn_of_open
from energymargin.model.meshes.settings import MAX_POINTS, THRESHOLD, FlatMeshError, PartSettings
from energymargin.model.pads import Pad, add_pads
from energymargin.model.scenes import additions, reports
from energymargin.model.scenes.additions import BASES, Additions, FileMistakes, counted
from energymargin.model.scenes.files import found
from energymargin.model.scenes.poses import Pose, moved, place, pose, together
from energymargin.model.scenes.reports import ReportRow
from energymargin.model.scenes.urdf_elements import MIMIC
from energymargin.model.scenes.urdf_inertias import moving_inertials, warn_of_links
from energymargin.model.scenes.urdf_model import Robot, read
from energymargin.model.scenes.urdf_parts import Link, MeshFile, joint_keywords, surface_of

MeshOf = Callable[[MeshFile], Compound]


def from_urdf(
    path: str | Path,
    scene: Scene | None = None,
    *,
    prefix: str = "",
    position: Sequence[float] = (0.0, 0.0, 0.0),
    orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    base: str = "fixed",
    role: str = "none",
    roles: Mapping[str, str] | None = None,
    friction: float = 0.5,
    frictions: Mapping[str, float] | None = None,
    joints: Mapping[str, Mapping[str, Any]] | None = None,
    inertia: str = "file",
    density: float | None = None,
    mimic_limits: str = "file",
    decompose: bool = True,
    threshold: float = THRESHOLD,
    accuracy: float | None = None,
    max_points: int = MAX_POINTS,
    pads: Mapping[str, Pad] | None = None,
    self_collision: bool = True,
    disable_collisions: str | Iterable[Sequence[str]] = (),
    packages: Sequence[str | Path] = (),
    ignore: Iterable[str] = (),
    subtree: str | None = None,
    progress: Update | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Scene:
    """A robot, or an object, from a URDF file: a new scene with it, or the given one with it added.

    The body of a link has the link's frame, and its name behind `prefix`; so have joints. Arguments
    name links and joints as the file does.

    A joint starts at 0, or at the nearer limit. A mimic joint of a mimic joint follows what that
    one follows; its damping acts there, and its limits have to hold for all positions of the joint
    that it follows. A link without mass, or of at most a milligram without inertia, is a frame: its
    shapes become part of the link that it is fixed to, and it is no body. If a joint moves it, it
    gets a mass: a billionth of what hangs on it, or a thousandth of the robot if nothing does.

    Links that a joint connects, or that fixed joints hold together, never collide; nor do those
    that overlap at the start and wherever their joints are. Others that overlap at the start touch.

    Visual elements and velocity limits are not part of a scene. What moves nothing in any program,
    as <transmission>, and elements in a namespace that the file does not declare, are left out with
    a warning. Anything else that is not simulated is an error unless `ignore` names it.
    `scene.report` lists what is left out, loose or stated. An error names all that is wrong, before
    meshes are read.

    Args:
        path: the URDF file.
        scene: the scene to add to. None makes a new one.
        prefix: of the names of bodies and joints.
        position: of the root link's frame, shape (3,) [m].
        orientation: of the root link's frame, a unit quaternion (x, y, z, w).
        base: "fixed", whatever the root's mass, "free" to move, or "kinematic", as a plan says.
        role: of all links: "none", "effector" or "object".
        roles: of single links, by name.
        friction: of links for which neither `frictions` nor the file (Bullet's <lateral_friction>)
            has a coefficient.
        frictions: of single links, by name.
        joints: by joint, keywords of `Scene.add_joint` such as start, held, target and stiffness.
            They replace what the file has: limits, effort as torque_limit, damping. An effort of 0
            is that of a joint without a motor; one that is driven needs a torque_limit.
        inertia: "file", with Bullet's <inertia_scaling>, or "shapes" to distribute the file's
            masses evenly over the collision shapes.
        density: of links that have collision shapes and no mass in the file [kg/m^3]: they are
            bodies then, of the mass and inertia of their shapes. None: such a link is a frame.
        mimic_limits: "file", or "leader" to leave out the limits of mimic joints, where those of
            the joint that they follow contradict them.
        decompose: whether meshes become convex parts, as in `em.mesh`.
        threshold, accuracy, max_points: of the parts, as in `em.mesh`.
        pads: soft pads of single links, by name.
        self_collision: whether links can collide with each other.
        disable_collisions: pairs of links that never collide, or "overlapping": those that overlap
            at the start.
        packages: folders in which package:// and relative paths are looked up, before
            ROS_PACKAGE_PATH and the folders above the file.
        ignore: what to leave out: elements by tag, attributes as "tag.attribute". What is simulated
            in one parent and not in another is named with it, as "link/origin". A warning names the
            joints that nothing drives without their "joint/mimic".
        subtree: a link by name: that one and what hangs on it become bodies, and the others, with
            their joints and meshes, are not read. It is the root then: `base`, `position` and
            `orientation` are its own.
        progress: progress(done, total) counts links, whose meshes are decomposed.
        timeout: [s].
        cancel: ends it once it is set.

    Returns:
        `scene`, or the new scene.

    Raises:
        FileNotFoundError: if the file or meshes are missing.
        NotSimulatedError: a ValueError that names what is not simulated.
        ValueError: that names what is wrong in the file or an argument.
        TimeoutError: after `timeout`. Cancelled: once `cancel` is set.
        ImportError, RuntimeError: of meshes, as `em.mesh`.

    On an error a given scene is as it was.
    """
    limit = Limit(timeout, cancel)
    one_of("base", base, BASES)
    one_of("inertia", inertia, ("file", "shapes"))
    one_of("mimic_limits", mimic_limits, ("file", "leader"))
    of_shapes = 0.0 if density is None else positive_number("density", density)
    how = PartSettings(decompose, threshold, accuracy, max_points)
    ignored = additions.several("ignore", ignore)
    folders = additions.several("packages", packages)
    root = pose(position, orientation)
    mistakes = FileMistakes(str(path), limit)
    robot = read(Path(path), ignored, mistakes, subtree)
    robot.merge_frames(mistakes, free=base != "fixed", dense=of_shapes > 0.0)
    roles, frictions, control = roles or {}, frictions or {}, joints or {}
    overlapping, pairs = additions.pairs_of(disable_collisions, "links")
    paired = [name for pair in pairs for name in pair]
    _check_links(robot, mistakes, roles=roles, frictions=frictions, disable_collisions=paired)
    leader = mimic_limits == "leader"
    jointed = joint_keywords(robot.joints, control, prefix, mistakes, leader=leader)
    moving_inertials(robot, mistakes, inertia)
    with mistakes.listed():
        additions.check_names(scene, [{"name": prefix + name} for name in robot.links], jointed)
    files: dict[str, Path] = {}
    for name in robot.meshes():
        with mistakes.listed():
            files[name] = found(name, Path(path), folders)
    mistakes.check()

    def mesh_of(file: MeshFile) -> Compound:
        return shape_of(files[file.filename], how, limit, file.scale)

    loose = [name for name in robot.loose if name not in additions.driven_by(control)]
    additions.warn_of_loose(str(path), MIMIC, loose, str(path))
    report = (lambda done, total: None) if progress is None else progress
    bodies = _bodies(robot, mesh_of, limit, report, of_shapes)
    for name, inertial in moving_inertials(robot, mistakes, inertia).items():
        bodies[name]["inertial"] = inertial
    _warn_of_open(str(path), bodies, robot.opened)
    warn_of_links(Path(path), robot, bodies)
    kinematic = {"kinematic": True} if base == "kinematic" else {}
    bodies[robot.root] |= kinematic | _place_as_given(root @ robot.base, orientation)
    for name, link in robot.links.items():
        default = link.contact.get("lateral_friction", friction)
        bodies[name] |= {"role": roles.get(name, role), "friction": frictions.get(name, default)}
        bodies[name] |= {"name": prefix + name, **surface_of(link)}
    add_pads(bodies.values(), pads, prefix)
    if not self_collision:
        together = {frozenset((joint.parent, joint.child)) for joint in robot.joints.values()}
        pairs += [p for p in combinations(robot.links, 2) if frozenset(p) not in together]
    disabled = [(prefix + a, prefix + b) for a, b in pairs]
    hulls = [prefix + name for name in robot.hulls]
    collide: dict[str, Any] = {"self_collision": self_collision, "overlapping": overlapping}
    rows = _rows(robot, prefix)
    new = Additions([*bodies.values()], jointed, disabled, rows=rows, hulls=hulls, **collide)
    made = additions.added(scene, new, prefix, limit)
    _warn_of_left_out(str(path), robot, ignored)
    return made


def _place_as_given(at: Pose, orientation: Sequence[float]) -> dict[str, Any]:
    """Of the two quaternions of a half turn the nearer one: (1, 0, 0, 0) may be a mistake, and
    warns; (-1, 0, 0, 0) says that it is meant."""
    placed = place(at)
    turn = placed["orientation"]
    return placed | ({"orientation": -turn} if turn[3] == 0 and turn @ orientation < 0 else {})


def _rows(robot: Robot, prefix: str) -> list[ReportRow]:
    """Of the report: what is left out, what is a frame, what is stated, and whose effort counts."""
    rows = [ReportRow(reports.LEFT_OUT, name, str(count)) for name, count in robot.left_out.items()]
    for name, (of, at) in robot.merged.items():
        there = (*at[:3, 3].tolist(), *place(at)["orientation"].tolist())
        where = f"{prefix}{of} at {_rounded(at)} m"
        rows.append(reports.FrameRow.of(prefix + name, where, (prefix + of, there)))
    for name, value in robot.stated.items():
        rows.append(ReportRow(reports.STATED, prefix + name, value))
    for joint in robot.joints.values():
        if joint.mimic and 0.0 < joint.effort < math.inf:
            value = f"{joint.effort:g}: that of {prefix + joint.mimic.joint} counts"
            rows.append(ReportRow(reports.EFFORT, prefix + joint.name, value))
    return rows


def _rounded(at: Pose) -> str:
    return f"({', '.join(f'{x:.4g}' for x in at[:3, 3] + 0.0)})"


def _warn_of_left_out(path: str, robot: Robot, ignored: Collection[str]) -> None:
    """One line of what is left out without having been named in `ignore`, and one of masses."""
    told = {name: count for name, count in robot.left_out.items() if name not in ignored}
    left = f"{path}: left out, as it moves nothing, is there twice, is flat (thicker, it collides) "
    left += f"or has a namespace that the file does not declare: {counted(told)}; "
    left += f"ignore={tuple(told)!r} says that this is meant."
    warn([(left, left)] if told else [], left)
    stated = ", ".join(f"{name!r} {value}" for name, value in robot.stated.items())
    text = f"{path}: links that move lack a mass or an inertia in the file, and get: {stated}."
    warn([(text, text)] if stated else [], text)


def _check_links(robot: Robot, mistakes: FileMistakes, **named: Iterable[str]) -> None:
    """Arguments may name the links that are bodies."""
    for argument, names in named.items():
        for name in names:
            if name in robot.merged:
                mistakes.add(
                    f"{argument} has {name!r}, a frame without mass that is part of "
                    f"{robot.merged[name][0]!r}; name that"
                )
            elif name not in robot.links:
                known = ", ".join(robot.links)
                mistakes.add(f"{argument} has {name!r}, expected one of {known}")


def _bodies(
    robot: Robot, mesh_of: MeshOf, limit: Limit, report: Update, density: float
) -> dict[str, dict[str, Any]]:
    """By link, the keywords of `Scene.add_body` for its shape and mass; all masses are known."""
    shapes: dict[str, Any] = {}
    for name, link in robot.links.items():
        limit.require(f"link {name!r} was made a body")
        report(len(shapes), len(robot.links))
        shapes[name] = _shape(link, mesh_of, robot)
    report(len(shapes), len(shapes))
    dense = [name for name, link in robot.links.items() if link.dense]
    robot.weigh({name: density * mass_properties(shapes[name]).volume for name in dense})
    fixed = () if robot.free else (robot.root,)
    masses = {name: 0.0 if name in fixed else link.mass for name, link in robot.links.items()}
    return {name: {"shape": shapes[name], "mass": masses[name]} for name in shapes}


def _shape(link: Link, mesh_of: MeshOf, robot: Robot) -> Any:
    """One solid in the link's frame as itself, all else as a compound, without what is flat.

    The robot knows then which flat meshes are left out, and which links have open ones, or hulls.
    """
    if len(link.geometries) == 1 and not isinstance(link.geometries[0].shape, MeshFile):
        shape, pose = link.geometries[0]
        if np.array_equal(pose, np.eye(4)):
            return shape
    placed: list[Compound] = []
    for shape, pose in link.geometries:
        if not isinstance(shape, MeshFile):
            placed.append(moved(Compound([shape]), pose))
            continue
        try:
            own = mesh_of(shape)
        except FlatMeshError:
            robot.left_out[f"flat mesh {shape.filename} of {link.name!r}"] += 1
            continue
        if own.solid is None:
            robot.opened.add(link.name)
        from energymargin.model.meshes.convex import CONVEX

        hull = mass_properties(own.parts[0].shape).volume
        if len(own.parts) == 1 and (own.solid is None or own.solid.volume < CONVEX * hull):
            robot.hulls.add(link.name)
        placed.append(moved(own, pose))
    return placed[0] if len(placed) == 1 else together(placed)


def _warn_of_open(path: str, bodies: Mapping[str, Mapping[str, Any]], opened: set[str]) -> None:
    """Warns of links whose mass properties are those of meshes, some of them `opened`."""
    bare = (name for name, body in bodies.items() if body["mass"] and "inertial" not in body)
    if names := [repr(name) for name in bare if name in opened]:
        warn_of_open(["links", *names], f"{path} {names}")
