"""The bodies and joints of a scene from those of a MuJoCo model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from energymargin._core import Box, Capsule, Compound, ConvexHull, Cylinder, Inertial, Part, Sphere
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.model.scenes import mjcf_model, reports
from energymargin.model.scenes.additions import GYRATION, NEGLIGIBLE, Additions
from energymargin.model.scenes.mjcf_contacts import Contacts, Group
from energymargin.model.scenes.mjcf_equalities import Tie
from energymargin.model.scenes.mjcf_model import MASSLESS, WORLD, Selection, local_pose, name_of
from energymargin.model.scenes.poses import Pose, place, pose
from energymargin.model.scenes.reports import ReportRow


@dataclass(eq=False, repr=False)
class Builder:
    """Keywords of `Scene.add_body` and `Scene.add_joint`."""

    selection: Selection
    contacts: Contacts
    roles: Mapping[int, str]
    """By body, where it is not "none"."""
    base: Pose
    """Name of the subtree's root, or of the world."""
    gravity: Floats
    prefix: str
    limit: Limit

    def __post_init__(self) -> None:
        """Nothing is made yet."""
        self._model = self.selection.model
        root = WORLD if self.selection.root is None else self.selection.root
        self._shift = self.base @ np.linalg.inv(self.selection.start.poses[root])
        self._groups: dict[int, list[Group]] = {body: [] for body in self.selection.bodies}
        for group in self.contacts.groups:
            self._groups[group.body].append(group)
        self._bodies: dict[str, dict[str, Any]] = {}
        self._planes: dict[str, dict[str, Any]] = {}
        self._joints: list[tuple[int | None, dict[str, Any]]] = []
        self._of_group: dict[Group, str] = {}
        self._rows: list[ReportRow] = []

    def additions(
        self, drives: Mapping[int, dict[str, Any]], ties: list[Tie], **collide: Any
    ) -> Additions:
        """All of it; `drives`: by joint, keywords of its drive, start and mimic; `collide`:
        `self_collision` and `overlapping` of the result."""
        for body in self.selection.bodies:
            self.limit.require(f"body {self._name(body)!r} was made")
            if body in self.selection.static:
                self._add_static(body)
            elif self.selection.carrier[body] == body:
                self._add_moving(body)
        order = [*drives, None]
        joints = sorted(self._joints, key=lambda each: order.index(each[0]))
        loops = [self._loop(tie) for tie in ties]
        bodies = sorted(self._bodies.values(), key=lambda keywords: bool(keywords["mass"] > 0))
        jointed = [{**of, **({} if joint is None else drives[joint])} for joint, of in joints]
        planes = list(self._planes.values())
        new = Additions(bodies, jointed, planes=planes, rows=self._rows, loops=loops, **collide)
        self._add_pairs(new)
        return new

    def _loop(self, tie: Tie) -> dict[str, Any]:
        """Keywords of `Scene.add_loop`."""
        keywords: dict[str, Any] = {"type": tie.kind}
        for end, (body, frame) in zip("ab", tie.ends, strict=True):
            if body in self.selection.static:
                name, at = self._static_parent(body, None), frame
            else:
                name = self._name(self.selection.carrier[body])
                at = self.selection.offset[body] @ frame
            placed = place(at)
            keywords |= {f"body_{end}": self.prefix + name, f"point_{end}": placed["position"]}
            if tie.kind == "weld":
                keywords[f"orientation_{end}"] = placed["orientation"]
        return keywords

    def _name(self, body: int) -> str:
        return name_of(self._model, "body", body)

    def _add_body(self, name: str, body: int, **keywords: Any) -> None:
        role = self.roles.get(body, "none")
        role = "none" if name != self._name(body) and role == "object" else role
        self._bodies[name] = {"name": self.prefix + name, "role": role, **keywords}

    def _add_joint(self, joint: int | None, name: str, parent: str, child: str, **of: Any) -> None:
        named = {"name": name, "parent": parent, "child": child}
        prefixed = {key: self.prefix + value for key, value in named.items()}
        self._joints.append((joint, {**prefixed, **of}))

    # Bodies that stay where they are

    def _add_static(self, body: int) -> None:
        for i, group in enumerate(self._groups[body]):
            name = self._static_name(body, group, first=i == 0)
            self._of_group[group] = name
            if self.contacts.is_plane(group.geoms[0]):
                at = self._shift @ self.selection.start.poses[body]
                of = {**group.keywords(), **plane(self._model, group.geoms[0], at)}
                self._planes[name] = {"name": self.prefix + name, **of}
            else:
                still = {"mass": 0.0, **group.keywords(), **self._place(body)}
                self._add_body(name, body, shape=self._shape(group), **still)
        if body == self.selection.root and self._name(body) not in self._bodies:
            self._static_parent(body, None)

    def _static_name(self, body: int, group: Group, *, first: bool) -> str:
        geom = name_of(self._model, "geom", group.geoms[0])
        if body != WORLD:
            return self._name(body) if first else f"{self._name(body)}/{geom}"
        taken = {self._name(other) for other in self.selection.bodies}
        taken |= set(self._bodies) | set(self._planes)
        alone = len(group.geoms) == 1 and geom not in taken
        return geom if alone else f"{self._name(body)}/{geom}"

    def _place(self, body: int) -> dict[str, Any]:
        return _placed(self._shift @ self.selection.start.poses[body])

    def _static_parent(self, body: int, child: Group | None) -> str:
        """A fixed body that joints hang on: those that a joint connects never collide."""
        name = self._name(body)
        if name in self._bodies and not self._meet(self._main(body), child):
            return name
        frame = f"{name}/frame" if name in self._bodies else name
        if frame not in self._bodies:
            self._add_body(frame, body, shape=Compound([]), mass=0.0, **self._place(body))
        return frame

    # Bodies that move

    def _add_moving(self, body: int) -> None:
        name = self._name(body)
        main = None if self._splits(body) else self._main(body)
        moved = body in self.selection.moved
        mass = {"kinematic": True, "mass": 1.0} if moved else self._mass(body)
        keywords = {"shape": Compound([]), **mass}
        if main is not None:
            keywords |= {"shape": self._shape(main), **main.keywords()}
            self._of_group[main] = name
        free = body in self.selection.free
        if free:
            twist, turn = self.selection.start.twists[body], self._shift[:3, :3]
            speed = {"velocity": turn @ twist[3:], "angular_velocity": turn @ twist[:3]}
            keywords |= self._place(body) | speed | self._damping(body)
        self._add_body(name, body, **keywords)
        if not free:
            self._hang(body, main)
        for group in self._groups[body]:
            if group not in self._of_group:
                self._add_part(body, group)

    def _damping(self, body: int) -> dict[str, float]:
        """Of a body on a free or a ball joint, as `mjcf_drives` counts what has none here."""
        first, count = self._model.body_dofadr[body], self._model.body_dofnum[body]
        if not count or body in self.selection.moved or not mjcf_model.damps(self._model, body):
            return {}
        value = float(self._model.dof_damping[first])
        return {"angular_damping": value} | ({"linear_damping": value} if count == 6 else {})

    def _main(self, body: int) -> Group | None:
        """The geoms that a body has as its own shape."""
        return next(iter(self._groups[body]), None)

    def _meet(self, a: Group | None, b: Group | None) -> bool:
        return a is not None and b is not None and self.contacts.coefficients(a, b) is not None

    def _parent(self, body: int) -> tuple[int, Pose]:
        """The body that carries one, and where in its frame the other's is before its joints."""
        parent = int(self._model.body_parentid[body])
        at = self.selection.offset[parent] @ self.selection.at(body)
        return self.selection.carrier[parent], at

    def _splits(self, body: int) -> bool:
        """Whether a body collides with the one that moves and carries it: its shapes are bodies
        of their own then, since those that a joint connects never collide."""
        if body in self.selection.free or self._parent(body)[0] in self.selection.static:
            return False
        parent, _ = self._parent(body)
        single = len(self.selection.joints[body]) == 1
        return single and self._meet(self._main(parent), self._main(body))

    def _hang(self, body: int, main: Group | None) -> None:
        """A body on its parent, by its joints, with links between them."""
        parent, at = self._parent(body)
        joints = self.selection.joints[body]
        static = parent in self.selection.static
        last = main if len(joints) == 1 else None
        above = self._static_parent(parent, last) if static else self._name(parent)
        if not joints:
            fixed = f"{self._name(body)}/fixed"
            self._add_joint(None, fixed, above, self._name(body), type="fixed", **_origin(at))
        for joint in joints:
            name = name_of(self._model, "joint", joint)
            link = self._name(body) if joint == joints[-1] else f"{self._name(body)}/{name}"
            if joint != joints[-1]:
                self._add_body(link, body, shape=Compound([]), **self._negligible(body))
            self._add_joint(joint, name, above, link, **self._frames(joint, at))
            above, at = link, np.eye(4)

    def _frames(self, joint: int, at: Pose) -> dict[str, Any]:
        """Type, axis and frames of a joint whose position is MuJoCo's, `at` the body's frame."""
        model = self._model
        axis = np.asarray(model.jnt_axis[joint]) / np.linalg.norm(model.jnt_axis[joint])
        anchor = np.asarray(model.jnt_pos[joint])
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        slides = mjcf_model.word("mjtJoint", model.jnt_type[joint]) == "slide"
        frame = np.eye(4)
        if slides:
            frame[:3, 3] = anchor - reference * axis
        else:
            half = -reference / 2
            frame = pose(anchor.tolist(), [*(np.sin(half) * axis), np.cos(half)])
        kind = "prismatic" if slides else "revolute"
        return {"type": kind, "axis": axis, "child_origin": anchor, **_origin(at @ frame)}

    def _add_part(self, body: int, group: Group) -> None:
        """Geoms that differ from a body's others, on a body that is fixed to it."""
        name = f"{self._name(body)}/{name_of(self._model, 'geom', group.geoms[0])}"
        self._of_group[group] = name
        light = self._negligible(body)
        self._add_body(name, body, shape=self._shape(group), **group.keywords(), **light)
        self._add_joint(None, f"{name}/fixed", self._name(body), name, type="fixed")

    def _shape(self, group: Group) -> Any:
        model, offsets = self._model, self.selection.offset
        return shape(model, [(g, offsets[int(model.geom_bodyid[g])]) for g in group.geoms])

    def _mass(self, body: int) -> dict[str, Any]:
        """Mass and inertia, and the force of gravity compensation."""
        model = self._model
        mass = float(model.body_mass[body])
        if mass <= MASSLESS:
            light = self._negligible(body)
            name, mass = self.prefix + self._name(body), light["mass"]
            self._rows.append(ReportRow(reports.STATED, name, f"{mass:.3g} kg"))
            return light
        least = NEGLIGIBLE * mass * GYRATION**2  # of a mass without extent
        moments = np.maximum(model.body_inertia[body], least)
        axes = np.roll(model.body_iquat[body], -1)
        inertial = Inertial(model.body_ipos[body], inertia=moments, axes=axes)
        compensation = float(model.body_gravcomp[body])
        force = {"force": -compensation * mass * self.gravity} if compensation else {}
        return {"mass": mass, "inertial": inertial, **force}

    def _negligible(self, body: int) -> dict[str, Any]:
        """Mass and inertia that change nothing, of what only connects."""
        mass = NEGLIGIBLE * max(float(self._model.body_subtreemass[body]), MASSLESS)
        moments = np.full(3, mass * GYRATION**2)
        return {"mass": mass, "inertial": Inertial(self._model.body_ipos[body], inertia=moments)}

    # Contacts

    def _add_pairs(self, new: Additions) -> None:
        """Bodies that never collide, and those whose friction is not the larger of the two."""
        jointed = {frozenset((j["parent"], j["child"])) for _, j in self._joints}
        for a, b in combinations(self.contacts.groups, 2):
            if self.selection.rigid(a.body, b.body):
                continue
            names = (self.prefix + self._of_group[a], self.prefix + self._of_group[b])
            friction = self.contacts.coefficients(a, b) if new.self_collision else None
            if frozenset(names) in jointed:
                continue
            if friction is None:
                new.disabled.append(names)
            elif friction != tuple(map(max, a.friction, b.friction)):
                new.frictions.append((*names, *friction))


def _placed(at: Pose) -> dict[str, Any]:
    """Position and orientation; of a half turn the sign says that it is meant."""
    frame = place(at)
    turn = frame["orientation"]
    return {"position": frame["position"], "orientation": -turn if turn[3] == 0 else turn}


def _origin(at: Pose) -> dict[str, Any]:
    frame = _placed(at)
    return {"origin": frame["position"], "orientation": frame["orientation"]}


ELLIPSOID_POINTS = 200
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
Solid = Box | Sphere | Cylinder | Capsule | ConvexHull


# By MuJoCo's geom, from its size (3,).
SOLIDS: Mapping[str, Callable[[Floats], Solid]] = {
    "box": lambda size: Box(2 * size),
    "sphere": lambda size: Sphere(size[0]),
    "capsule": lambda size: Capsule(size[0], 2 * size[1]),
    "cylinder": lambda size: Cylinder(size[0], 2 * size[1]),
    "ellipsoid": lambda size: ConvexHull(size * _even_directions(ELLIPSOID_POINTS)),
}


def shape(model: Any, geoms: list[tuple[int, Pose]]) -> Solid | Compound:
    """The solids of geoms, each with its body's pose in the frame of the shape."""
    placed = [
        (_solid(model, geom), at @ local_pose(model.geom_pos[geom], model.geom_quat[geom]))
        for geom, at in geoms
    ]
    if len(placed) == 1 and np.array_equal(placed[0][1], np.eye(4)):
        return placed[0][0]
    return Compound([Part(solid, **place(matrix)) for solid, matrix in placed])


def plane(model: Any, geom: int, body: Pose) -> dict[str, Any]:
    """Keywords of `Scene.add_plane`; it has no end, whatever size is drawn."""
    at = body @ local_pose(model.geom_pos[geom], model.geom_quat[geom])
    normal = at[:3, 2] / np.linalg.norm(at[:3, 2])
    return {"normal": normal, "offset": float(normal @ at[:3, 3])}


def _solid(model: Any, geom: int) -> Solid:
    kind = mjcf_model.word("mjtGeom", model.geom_type[geom])
    size = np.asarray(model.geom_size[geom], float)
    if kind in SOLIDS:
        return SOLIDS[kind](size)
    points = _hull(model, int(model.geom_dataid[geom]))
    try:
        return ConvexHull(points)
    except ValueError as error:
        raise ValueError(f"geom {name_of(model, 'geom', geom)!r}: {error}") from error


def _even_directions(count: int) -> Floats:
    """Unit vectors (count, 3) along a spiral from pole to pole."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turns, radius = GOLDEN_ANGLE * np.arange(count), np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turns), radius * np.sin(turns), z], axis=1)


def _hull(model: Any, mesh: int) -> Floats:
    """The corners (n, 3) of the convex hull that MuJoCo collides, in the geom's frame."""
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    points: Floats = np.asarray(model.mesh_vert[first : first + count], float)
    graph = model.mesh_graphadr[mesh]
    if graph < 0:
        return points
    corners = model.mesh_graph[graph]  # then the number of faces, and as many addresses as corners
    chosen = np.asarray(model.mesh_graph[graph + 2 + corners : graph + 2 + 2 * corners])
    return np.array(points[chosen])
