"""`em.placements`: where to set a thing down, and how likely it stays there.

`Jolts` disturb things that stand: knocks, and a support that is shaken or leans.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from energymargin import Cancel, Cancelled, Plan, Problem, Scene, rank
from energymargin.actions import Ranking, Standing
from energymargin.base import checks
from energymargin.base.aliases import Floats
from energymargin.base.limits import Limit
from energymargin.base.plausibility import kept_warnings, warn
from energymargin.base.table_text import csv_text
from energymargin.beliefs import Uncertainty
from energymargin.disturbances import Uniform
from energymargin.executors import Executor
from energymargin.grasps import Hand, Protocol
from energymargin.placing.boxes import frame_of, require_contacts, up_of
from energymargin.placing.pushes import Push, Pushes
from energymargin.placing.rooms import DROP, Release, Room, named
from energymargin.placing.settling import settle
from energymargin.placing.stacks import Places, carrier_of, staying
from energymargin.summary import Summarized

HOLD = 0.1  # s
DURING = 1.0  # s
PIECE = 0.1  # s, of a knock
RATES = (1.0, 6.0)  # Hz, of a shake
Ends = tuple[Floats, Floats]
"""The state in which a body is let go, and the one in which it is meant to rest."""


@dataclass(frozen=True, eq=False, repr=False)
class Placements(Summarized):
    """Candidates from the best to the worst, and what each of them takes."""

    scene: Scene
    body: str
    """What is set down."""
    ranking: Ranking
    """Probabilities that it and all other objects stay, with intervals, and the decision."""
    poses: dict[str, NDArray[np.float64]]
    """Of the body's frame by candidate, (4, 4)."""
    blocked: dict[str, str]
    """Candidates without room, and the body that is in their way."""
    pushes: dict[str, Push]
    """The least push that makes it fall, and who falls with it, of those for which it was asked.
    Its effort is 0 where the body does not stay in its place undisturbed."""
    complete: bool = field(default=True, repr=False)
    """False if the timeout or the cancel came before a draw or a push."""

    @property
    def best(self) -> str:
        """The name of the first."""
        return self.ranking.best

    @property
    def pose(self) -> NDArray[np.float64]:
        """The pose of the best one, (4, 4)."""
        return self.poses[self.best]

    def __len__(self) -> int:
        """How many were compared."""
        return len(self.ranking)

    def __iter__(self) -> Iterator[Standing]:
        """From the best to the worst."""
        return iter(self.ranking)

    def to_csv(self) -> str:
        """A line for each candidate with room, the best first, in full precision: probability,
        interval, push, and pose."""
        head = ("name", "probability", "low", "high", "draws", "effort", "way", "takes")
        where = ("x", "y", "z", "qx", "qy", "qz", "qw")
        rows = []
        for one in self.ranking:
            push, pose = self.pushes.get(one.name), self.poses[one.name]
            said = (push.effort, push.way, " ".join(push.takes)) if push else ("", "", "")
            turn = Rotation.from_matrix(pose[:3, :3]).as_quat()
            facts = (one.name, one.score, one.low, one.high, one.draws)
            rows.append((*facts, *said, *pose[:3, 3].tolist(), *turn.tolist()))
        return csv_text((*head, *where), rows)


def placements(
    scene: Scene,
    body: str,
    poses: Mapping[str, ArrayLike] | ArrayLike | None = None,
    *,
    on: Sequence[str] = (),
    spacing: float = 0.05,
    yaws: Sequence[float] = (0.0,),
    state: ArrayLike | None = None,
    height: float = 0.005,
    radius: float = 0.05,
    angle: float = 0.35,
    knock: float = 0.1,
    shake: float = 0.0,
    tilt: float = 0.0,
    plan: Plan | None = None,
    hand: Hand | str | None = None,
    grasp: ArrayLike | None = None,
    release: Protocol | str = "release",
    uncertainty: Uncertainty | None = None,
    horizon: float = DURING,
    rollouts: int = 60,
    confidence: float = 0.95,
    tolerance: float = 0.05,
    race: bool = True,
    pushed: int = 5,
    seed: int = 0,
    store: str | Path | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Placements:
    """Where shall I put it? Candidates, ranked by how likely all stays where it is.

    A candidate is a pose at which the body is meant to rest. It is let go `height` above that, and
    stays if its centre of mass stays within `radius` of its place along each axis and it leans by
    at most `angle`, and so do all other objects. All candidates meet the same draws.

    Args:
        scene: what there is: the body with the role "object", supports, and neighbours; those with
            the role "object" count.
        body: what is set down.
        poses: of its frame, by name, or (n, 4, 4); None: a grid on what is named in `on`.
        on: supports, by name. Each convex part of one has a top, on which there is a grid.
        spacing: of the grid [m].
        yaws: turns of the body on the grid, about the vertical [rad].
        state: of the others, shape (n,), and how the body is turned on the grid; None: as the scene
            has them.
        height: from which it is let go [m].
        radius: [m]
        angle: [rad]
        knock: largest random force on each object, along each axis, for at most 0.1 s after
            another, as a share of the objects' mean weight.
        shake: largest peak of the support's acceleration [m/s^2], at 1 to 6 Hz. Objects feel it,
            and a tilt; links of a mechanism do not.
        tilt: largest slope of the support [rad].
        plan: of the support, a kinematic body, as a tray that goes on: from the release on, for its
            duration, in place of `horizon`. There the places are those on the support.
        hand: sets it down, as of `em.grasps.score`; None: nothing holds it.
        grasp: where the hand holds the body: the grasp frame in the body's frame, (4, 4).
        release: what the hand then does: a protocol of `em.grasps`. "release" opens it in 0.4 s,
            and backs off by 10 cm along its approach; `horizon` follows.
        uncertainty: how well friction, masses, poses and velocities are known at the release.
        horizon: after the release [s].
        rollouts: the most draws of each candidate.
        confidence: of all comparisons together.
        tolerance: a difference of probabilities that does not matter.
        race: False scores every candidate to the end.
        pushed: for so many of the best, the least push that makes the body fall is searched.
        seed: of all draws.
        store: a file where draws are kept, as of `em.rank`, without a shake and a tilt.
        threads: None takes all cores. Nothing depends on them.
        executor: in place of threads, of `em.executors`.
        progress: progress(done, total) counts draws.
        timeout: after so many seconds what is known counts.
        cancel: the same once it is set.

    Raises ValueError on bad arguments, on a body that is no object, and if no candidate has room;
    others as `em.rank`.
    """
    limit = Limit(timeout, cancel)
    objects = [one.name for one in scene.bodies if one.role == "object"]
    checks.one_of("body", body, objects)
    if checks.whole_number("pushed", pushed, 0):
        require_contacts(scene, f"pushed is {pushed}", "pushed=0, or ")
    jolts = {"knock": knock, "shake": shake, "tilt": tilt}
    for name, value in jolts.items():
        if checks.not_negative_number(name, value) and name != "knock":
            _require_objects(scene, f"{name} is {value:g}")
    room = Room(scene, body, np.array(scene.pack() if state is None else state, float))
    if poses is None:
        asked = room.grid(on, checks.positive_number("spacing", spacing), yaws, limit)
    else:
        asked = named(poses)
    place = checks.positive_number("radius", radius), checks.positive_number("angle", angle)
    places, letting = Places(*place, carrier_of(scene, plan), {body: height}), None
    _check_hand(hand, plan, grasp, uncertainty)
    if hand is not None:
        letting = Release(scene, body, hand, grasp, release)  # type: ignore[arg-type]
    during = checks.positive_number("horizon", horizon) if plan is None else plan.duration
    lift = checks.not_negative_number("height", height) * up_of(scene)
    blocked: dict[str, str] = {}
    problems: dict[str, Problem] = {}
    ends: dict[str, Ends] = {}
    for name, pose in asked.items():
        limit.require("the candidates were looked at")
        ends[name] = start, meant = room.state(pose, lift), room.state(pose, np.zeros(3))
        asking = scene, start, plan, during
        other = room.blocked_by(start)
        if other is None and letting is not None:
            other, asking = letting.begin(start, during)
        if other is not None:
            blocked[name] = other
            continue
        with kept_warnings():  # a thing that is let go falls, in each of many problems
            problems[name] = staying((scene, meant), asking, places, HOLD)
    if poses is not None:
        _warn_of_air({k: room.nearest(ends[k][1]) for k in problems})
    if not problems:
        there = ", ".join(sorted(set(blocked.values()))) or "nothing to stand on"
        raise ValueError(f"poses is {len(asked)} candidates, none of which has room: {there}")
    disturbance = Jolts.of(scene, **jolts) if shake or tilt else Uniform(knock)
    draws: Any = {"disturbance": disturbance, "uncertainty": uncertainty, "seed": seed}
    draws |= {"rollouts": rollouts, "confidence": confidence, "tolerance": tolerance, "race": race}
    where: Any = {"store": store, "threads": threads, "executor": executor, "progress": progress}
    ranking = rank(problems, **draws, **where, **limit.rest())
    first = {name: ends[name] for name in ranking.names[:pushed]}
    pushes = _pushes(scene, body, first, places, limit)
    whole = ranking.complete and len(pushes) == len(first)
    found = {k: asked[k] for k in problems}
    return Placements(scene, body, ranking, found, blocked, pushes, whole)


def _pushes(
    scene: Scene, body: str, candidates: Mapping[str, Ends], places: Places, limit: Limit
) -> dict[str, Push]:
    """The least push that makes a body fall, by candidate; of those before the limit."""
    pushes: dict[str, Push] = {}
    for name, ends in candidates.items():
        try:
            with kept_warnings():
                pushes[name] = _push(scene, body, ends, places, limit)
        except (TimeoutError, Cancelled):
            break
    return pushes


def _push(scene: Scene, body: str, ends: Ends, places: Places, limit: Limit) -> Push:
    """The least push that makes a body fall, once it came to rest where it was let go."""
    start, meant = ends
    end = settle(scene, start, **limit.rest())
    if not end.complete:
        limit.require("it came to rest")
    objects = [one for one in scene.bodies if one.role == "object"]
    stays = {b.name: places.of(scene, meant, b).contains(scene, end.state) for b in objects}
    if stays[body]:
        return Pushes(scene, end.state, limit).least(body)
    others = tuple(name for name, there in stays.items() if not there and name != body)
    return Push(body, 0.0, "by itself", (0.0, 0.0, 0.0), others)


def _require_objects(scene: Scene, asked: str) -> None:
    """Raises ValueError on a body that would not feel a shake or a tilt, as a loose tray."""
    links = {joint.child for joint in scene.joints}
    for one in scene.bodies:
        if one.role == "none" and one.mass > 0 and not one.kinematic and one.name not in links:
            text = f"{asked}, and {one.name!r} is a free body of role 'none'"
            raise ValueError(f"{text}, which does not feel it: expected role 'object'")


def _check_hand(
    hand: Hand | str | None,
    plan: Plan | None,
    grasp: ArrayLike | None,
    uncertainty: Uncertainty | None,
) -> None:
    """Raises ValueError on what does not go with a hand, or without one."""
    known = uncertainty is None or (uncertainty.pose is None and uncertainty.velocity is None)
    held, gripped, planned = (one is not None for one in (hand, grasp, plan))
    moves = "uncertainty has a pose or a velocity"
    way = "expected friction and mass, and errors of its pose as poses of their own"
    faults = {
        "grasp is given, and no hand has it: expected one, as hand='panda'": gripped and not held,
        "grasp is None, expected where the hand holds the body, (4, 4)": held and not gripped,
        "plan and hand are given, expected one: a support that waits, or no hand": held and planned,
        f"{moves}, but the hand holds the body: {way}": held and not known,
    }
    for text, wrong in faults.items():
        if wrong:
            raise ValueError(text)


def _warn_of_air(found: Mapping[str, tuple[float, str]]) -> None:
    """Of poses in which the body rests on nothing."""
    fall = [(name, *one) for name, one in found.items() if one[0] > DROP]
    for name, gap, nearest in fall[:1]:
        where = f"{gap:.3g} m from {nearest!r}, the nearest body"
        text = f"{len(fall)} of {len(found)} poses are in the air, as {name!r}, {where}"
        warn([("poses", f"{text}: a pose is where the body's frame is when it rests")], None)


@dataclass(frozen=True, eq=False)
class Jolts:
    """Random forces on the objects of a scene, as a disturbance of `em.rank`.

    A knock is a force along each axis, even up to `knock` times their mean weight, on each body,
    for 0.1 s after 0.1 s. In a support that is shaken along a random horizontal direction, or leans
    in one, a body feels a force in proportion to its mass.
    """

    masses: Floats
    """Of the objects [kg], (k,)."""
    mean: float
    """Of those, as they are believed most [kg]."""
    frame: Floats
    """Two horizontal axes and the one that is up, (3, 3)."""
    gravity: float
    """[m/s^2]"""
    knock: float = 0.0
    """Largest force along each axis, as a share of the mean weight."""
    shake: float = 0.0
    """Largest peak of the support's acceleration [m/s^2]."""
    tilt: float = 0.0
    """Largest slope of the support [rad]."""

    @staticmethod
    def of(scene: Scene, *, knock: float, shake: float, tilt: float) -> Jolts:
        """Those of a scene's objects."""
        masses, gravity = _masses(scene), float(np.linalg.norm(scene.gravity))
        return Jolts(masses, float(masses.mean()), frame_of(scene), gravity, knock, shake, tilt)

    def of_problem(self, problem: Problem) -> Jolts:
        """The same in a problem whose objects have other masses: what is heavy feels more."""
        return replace(self, masses=_masses(problem.scene))

    def __call__(self, random: np.random.Generator, times: Floats) -> Floats:
        """Forces [N] and torques [N m] at these times (steps,), shape (steps, 6 k)."""
        count, (one, other, up) = len(self.masses), self.frame
        pieces = 1 + int(times[-1] / PIECE)
        knocks = self.knock * self.gravity * random.uniform(-1, 1, (pieces, count, 3))
        leaning, size, shaken, phase = random.random(4)
        rate = random.uniform(*RATES)
        angles, tilt = (2 * np.pi * leaning, 2 * np.pi * shaken), self.tilt * size
        down, along = (np.cos(angle) * one + np.sin(angle) * other for angle in angles)
        change = self.gravity * (np.sin(tilt) * down + (1 - np.cos(tilt)) * up)
        wave = self.shake * random.random() * np.sin(2 * np.pi * (rate * times + phase))
        wrenches = np.zeros((len(times), count, 6))
        wrenches[:, :, :3] = self.mean * knocks[(times / PIECE).astype(int)]
        wrenches[:, :, :3] += self.masses[:, None] * (change + wave[:, None] * along)[:, None]
        return wrenches.reshape(len(times), -1)


def _masses(scene: Scene) -> Floats:
    """Of the objects [kg], (k,), as the scene's engine has them."""
    objects = [body for body in scene.bodies if body.role == "object"]
    varied = getattr(scene.engine, "varies", {})
    return np.array([varied.get(f"mass.{body.name}", body.mass) for body in objects])
