"""A ball in the closed hand of a public model: is it held as in MuJoCo?

A hand opens, and closes on a ball of 5 cm by the full command of its actuators: each to the end of
its range by which the tips come nearer to each other or, of a hand with more than two actuators, to
the palm. Nothing weighs anything meanwhile. Then gravity pulls the ball away from the palm for two
seconds. Both engines have the same model, start and commands.

What MuJoCo's contacts hold creeps, the less the greater `impratio` is. So there are two of it: as
the file says, and *firm*, with an elliptic cone and an impratio of 100. Of many places for the ball
it is the one where it falls least in the firm one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin._core import World
from energymargin.model.scenes.mjcf_model import engine
from energymargin.mujoco.states import state as em_state
from energymargin.scenes import from_mjcf

Vector = NDArray[np.float64]

RADIUS, MASS = 0.025, 0.1  # m, kg
GRAVITY = 9.81  # m/s^2
OPENING, PROBING, CLOSING, HANGING = 1.0, 1.0, 2.0, 2.0  # s
LOST = 2 * RADIUS  # m; a ball that falls by more is not held
NEARER = 1e-3  # m, by which an actuator that closes brings the tips
# Places for the ball: beside the middle of the tips, as they are in so many moments of the closing.
MOMENTS, ASIDE = 6, 0.015  # m
AHEAD = (0.0, 0.01, -0.01, 0.02, -0.02, -0.03, -0.04, -0.05, -0.06, -0.07, -0.08)  # m
STEP, SEARCH_STEP = 5e-4, 2e-3  # s, of MuJoCo
BALL = "ball of the study"
FIRM = 100.0  # impratio
RADIANS = "robosuite"  # its files are parts of a scene that says so


class Grip(NamedTuple):
    """How far a ball gets out of a hand in two seconds, and in the last half of one [m]."""

    file: str
    fell: float
    creep: float
    fell_mujoco: float
    creep_mujoco: float
    fell_firm: float
    creep_firm: float
    unconverged: float
    """Share of the steps."""

    def row(self) -> list[str]:
        """Of a table [mm]."""
        ways = np.reshape(self[1:7], (3, 2))
        cells = [
            (f"{1e3 * fell:.2f}", f"{1e3 * creep:.3f}") if abs(fell) < LOST else ("lost", "")
            for fell, creep in ways
        ]
        return [self.file, *cells[0], *cells[1], *cells[2], f"{100 * self.unconverged:.2g} %"]


LAST = "last 0.5 s"
HEAD = ["hand", "falls [mm]", LAST, "MuJoCo [mm]", LAST, "firm [mm]", LAST, "unconverged"]


def grip(file: Path, options: Mapping[str, Any]) -> Grip | None:
    """What becomes of a ball in a hand; None if a file is no hand on its own, with fingers that
    close, or has no room for the ball. `options`: of `from_mjcf`."""
    hand = _hand(file)
    found = hand.start() if hand else None
    if hand is None or found is None:
        return None
    data, out = found
    given = {**options, "data": data, "object": BALL, "disable_collisions": "overlapping"}
    hand.model.opt.gravity = 0.0
    closing = from_mjcf(hand.model, **given)
    hand.model.opt.gravity = GRAVITY * out
    hanging = from_mjcf(hand.model, **given)
    closes, hangs = (round(duration / closing.step) for duration in (CLOSING, HANGING))
    held = World(closing).simulate(em_state(closing, hand.model, data), closes, record=[closes])
    falls = World(hanging).simulate(held.states[0], hangs)
    at = closing.slice(BALL).start
    states = np.concatenate([held.states, falls.states])
    ways = states[:, at : at + 3] @ out
    unconverged = (held.unconverged + falls.unconverged) / (closes + hangs)
    own, firm = (hand.fall(data, out, HANGING, STEP, each) for each in (False, True))
    name = f"{file.parent.name}/{file.name}"
    return Grip(name, *_ends(ways), *own, *firm, unconverged)


def _ends(ways: Vector) -> tuple[float, float]:
    """The whole way, and that of its last quarter."""
    return float(ways[-1] - ways[0]), float(ways[-1] - ways[-1 - (len(ways) - 1) // 4])


def _hand(file: Path) -> _Hand | None:
    """The hand of a file; None if it moves, or has less than two fingers."""
    mujoco = engine()
    spec = mujoco.MjSpec.from_file(str(file))
    spec.compiler.degree = spec.compiler.degree and RADIANS not in file.parts
    ball = spec.worldbody.add_body(name=BALL)
    ball.add_freejoint()
    solid = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [RADIUS, 0, 0], "mass": MASS}
    ball.add_geom(**solid, contype=1, conaffinity=1, condim=3, friction=[1, 0.005, 0.0001])
    model = spec.compile()
    # A hand on an arm does not collide with its first links; one that stands on the world would.
    for body in np.flatnonzero(model.body_weldid):
        parent = model.body_parentid[body]
        if parent and not model.body_weldid[parent]:
            spec.add_exclude(bodyname1=model.body(body).name, bodyname2=model.body(parent).name)
    hand = _Hand(spec.compile())
    alone = model.nu and not model.nmocap and len(hand.tips) > 1
    return hand if alone and hand.closes() else None


class _Hand:
    """A hand with a ball, in MuJoCo."""

    def __init__(self, model: Any) -> None:
        """Finds tips: bodies that collide, and that carry none that does."""
        self.model = model
        self.ball = int(model.body(BALL).id)
        self._own = int(model.opt.cone), float(model.opt.impratio)
        self._tree = int(model.body_treeid[self.ball])
        self._solid = (model.geom_contype | model.geom_conaffinity) != 0
        self._solid &= model.geom_bodyid != self.ball
        moved = {int(b) for b in model.geom_bodyid[self._solid] if model.body_weldid[b]}
        carry = {above for body in moved for above in self._above(body)}
        self.tips = sorted(moved - carry)
        chains = [self._above(tip) for tip in self.tips]
        common = (b for b in chains[0] if all(b in chain for chain in chains)) if chains else ()
        self.palm = next(iter(common), 0)
        self._opens = self._closes = np.zeros(model.nu)

    def _above(self, body: int) -> list[int]:
        parents = self.model.body_parentid
        return [body := int(parents[body]) for _ in iter(lambda: body, 0)]

    def closes(self) -> bool:
        """Whether commands close the fingers, and move all; finds those, and what opens them."""
        mujoco, ends = engine(), self.model.actuator_ctrlrange
        start = mujoco.MjData(self.model)
        rest = np.clip(start.ctrl, *ends.T)
        self._opens, self._closes = rest.copy(), rest.copy()
        for i in range(self.model.nu):
            commands = [np.where(np.arange(len(rest)) == i, end, rest) for end in ends[i]]
            spreads = [self._spread(self._moved(start, command, PROBING)) for command in commands]
            if abs(spreads[0] - spreads[1]) > NEARER:
                closing = int(np.argmin(spreads))
                self._closes[i], self._opens[i] = ends[i][closing], ends[i][1 - closing]
        ways = np.zeros(self.model.nv)
        ends = [self._moved(start, each, PROBING).qpos for each in (self._opens, self._closes)]
        mujoco.mj_differentiatePos(self.model, ways, 1.0, *ends)
        moves = {int(tree) for tree in self.model.dof_treeid[np.abs(ways) > NEARER]}
        return moves == {int(tree) for tree in self.model.dof_treeid} - {self._tree}

    def _places(self, data: Any) -> Vector:
        """Of the tips, shape (T, 3) [m]."""
        own = [self._solid & (self.model.geom_bodyid == tip) for tip in self.tips]
        return np.array([data.geom_xpos[geoms].mean(axis=0) for geoms in own])

    def _spread(self, data: Any) -> float:
        places = self._places(data)
        middle = data.xpos[self.palm] if self.model.nu > 2 else places.mean(axis=0)
        return float(np.linalg.norm(places - middle, axis=1).sum())

    def _moved(self, data: Any, command: Vector, duration: float) -> Any:
        """A copy after some time under a command, in which nothing weighs or collides."""
        mujoco, data, option = engine(), data.__copy__(), self.model.opt
        option.gravity, option.timestep = 0.0, STEP
        flags = int(option.disableflags)
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        data.ctrl[:] = command
        mujoco.mj_step(self.model, data, round(duration / STEP))
        option.disableflags = flags
        return data

    def start(self) -> tuple[Any, Vector] | None:
        """An open hand with a ball where it falls least, and the way out, shape (3,); None if there
        is no room for it."""
        least, best = np.inf, None
        for data, out in self._starts():
            fell = abs(self.fall(data, out, HANGING, SEARCH_STEP, True)[0])
            if fell < least:
                least, best = fell, (data, out)
            if least < NEARER:
                break
        return best

    def _starts(self) -> Iterator[tuple[Any, Vector]]:
        wide = self._moved(engine().MjData(self.model), self._opens, OPENING)
        wide.qvel[:], wide.time, wide.ctrl[:] = 0.0, 0.0, self._closes
        data = wide
        for _ in range(MOMENTS):
            data = self._moved(data, self._closes, CLOSING / 2 / MOMENTS)
            middle = self._places(data).mean(axis=0)
            out = middle - wide.xpos[self.palm]
            out /= np.linalg.norm(out)
            side = np.cross(out, np.eye(3)[np.argmin(np.abs(out))])
            side *= ASIDE / np.linalg.norm(side)
            up = np.cross(out, side)
            for aside in (0 * up, side, -side, up, -up):
                for ahead in AHEAD:
                    start = wide.__copy__()
                    if self._put(start, middle + aside + ahead * out):
                        yield start, out

    def _put(self, data: Any, place: Vector) -> bool:
        """Whether there is room for the ball at a place, shape (3,), where it is then."""
        mujoco, model = engine(), self.model
        (joint,) = np.flatnonzero(model.jnt_bodyid == self.ball)
        at = model.jnt_qposadr[joint]
        data.qpos[at : at + 7] = *place, 1, 0, 0, 0
        mujoco.mj_forward(model, data)
        ball = int(model.body_geomadr[self.ball])
        return all(
            mujoco.mj_geomDistance(model, data, int(geom), ball, RADIUS, None) > 0
            for geom in np.flatnonzero(self._solid)
        )

    def fall(
        self, data: Any, out: Vector, hanging: float, step: float, firm: bool
    ) -> tuple[float, float]:
        """The way of a ball out of the closed hand after some time in MuJoCo, and in its last
        quarter [m]."""
        mujoco, option, data = engine(), self.model.opt, data.__copy__()
        option.timestep, option.gravity = step, 0.0
        cone = mujoco.mjtCone.mjCONE_ELLIPTIC if firm else self._own[0]
        option.cone, option.impratio = int(cone), FIRM if firm else self._own[1]
        mujoco.mj_step(self.model, data, round(CLOSING / step))
        option.gravity, ways = GRAVITY * out, [data.xpos[self.ball] @ out]
        for _ in range(round(hanging / step)):
            mujoco.mj_step(self.model, data)
            ways.append(data.xpos[self.ball] @ out)
        return _ends(np.array(ways))
