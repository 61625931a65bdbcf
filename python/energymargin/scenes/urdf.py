"""Robots and objects from URDF files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from energymargin._core import Cancel, Scene
from energymargin.limits import Limit
from energymargin.meshes import THRESHOLD
from energymargin.scenes.poses import place, pose
from energymargin.scenes.urdf_bodies import Shaping, body
from energymargin.scenes.urdf_collisions import apart, require_no_overlap
from energymargin.scenes.urdf_joints import joint_keywords
from energymargin.scenes.urdf_model import Robot
from energymargin.scenes.urdf_read import read

__all__ = ["from_urdf"]


@dataclass(frozen=True)
class _Plan:
    """What is to be added to a scene."""

    bodies: list[dict[str, Any]]
    joints: list[dict[str, Any]]
    apart: list[tuple[str, str]]

    def add_to(self, scene: Scene, limit: Limit) -> Scene:
        """The scene with all of it; with less where it raises TimeoutError or Cancelled."""
        for keywords in self.bodies:
            limit.require(f"body {keywords['name']!r} was added")
            scene.add_body(**keywords)
        for keywords in self.joints:
            limit.require(f"joint {keywords['name']!r} was added")
            scene.add_joint(**keywords)
        for body_a, body_b in self.apart:
            limit.require(f"collisions of {body_a!r} and {body_b!r} were disabled")
            scene.disable_collisions(body_a, body_b)
        return scene


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
    decompose: bool = True,
    threshold: float = THRESHOLD,
    self_collision: bool = True,
    disable_collisions: Iterable[Sequence[str]] = (),
    packages: Sequence[str | Path] = (),
    ignore: Iterable[str] = (),
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Scene:
    """A robot, or an object, from a URDF file: a new scene with it, or the given one with it added.

    The body of a link has the link's name, behind `prefix`, and the link's frame; so have joints.
    Arguments that speak of links and joints name them as the file does.

    position [m], orientation (unit quaternion x, y, z, w): of the root link's frame. base: "fixed",
    whatever the root's mass, or "free" to move. role: of all links; `roles` of single ones.
    friction: of links for which neither `frictions` nor the file (Bullet's <lateral_friction>) says
    one.

    joints: by joint, keywords of `Scene.add_joint` such as start, held, target and stiffness, which
    go before what the file says: limits, effort as torque_limit, damping. A joint starts at 0, or
    at the limit that is nearest. A mimic joint of a mimic joint follows what that one follows; its
    damping acts there, and its limits have to hold wherever the other joint may go.

    inertia: "file", or "shapes" to spread the file's masses evenly over the collision shapes.
    decompose, threshold, timeout, cancel: as in `em.mesh`. A link without mass is a frame: what it
    carries is part of the link it is fixed to, and it is no body; a root without mass is a body
    only if it is fixed.

    Links that a joint connects, or that fixed joints hold together, never collide. Others do if
    self_collision, but for the pairs `disable_collisions`; then none may overlap at the start.

    packages: folders in which to look for package:// and relative paths, before ROS_PACKAGE_PATH
    and the folders above the file. How links look, and how fast joints may be, is no part of a
    scene. What else the library does not do is an error, unless `ignore` names it: elements by tag,
    attributes as "tag.attribute", which are then left out everywhere. What is simulated in one
    parent and not in another is named with it, as "link/origin", and left out there alone. What is
    in a namespace that the file does not declare is left out with a warning.

    Raises FileNotFoundError, ValueError that names what is wrong, TimeoutError or Cancelled at the
    limit, and for its meshes as `em.mesh` does, which need the extra [urdf]; a given scene is then
    as it was.
    """
    limit = Limit(timeout, cancel)
    _check_choices(base, inertia, ignore=ignore, packages=packages)
    root = pose(position, orientation)
    robot = read(Path(path), tuple(ignore), limit, free=base == "free")
    roles, frictions, disabled = roles or {}, frictions or {}, _pairs(disable_collisions)
    apart_names = [name for pair in disabled for name in pair]
    _check_links(robot, roles=roles, frictions=frictions, disable_collisions=apart_names)
    shaping = Shaping(Path(path), inertia == "shapes", decompose, threshold, tuple(packages), limit)
    bodies = []
    for name, link in robot.links.items():
        limit.require(f"link {name!r} was made a body")
        fixed = base == "fixed" and name == robot.root
        said = frictions.get(name, friction if link.friction is None else link.friction)
        own = {"name": prefix + name, "role": roles.get(name, role), "friction": said}
        where = place(root @ robot.base) if name == robot.root else {}
        bodies.append({**own, **body(link, shaping, fixed=fixed), **where})
    plan = _Plan(
        bodies,
        joint_keywords(robot.joints, joints or {}, prefix),
        apart(robot, disabled, prefix, self_collision=self_collision),
    )
    if scene is not None:
        _check_names(scene, plan)
    made = plan.add_to(Scene() if scene is None else _empty(scene), limit)
    if self_collision:
        limit.require("links that overlap were looked for")
        require_no_overlap(made, prefix)
    limit.require("the scene was made")
    # Only now, so that an error leaves the given scene as it was.
    return made if scene is None else plan.add_to(scene, Limit())


def _check_choices(base: str, inertia: str, **several: Any) -> None:
    for name, value, known in (
        ("base", base, ("fixed", "free")),
        ("inertia", inertia, ("file", "shapes")),
    ):
        if value not in known:
            raise ValueError(f"{name} is {value!r}, expected {known[0]!r} or {known[1]!r}")
    for name, value in several.items():
        if isinstance(value, str):
            raise ValueError(f"{name} is {value!r}, expected a tuple: ({value!r},)")


def _pairs(disabled: Iterable[Iterable[str]]) -> list[tuple[str, str]]:
    pairs = [tuple(pair) for pair in disabled]
    for pair in pairs:
        if len(pair) != 2 or pair[0] == pair[1]:
            raise ValueError(f"disable_collisions has {pair!r}, expected pairs of two links")
    return [(pair[0], pair[1]) for pair in pairs]


def _check_links(robot: Robot, **named: Iterable[str]) -> None:
    """Arguments may name the links that are bodies."""
    for argument, names in named.items():
        for name in names:
            if name in robot.merged:
                raise ValueError(
                    f"{argument} has {name!r}, a frame without mass that is part of "
                    f"{robot.merged[name]!r}; name that"
                )
            if name not in robot.links:
                known = ", ".join(robot.links)
                raise ValueError(f"{argument} has {name!r}, expected one of {known}")


def _check_names(scene: Scene, plan: _Plan) -> None:
    """No two bodies of a scene, and no two joints, have the same name."""
    for what, there, new in (
        ("body", scene.bodies, plan.bodies),
        ("joint", scene.joints, plan.joints),
    ):
        taken = {item.name for item in there}
        for name in (keywords["name"] for keywords in new):
            if name in taken:
                raise ValueError(f"the scene has a {what} {name!r}; prefix=... gives other names")


def _empty(scene: Scene) -> Scene:
    """A scene without bodies, stepped as the given one."""
    return Scene(
        scene.gravity,
        scene.step,
        scene.solver_iterations,
        scene.solver_tolerance,
        scene.friction_directions,
        scene.margin,
    )
