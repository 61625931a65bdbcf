"""Whether an engine keeps its promises."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NoReturn

import numpy as np

from energymargin._core import Body, Problem
from energymargin.base.aliases import Floats
from energymargin.base.checks import shown
from energymargin.model.engines import Batch, Engine
from energymargin.model.serial_engines import ways

ROWS, EVERY, CHECKS = 5, 3, 4  # of the batch that is played
PARTS = "states", "memory", "work"  # of an answer
VARIED, VARY = 3, 1.25  # of what it varies so many, and by how much
FASTER = 0.01  # m/s
ROUNDS, SWITCH = 8, 1e-5  # of threads at once; s, between which they take turns
SLACK = 1e-6  # of works, as shares of the largest
TURN = 1e-3  # likewise, of a turn about an axis that turns itself
WAY_OUT = "deterministic = False"
BACKWARDS = list(range(ROWS))[::-1]


def check(engine: Engine, problem: Problem, *, seed: int = 0) -> None:
    """Tests an engine against what em.engines.Engine promises, in rollouts from a problem's state.

    Shapes and dtypes are right, and answers are states; an answer stays as it is when the next one
    is made; rollouts begin at the states that are asked for; a rollout that is saved and goes on
    ends as one without a break; a row is the same in another order, alone, when it is asked for
    again, and beside other threads if the engine is `concurrent`; commands that are not given are
    those of the start; without a push nothing works, and the work of a push is that of its wrench
    at the mean of the velocities before and after its step; what it `varies` makes another engine,
    with another digest. All but shapes and works is compared bit by bit, and not asked of an engine
    that is not `deterministic`.

    Raises ValueError that says which promise is broken, and by how much.
    """
    checker = _Checker(engine, problem.with_engine(engine), seed)
    checker.check_names()
    checker.check_answer()
    if engine.deterministic:
        checker.check_start()
    checker.check_work()
    checker.check_begin()
    if engine.deterministic:
        checker.check_bits()
        if engine.concurrent:
            checker.check_threads()
        checker.require_same("the first batch, after all others,", checker.batch)


class _Checker:
    """An engine, and rollouts of it from a problem's state."""

    def __init__(self, engine: Engine, problem: Problem, seed: int) -> None:
        """Draws pushes within the problem's bounds."""
        self.engine, self.scene = engine, problem.scene
        self.objects = [body for body in self.scene.bodies if body.role == "object"]
        random, steps = np.random.default_rng(seed), EVERY * CHECKS
        bounds = np.concatenate([problem.force, problem.torque])
        wrenches = bounds * random.uniform(-1, 1, (ROWS, CHECKS, len(self.objects), 6))
        states = np.tile(problem.state, (ROWS, 1))
        commands = {name: np.full((ROWS, steps), value) for name, value in engine.commands.items()}
        pushes = np.repeat(wrenches, EVERY, axis=1)
        self.batch = Batch(states, engine._start(states), pushes, commands, steps, EVERY)
        """Rollouts, a row each."""
        self.whole: Sequence[Floats] = ()
        """The answer to it, once it is known to be one."""

    def play(self, batch: Batch) -> tuple[Floats, Floats, Floats]:
        """An answer to a batch; the batch stays as it is."""
        return self.engine._answer(_rows(batch, list(range(len(batch.states)))))

    def fail(self, text: str, cause: Exception | None = None) -> NoReturn:
        """Says which promise is broken."""
        raise ValueError(f"{self.engine!r}: {text}") from cause

    def check_names(self) -> None:
        """Its digest, and what it varies."""
        engine, digest = self.engine, self.engine.digest()
        if not isinstance(digest, str) or engine.digest() != digest:
            wrong = f"digest() returned {shown(digest)} and then {shown(engine.digest())}"
            self.fail(f"{wrong}, expected one text for one engine")
        for name, value in list(engine.varies.items())[:VARIED]:
            changed = VARY * value if value else VARY
            other, call = engine.varied({name: changed}), f"varied({{{name!r}: {changed:g}}}) has"
            if other.varies.get(name) != changed or engine.varies.get(name) != value:
                self.fail(
                    f"{call} {other.varies.get(name)} where this one has "
                    f"{engine.varies.get(name)}, expected {changed:g} and {value:g}"
                )
            if other.digest() == digest:
                self.fail(f"{call} the same digest, expected another one: its answers may differ")

    def check_answer(self) -> None:
        """Its dtypes, that it stays as it is, and that what it has are states and finite."""
        batch, everything = self.batch, list(range(ROWS))
        first: Any = self.engine.play(_rows(batch, everything))
        if isinstance(first, tuple) and len(first) == len(PARTS):  # or `_answer` says so
            for what, part in zip(PARTS, first, strict=True):
                kind = getattr(part, "dtype", None)
                if kind != np.float64:
                    self.fail(f"play returned {what} of dtype {kind}, expected arrays of float64")
            before = [np.array(part) for part in first]
            self.engine.play(replace(_rows(batch, everything), pushes=-batch.pushes))
            for what, part, kept in zip(PARTS, first, before, strict=True):
                if not np.array_equal(part, kept, equal_nan=True):
                    expected = "expected a new array for each answer"
                    self.fail(f"play wrote over the {what} that it had returned before, {expected}")
        self.whole = self.play(batch)
        for state in self.whole[0].reshape(-1, batch.states.shape[1]):
            try:
                if np.isfinite(state).all():
                    self.scene.unpack(state)
            except ValueError as error:
                self.fail(f"play returned what is no state: {error}", error)

        for what, part in zip(PARTS, self.whole, strict=True):
            if not np.isfinite(part).all():
                self.fail(f"{what} are not finite, expected a rollout that goes on")

    def check_begin(self) -> None:
        """Whether a rollout begins with the velocity of its state."""
        linked = {joint.child for joint in self.scene.joints}
        for body in self.objects:
            if body.name in linked or not all(body.linear_factor):
                continue
            other = self.batch.states.copy()
            other[:, self.scene.slice(body.name)][:, 7] += FASTER
            try:
                memory = self.engine._start(other)
            except ValueError:  # it refuses other states than its own
                return
            slow = self.play(self.batch)[0][:, 0]
            fast = self.play(replace(self.batch, states=other, memory=memory))[0][:, 0]
            if np.array_equal(slow, fast):
                self.fail(
                    f"rollouts from a state in which {body.name!r} is faster by {FASTER:g} m/s "
                    "have the same states, expected others: start(states) has to begin there"
                )

    def check_start(self) -> None:
        """A start is a function of its state alone."""
        start, states = self.engine._start, self.batch.states
        whole = start(states.copy())
        others = {
            "asked again": start(states.copy()),
            "in another order": start(states[BACKWARDS])[BACKWARDS],
            "of a row alone": np.concatenate([start(row[None]) for row in states]),
        }
        for how, other in others.items():
            if not np.array_equal(whole, other):
                self.fail(
                    f"start {how} has other memory, off by {_off(whole, other)}, expected the same "
                    "bits: what is drawn at random has to follow from the state"
                )

    def check_threads(self) -> None:
        """Rows that several threads ask for at once, and switch often."""
        interval = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH)
        try:
            with ThreadPoolExecutor(ROWS) as pool:
                for _ in range(ROUNDS):
                    alone = pool.map(lambda row: self.play(_rows(self.batch, [row])), range(ROWS))
                    for row, answer in enumerate(list(alone)):
                        what = f"row {row} beside other threads"
                        self._compare(what, answer, [row], "concurrent = False")
        finally:
            sys.setswitchinterval(interval)

    def check_bits(self) -> None:
        """An answer depends on its row alone, and a rollout may be saved and go on."""
        batch = self.batch
        self.require_same("the same batch, asked again,", batch)
        idle = replace(batch, commands={})
        self.require_same("the batch without commands, which begin with those values,", idle)
        self.require_same("the batch in another order", batch, BACKWARDS)
        for row in range(ROWS):
            self.require_same(f"row {row} alone", batch, [row])
        first = self.play(_steps(batch, 0, EVERY))
        rest = _steps(batch, EVERY, batch.steps)
        then = self.play(replace(rest, states=first[0][:, -1].copy(), memory=first[1]))
        states, work = (np.concatenate([first[k], then[k]], axis=1) for k in (0, 2))
        self._compare("a rollout that is saved and goes on", (states, then[1], work), None)

    def require_same(self, what: str, batch: Batch, rows: list[int] | None = None) -> None:
        """Rows of a batch have the same answers as those of the first one."""
        found = self.play(batch if rows is None else _rows(batch, rows))
        self._compare(what, found, rows)

    def _compare(
        self, what: str, found: Sequence[Floats], rows: list[int] | None, way_out: str = WAY_OUT
    ) -> None:
        for name, one, whole in zip(PARTS, found, self.whole, strict=True):
            other = whole if rows is None else whole[rows]
            if not np.array_equal(one, other):
                self.fail(
                    f"{what} has other {name}, off by {_off(one, other)}, expected the same bits: "
                    "what a rollout goes on from has to be in its state and memory, or the engine "
                    f"says {way_out}"
                )

    def check_work(self) -> None:
        """The work of each step: its push at the mean of the velocities before and after it."""
        engine, batch = self.engine, self.batch
        still = self.play(replace(batch, pushes=np.zeros_like(batch.pushes)))[2]
        if still.any():
            self.fail(f"work is {float(np.abs(still).max()):.3g} J without a push, expected 0")
        states, _, work = self.play(replace(batch, every=1))
        paths = np.concatenate([batch.states[:, None], states], axis=1)
        for k, body in enumerate(self.objects):
            rows, pushes = [self._motion(path, body) for path in paths], batch.pushes[:, :, k]
            twists = np.array(rows)[..., 7:]
            powers = [(pushes * of).sum(-1) for of in (twists[:, :-1], twists[:, 1:])]
            ends = self.scene.step * np.sort(powers, axis=0)
            slack = SLACK * np.abs(ends).max() + 1e-12
            if engine.substeps == 1:
                ends = np.repeat(ends.mean(axis=0, keepdims=True), 2, axis=0)
            else:  # whose velocities nobody sees: what the way says, to a substep
                moves = np.array([ways(row[:-1], row[1:]) for row in rows])
                middle, part = (pushes * moves).sum(-1), np.ptp(ends, axis=0)
                ends = np.stack([middle - part / engine.substeps, middle + part / engine.substeps])
                slack += TURN * np.abs(middle).max()
            outside = (work[:, :, k] < ends[0] - slack) | (work[:, :, k] > ends[1] + slack)
            if outside.any():
                row, step = (int(i) for i in np.argwhere(outside)[0])
                self.fail(
                    f"the push on {body.name!r} in step {step} of row {row} works "
                    f"{work[row, step, k]:.6g} J, expected {ends[0, row, step]:.6g} to "
                    f"{ends[1, row, step]:.6g}, from f . v + tau . omega before and after the step"
                )

    def _motion(self, states: Floats, body: Body) -> Floats:
        """A body in states as `Serial.bodies` has it, with its centre of mass, (m, 13)."""
        from scipy.spatial.transform import Rotation

        center = np.zeros(3) if body.inertial is None else np.array(body.inertial.center)
        rows = np.empty((len(states), 13))
        for row, state in zip(rows, states, strict=True):
            now = self.scene.unpack(state)[body.name]
            turn, spin = now["orientation"], now["angular_velocity"]
            arm = Rotation.from_quat(turn).apply(center)
            row[:3], row[3:7] = now["position"] + arm, turn
            row[7:10], row[10:] = now["velocity"] + np.cross(spin, arm), spin
        return rows


def _rows(batch: Batch, rows: list[int]) -> Batch:
    """Some rows, copied."""
    commands = {name: values[rows] for name, values in batch.commands.items()}
    arrays = batch.states[rows], batch.memory[rows], batch.pushes[rows]
    return Batch(*arrays, commands, batch.steps, batch.every)


def _steps(batch: Batch, first: int, last: int) -> Batch:
    commands = {name: values[:, first:last] for name, values in batch.commands.items()}
    return replace(batch, pushes=batch.pushes[:, first:last], commands=commands, steps=last - first)


def _off(one: Floats, other: Floats) -> str:
    return f"{float(np.nanmax(np.abs(one - other))):.3g}"
