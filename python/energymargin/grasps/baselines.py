"""Baselines: what is commonly computed of a grasp in place of simulating what is done with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from energymargin import Scene, World, force_score
from energymargin.base.aliases import Floats
from energymargin.base.checks import check_type
from energymargin.base.plausibility import kept_warnings
from energymargin.grasps.belief import GraspDraw
from energymargin.grasps.hands import Fitted
from energymargin.grasps.outcomes import Closed, Grasp, clearance
from energymargin.grasps.scores import HELD, MISSING, GraspScores, grasp_of
from energymargin.grasps.trials import TOUCHING, GraspTrials
from energymargin.grasps.wrenches import wrench_space
from energymargin.scenes import pose, shape_parts

SAMPLES = 4000  # points of an object's surface
STEP = 1e-4  # m; the way off a face that tells whether another part lies there

OF_CONTACTS = ("epsilon", "volume", "force_score")
BASELINES = (*OF_CONTACTS, "center_distance", "between", "clearance", "undisturbed")
"""Names of the columns that `baselines` makes."""
LESS_IS_BETTER = ("center_distance",)
"""Those of which less is better; `compare` turns them around."""


def baselines(
    scores: GraspScores, *, progress: Callable[[int, int], None] | None = None
) -> dict[str, NDArray[np.float64]]:
    """What else may tell which grasps hold, without a label: columns of shape (n,) by name.

    - "epsilon", "volume": of the closed hand's contacts, after Ferrari and Canny; see
      `em.grasps.wrench_space`.
    - "force_score": of `em.force_score` once the hand has closed.
    - "center_distance": from the grasp frame's origin to the centre of mass [m]; less is better.
    - "between": the object's surface in the hull of the open fingers [m^2].
    - "clearance": from the open hand to the object and the table, negative if it is in them [m].
    - "undisturbed": 1 if it holds with what is believed most and without a disturbance, else 0.

    NaN where there is none: of the first three where the hand has no place or does not grip. With
    nothing unknown; a hand that starts in the object is lost or moved first, as in a trial, but for
    the distances.

    Args:
        scores: of `em.grasps.score`; one rollout is enough.
        progress: progress(done, total) counts grasps.
    """
    check_type("scores", scores, GraspScores, "an em.grasps.GraspScores, as of em.grasps.score")
    trials, n = scores.trials, len(scores.grasps)
    table = {name: np.full(n, np.nan) for name in BASELINES}
    surface, area = surface_of(trials.object.shape)
    for k in range(n):
        with kept_warnings():
            found = _features(trials, grasp_of(scores.grasps, k), surface, area)
        for name, value in found.items():
            table[name][k] = value
        if progress is not None:
            progress(k + 1, n)
    made = scores.likely != MISSING
    table["undisturbed"][made] = scores.likely[made] == HELD
    return table


def surface_of(shape: Any, samples: int = SAMPLES, seed: int = 0) -> tuple[Floats, float]:
    """Points spread evenly over the surface of a shape, (k, 3) [m], and the area that each stands
    for [m^2]. A face of a convex part that is in another part, or on its face, is no surface."""
    hulls = [ConvexHull(corners) for corners in shape_parts(shape)]
    faces = np.concatenate([hull.points[hull.simplices] for hull in hulls])
    of = np.repeat(np.arange(len(hulls)), [len(hull.simplices) for hull in hulls])
    edges = faces[:, 1:] - faces[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    random = np.random.default_rng(seed)
    chosen = random.choice(len(faces), samples, p=areas / areas.sum())
    along = np.sort(random.random((samples, 2)), axis=1)
    weights = np.stack([along[:, 0], along[:, 1] - along[:, 0], 1 - along[:, 1]], axis=1)
    points = np.einsum("ki,kij->kj", weights, faces[chosen])
    normals = np.concatenate([hull.equations[:, :3] for hull in hulls])[chosen]
    kept, owner = np.ones(samples, dtype=bool), of[chosen]
    for number, hull in enumerate(hulls):
        kept &= (owner == number) | ~_within(hull, points + STEP * normals)
        kept &= (owner <= number) | ~_within(hull, points - STEP * normals)
    return points[kept], float(areas.sum() / samples)


def _features(trials: GraspTrials, grasp: Grasp, surface: Floats, area: float) -> dict[str, float]:
    """All baselines of a grasp but the rollout."""
    draw = trials.draw(-1)
    center = np.linalg.inv(grasp.pose) @ [*trials.object.center, 1.0]
    found = {"center_distance": float(np.linalg.norm(center[:3]))}
    scene, hand = trials.scene(grasp.opening, draw, gravity=False)
    state = trials.open_state(grasp, draw)
    found["clearance"] = clearance(World(scene), hand, state)
    found["between"] = area * _between(scene, hand, state, surface)
    try:
        closed = trials.grip(grasp, draw)
        if not closed.ending:
            found |= _grip(trials, closed, draw)
    except (ValueError, RuntimeError):  # as in its trials, whose `errors` say why
        pass
    return found


def _grip(trials: GraspTrials, closed: Closed, draw: GraspDraw) -> dict[str, float]:
    """What the contacts of a closed hand tell."""
    problem = trials.problem(closed, draw)
    center = trials.object.center
    contacts = []
    for one in World(problem.scene).contacts(closed.state):
        pair = {one.body_a, one.body_b}
        if "object" in pair and pair & set(closed.hand.bodies) and one.distance <= TOUCHING:
            inward = one.normal * (1 if one.body_a == "object" else -1)
            contacts.append((one.position, inward, one.friction))
    points, normals, friction = zip(*contacts, strict=True) if contacts else ((), (), ())
    there = _moved(center, problem.scene.unpack(closed.state)["object"])
    radius = float(np.linalg.norm(trials.object.corners - center, axis=1).max())
    space = wrench_space(points, normals, friction, center=there, radius=radius)
    force = force_score(problem.replace(horizon=None, plan=None)).force
    return {"force_score": force, **space._asdict()}


def _between(scene: Scene, hand: Fitted, state: NDArray[np.float64], surface: Floats) -> int:
    """How many points of the object's surface are in the hull of the fingers."""
    bodies = scene.unpack(state)
    shapes = {body.name: body.shape for body in scene.bodies}
    parts = [(part, bodies[name]) for name in hand.fingers for part in shape_parts(shapes[name])]
    hull = ConvexHull(np.concatenate([_moved(*one) for one in parts]))
    return int(np.count_nonzero(_within(hull, _moved(surface, bodies["object"]))))


def _moved(points: Floats, body: dict[str, Any]) -> Floats:
    """Points of a body's frame in the world's."""
    at = pose(body["position"], body["orientation"])
    return np.asarray(points @ at[:3, :3].T + at[:3, 3])


def _within(hull: Any, points: Floats) -> NDArray[np.bool_]:
    """Which points are in a hull."""
    planes = hull.equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1))
