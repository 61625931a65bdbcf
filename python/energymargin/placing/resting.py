"""`em.resting_poses`: how a rigid body can lie on a plane.

With the direction u to the ground in the body's frame, its centre of mass is at the height h(u) =
max u . p over the points p of its hull, from that centre. Faces of the hull are the only minima of
h, and passes between them are on edges (a vertex is a peak). So the least work to topple from one
pose to another is exact: m g times the rise of the centre to the height of an edge.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import heapify, heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin import Inertial, mass_properties, scenes
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.base.reprs import Record
from energymargin.executors import Executor, ask
from energymargin.placing.settling import GRAVITY, Drops
from energymargin.summary import Summarized

WATER = 1000.0  # kg/m^3
FLAT = 1e-9  # 1 - cosine of the angle between faces that are one
EDGE = 1e-9  # of the body's reach; so far outside of a face its foot still counts as within
ALIKE = 1e-6  # of the reach; passes of such heights are taken alike often
ROLLED = np.radians(30.0)
FACETS = np.cos(np.radians(8.0))  # of a round side, which has 48 in a turn
BREATH = 0.1  # of the rise below which a body comes to rest nowhere; below this it does not stand


@dataclass(frozen=True, eq=False, repr=False)
class RestingPose(Record):
    """One way in which a body can lie."""

    pose: NDArray[np.float64]
    """Of the shape's frame, (4, 4): the plane is z = 0, the centre of mass above the origin."""
    probability: float
    """Share of the directions from which it comes to lie so, without haste (Goldberg 1999)."""
    height: float
    """Of the centre of mass [m]."""
    largest_tilt: float
    """Slope up to which it does not topple, however it is turned about the vertical [rad]."""
    work: dict[int, float]
    """Least work to topple it straight to another pose [J], by the number of that."""
    dropped: float = np.nan
    """Share of the simulated drops that ended so."""

    @property
    def orientation(self) -> NDArray[np.float64]:
        """Of the shape's frame, a unit quaternion x, y, z, w, (4,)."""
        return np.asarray(Rotation.from_matrix(self.pose[:3, :3]).as_quat())

    @property
    def least_work(self) -> float:
        """To any other pose [J]; inf if there is none."""
        return min(self.work.values(), default=np.inf)


@dataclass(frozen=True, eq=False, repr=False)
class RestingPoses(Summarized):
    """All ways in which a body can lie on a plane, the most probable first."""

    shape: Any
    poses: tuple[RestingPose, ...]
    mass: float
    """[kg]"""
    drops: int = 0
    """Simulated drops that count."""
    complete: bool = True
    """False if the timeout or the cancel came before the last drop."""

    def __len__(self) -> int:
        """How many."""
        return len(self.poses)

    def __iter__(self) -> Iterator[RestingPose]:
        """The most probable first."""
        return iter(self.poses)

    def __getitem__(self, number: int) -> RestingPose:
        """One of them."""
        return self.poses[number]

    @property
    def total_variation(self) -> float:
        """Half the sum of the differences between the probabilities and the shares of the simulated
        drops; NaN without drops."""
        return 0.5 * float(sum(abs(one.probability - one.dropped) for one in self.poses))


def resting_poses(
    shape: Any,
    *,
    friction: float = 0.5,
    on: Sequence[float] = (0.0, 0.0, 1.0),
    mass: float | None = None,
    inertial: Inertial | None = None,
    merge: float = 0.01,
    drops: int = 0,
    height: float = 0.0,
    seed: int = 0,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: em.Cancel | None = None,
) -> RestingPoses:
    """How can it lie on a plane, how likely is each way, and what does it take to topple it?

    Args:
        shape: of `em.mesh`, or a primitive; its convex hull counts. Round ones have 48 corners.
        friction: coefficient of the contact.
        on: normal of the plane (3,), up by default; another one is a slope.
        mass: [kg]; None: it is as heavy as water.
        inertial: centre of mass and inertia; None: those of the shape, of even density.
        merge: a pose has the probability 0 if the centre of mass rises on the way out of it by less
            than this share of the body's reach from there. It is none if it rolls so, or topples
            with a tenth of that: a breath does it. 0: all are poses.
        drops: so many are simulated too, from random orientations.
        height: from which it is dropped [m]; 0: its lowest point is on the plane.
        seed: of the drops.
        threads: None takes all cores. Nothing depends on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts drops.
        timeout: after so many seconds the drops count that are done.
        cancel: the same once it is set.

    A pose rests on a slope if it does in any direction; there are none if friction cannot hold.
    Raises ValueError on bad arguments, and a shape that is flat or has no end.
    """
    limit = Limit(timeout, cancel)
    mu = checks.not_negative_number("friction", friction)
    properties = mass_properties(shape)
    mass = WATER * properties.volume if mass is None else checks.positive_number("mass", mass)
    checks.share("merge", merge)
    count = checks.whole_number("drops", drops, 0)
    fall = checks.not_negative_number("height", height)
    checks.seed_number(seed)
    up = checks.numbers_of("on", on, "the normal of a plane, three numbers", (3,))
    up = up / (np.linalg.norm(up) or np.nan)
    checks.require(up[2] > 0, "on", on, "a normal that points up")
    slope = float(np.arctan2(np.hypot(up[0], up[1]), up[2]))
    center = np.array((inertial or properties).center)
    parts = [part.shape for part in shape.parts] if isinstance(shape, em.Compound) else [shape]
    is_round = any(isinstance(part, em.Sphere | em.Cylinder | em.Capsule) for part in parts)
    faces = Faces(np.concatenate(scenes.shape_parts(shape)) - center, is_round)
    basins = faces.basins(merge, slope) if mu >= np.tan(slope) else []
    dropping = Drops(shape, mass, mu, inertial, slope, fall, seed, faces.normals, faces.reach)
    ends: dict[int, int] = {}
    where: Any = {"threads": threads, "executor": executor, "progress": progress, "total": count}
    ask([range(count if basins else 0)], dropping.ends, ends.update, **where, **limit.rest())
    done = next(k for k in range(count + 1) if k not in ends)  # those before it, on any threads
    if basins and count and not done:
        limit.require("a drop has ended")
    tally = np.bincount([ends[k] for k in range(done)], minlength=len(faces.normals))
    poses = []
    for one, rises in zip(basins, faces.works(basins), strict=True):
        work = {other: mass * GRAVITY * rise for other, rise in rises.items()}
        dropped = float(tally[one.faces].sum() / done) if done else np.nan
        lies = (faces.pose(one.lowest, center), one.share, float(faces.heights[one.lowest]))
        poses.append(RestingPose(*lies, faces.way_out(one)[0], work, dropped))
    return RestingPoses(shape, tuple(poses), mass, done, done == count or not basins)


@dataclass(eq=False)
class Basin:
    """A pose, and the faces from which the body comes to it."""

    lowest: int
    share: float
    """Of the directions from which the body comes to it."""
    faces: list[int] = field(default_factory=list)


class Faces:
    """The faces of a hull about the centre of mass."""

    def __init__(self, points: Floats, is_round: bool) -> None:
        """`points` (N, 3) from the centre; `is_round`: faces that hardly lean stand for a round
        side. Raises ValueError if they are flat."""
        self._is_round = is_round
        size = float(np.linalg.norm(points, axis=1).max())
        points = np.unique(np.round(points / size, 9), axis=0) * size  # poles are one point each
        try:
            hull = ConvexHull(points)
        except Exception as error:  # scipy's own
            raise ValueError(f"shape has no hull, expected a solid: {error}") from error
        self.reach = float(np.linalg.norm(hull.points[hull.vertices], axis=1).max())
        normals = hull.equations[:, :3]
        flat = (normals[:, None] * normals[hull.neighbors]).sum(axis=2) > 1.0 - FLAT
        one, k = np.nonzero(flat)
        pairs = csr_array((np.ones(len(one)), (one, hull.neighbors[one, k])), (len(flat),) * 2)
        _, own = connected_components(pairs, directed=False)
        first = np.unique(own, return_index=True)[1]
        self.normals, self.heights = normals[first], -hull.equations[first, 3]
        if self.heights.min() <= 0.0:
            raise ValueError("inertial has its centre outside of the hull, expected one inside")
        self.shares = np.bincount(own, _solid_angles(points[hull.simplices])) / (4.0 * np.pi)
        self._edges(hull, own, points)

    def _edges(self, hull: Any, own: NDArray[np.int64], points: Floats) -> None:
        """Edges between faces, from one of the two: how far its foot is inside of them, and the
        height of the centre on the way over."""
        a, k = np.nonzero(own[hull.neighbors] != own[:, None])
        b = hull.neighbors[a, k]
        ends = np.array([hull.simplices[i][np.arange(3) != j] for i, j in zip(a, k, strict=True)])
        start = points[ends[:, 0]]
        along = points[ends[:, 1]] - start
        along /= np.linalg.norm(along, axis=1)[:, None]
        foot = _across(start, along)  # of the centre on the edge
        one, other = own[a], own[b]
        outwards = _across(self.normals[other], self.normals[one])
        outwards /= np.linalg.norm(outwards, axis=1)[:, None]
        self.one, self.other = one, other
        order = np.argsort(one, kind="stable")
        self._of_face = np.split(order, np.cumsum(np.bincount(one, minlength=own.max() + 1))[:-1])
        self.inside = _dots(foot, outwards)
        back = _across(self.normals[one], self.normals[other])
        peaks = (self.inside > 0) & (_dots(foot, back) > 0)
        ends_high = np.maximum(self.heights[one], self.heights[other])
        self.peaks = np.where(peaks, np.linalg.norm(foot, axis=1), ends_high)

    def basins(self, merge: float, slope: float) -> list[Basin]:
        """The poses, the most probable first."""
        rolls = _dots(self.normals[self.one], self.normals[self.other]) > np.cos(ROLLED)
        found = self._merged(merge * self.reach * np.where(rolls, 1.0, BREATH))
        ends = {b.lowest: b.share for b in self._merged(merge * self.reach * np.ones(len(rolls)))}
        for one in found:  # what hardly stays is where nothing comes to, but it can be put so
            one.share = ends.get(one.lowest, 0.0)
        return sorted(self._staying(found, slope), key=lambda one: -one.share)

    def _merged(self, least: Floats) -> list[Basin]:
        """Those are one between which the rise over an edge is below its least one [m]."""
        target = np.arange(len(self.normals))
        worst = np.full(len(target), np.inf)
        np.minimum.at(worst, self.one, self.inside)
        for e in np.flatnonzero(self.inside == worst[self.one]):
            if worst[self.one[e]] < -EDGE * self.reach:
                target[self.one[e]] = self.other[e]
        for _ in target:  # each way down ends at a pose
            if (target[target] == target).all():
                break
            target = target[target]
        parent, share = target.copy(), np.bincount(target, self.shares, len(target))
        lowest = {int(k): int(k) for k in set(target.tolist())}
        order = np.argsort(self.peaks, kind="stable")
        until = np.searchsorted(self.peaks[order], self.peaks[order] + ALIKE * self.reach)
        for place, e in enumerate(order):
            a, b = _root(parent, int(self.one[e])), _root(parent, int(self.other[e]))
            if a == b:
                continue
            low, high = sorted((a, b), key=lambda k: (self.heights[lowest[k]], k))
            if self.peaks[e] - self.heights[lowest[high]] < least[e]:
                sides = np.stack([self.one, self.other])[:, order[place : until[place]]].T
                alike = [{_root(parent, int(k)) for k in ends} for ends in sides]
                ways = set[int]().union(*(ends for ends in alike if high in ends)) - {high}
                share[list(ways)] += share[high] / len(ways)
                parent[high] = low
        found: dict[int, Basin] = {}
        for k in range(len(target)):
            basin = Basin(lowest[root := _root(parent, k)], float(share[root]))
            found.setdefault(root, basin).faces.append(k)
        return [*found.values()]

    def _staying(self, basins: list[Basin], slope: float) -> list[Basin]:
        """Those that stay on a slope. From the others the body goes on over the lowest edges, to
        all alike; what rolls is gone."""
        ways = np.zeros((len(basins), len(basins)))
        for k, (one, works) in enumerate(zip(basins, self.works(basins), strict=True)):
            tilt, end = self.way_out(one)
            if tilt >= slope:
                ways[k, k] = 1.0
            elif end not in one.faces:
                least = min(works.values()) + ALIKE * self.reach
                ends = [other for other, rise in works.items() if rise <= least]
                ways[k, ends] = 1.0 / len(ends)
        shares = [one.share for one in basins] @ np.linalg.matrix_power(ways, len(basins))
        for one, share in zip(basins, shares.tolist(), strict=True):
            one.share = share
        return [one for k, one in enumerate(basins) if ways[k, k] == 1.0]

    def works(self, basins: list[Basin]) -> list[dict[int, float]]:
        """By pose, the rise [m] on the way straight to each other one."""
        number = np.full(len(self.normals), -1)
        for k, one in enumerate(basins):
            number[one.faces] = k
        found: list[dict[int, float]] = [{} for _ in basins]
        for a, b, peak in zip(number[self.one], number[self.other], self.peaks, strict=True):
            if a >= 0 and b >= 0 and a != b:
                rise = float(peak - self.heights[basins[a].lowest])
                found[a][int(b)] = min(found[a].get(int(b), np.inf), rise)
        return [dict(sorted(one.items(), key=lambda item: item[1])) for one in found]

    def way_out(self, basin: Basin) -> tuple[float, int]:
        """The steepest slope that is needed on the way from face to face to another pose, or to a
        turn by ROLLED [rad], up to which it stays; and the face there."""
        tilts = np.arctan2(self.inside, self.heights[self.one])
        if self._is_round:
            tilts[_dots(self.normals[self.one], self.normals[self.other]) > FACETS] = 0.0
        own = np.zeros(len(self.normals), bool)
        own[basin.faces] = True
        own &= self.normals @ self.normals[basin.lowest] > np.cos(ROLLED)
        reached, steepest = {basin.lowest}, 0.0
        left = [(float(tilts[e]), int(e)) for e in self._of_face[basin.lowest]]
        heapify(left)
        while left:
            tilt, edge = heappop(left)
            face, steepest = int(self.other[edge]), max(steepest, tilt)
            if not own[face]:
                return steepest, face
            if face not in reached:
                reached.add(face)
                for e in self._of_face[face]:
                    heappush(left, (float(tilts[e]), int(e)))
        return np.pi / 2, basin.lowest

    def pose(self, face: int, center: Floats) -> Floats:
        """Of the shape's frame, (4, 4), when it lies on a face."""
        turn, _ = Rotation.align_vectors([[0, 0, -1.0]], self.normals[[face]])
        pose = np.eye(4)
        pose[:3, :3] = turn.as_matrix()
        pose[:3, 3] = [0, 0, self.heights[face]] - turn.apply(center)
        return pose


def _dots(one: Floats, other: Floats) -> Floats:
    return np.asarray((one * other).sum(axis=1))


def _across(vectors: Floats, units: Floats) -> Floats:
    """The parts of vectors that are across unit vectors, (N, 3)."""
    return vectors - _dots(vectors, units)[:, None] * units


def _root(parent: NDArray[Any], k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = int(parent[k])
    return k


def _solid_angles(corners: Floats) -> Floats:
    """Of triangles (N, 3, 3) from the origin (Van Oosterom and Strackee 1983)."""
    a, b, c = corners.transpose(1, 0, 2)
    na, nb, nc = (np.linalg.norm(one, axis=1) for one in (a, b, c))
    spat = np.abs(_dots(a, np.cross(b, c)))
    below = na * nb * nc + _dots(a, b) * nc + _dots(a, c) * nb + _dots(b, c) * na
    return np.asarray(2.0 * np.arctan2(spat, below))
