"""Whether an engine keeps its promises."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from energymargin._core import Problem
from energymargin.base.checks import shown
from energymargin.model.engines import Batch, Engine, Numbers

ROWS, EVERY, CHECKS = 5, 3, 4  # of the batch that is played
PARTS = "states", "memory", "work"  # of an answer
VARIED, VARY = 3, 1.25  # of what it varies so many, and by how much
FASTER = 0.01  # m/s
ROUNDS, SWITCH = 8, 1e-5  # of threads at once; s, between which they take turns
SLACK = 1e-6  # of works, as shares of the largest
TURN = 1e-3  # likewise, of a turn about an axis that turns itself
Played = tuple[Numbers, Numbers, Numbers]


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
    tested = problem.with_engine(engine)
    _check_names(engine)
    batch = _batch(engine, tested, seed)
    _check_answer(engine, tested, batch)
    whole = _play(engine, batch)
    for what, part in zip(PARTS, whole, strict=True):
        if not np.isfinite(part).all():
            raise ValueError(f"{engine!r}: {what} are not finite, expected a rollout that goes on")
    if engine.deterministic:
        _check_start(engine, batch)
    _check_work(engine, tested, batch)
    _check_begin(engine, tested, batch)
    if engine.deterministic:
        _check_bits(engine, batch, whole)
        if engine.concurrent:
            _check_threads(engine, batch, whole)
        _require_same(engine, "the first batch, after all others,", _play(engine, batch), whole)


def _batch(engine: Engine, problem: Problem, seed: int) -> Batch:
    """Rollouts from the state under pushes within the problem's bounds."""
    objects = sum(body.role == "object" for body in problem.scene.bodies)
    random, steps = np.random.default_rng(seed), EVERY * CHECKS
    bounds = np.concatenate([problem.force, problem.torque])
    wrenches = bounds * random.uniform(-1, 1, (ROWS, CHECKS, objects, 6))
    states = np.tile(problem.state, (ROWS, 1))
    commands = {name: np.full((ROWS, steps), value) for name, value in engine.commands.items()}
    pushes = np.repeat(wrenches, EVERY, axis=1)
    return Batch(states, engine._start(states), pushes, commands, steps, EVERY)


def _play(engine: Engine, batch: Batch) -> Played:
    """An answer to a batch; the batch stays as it is."""
    n, d = batch.states.shape
    commands = np.empty((n, batch.steps, len(batch.commands)))
    for i, values in enumerate(batch.commands.values()):
        commands[:, :, i] = values
    states, memory, work = engine._play(
        states=batch.states.copy(),
        memory=batch.memory.copy(),
        pushes=batch.pushes.reshape(n * batch.steps, -1).copy(),
        commands=commands.reshape(n * batch.steps, -1),
        commanded=list(batch.commands),
        steps=batch.steps,
        every=batch.every,
    )
    return states.reshape(n, -1, d), memory, work.reshape(n, batch.steps, -1)


def _check_names(engine: Engine) -> None:
    """Its digest, and what it varies."""
    digest = engine.digest()
    if not isinstance(digest, str) or engine.digest() != digest:
        raise ValueError(
            f"{engine!r}: digest() returned {shown(digest)} and then {shown(engine.digest())}, "
            "expected one text for one engine"
        )
    for name, value in list(engine.varies.items())[:VARIED]:
        changed = VARY * value if value else VARY
        other = engine.varied({name: changed})
        if other.varies.get(name) != changed or engine.varies.get(name) != value:
            raise ValueError(
                f"{engine!r}: varied({{{name!r}: {changed:g}}}) has {other.varies.get(name)} where "
                f"this one has {engine.varies.get(name)}, expected {changed:g} and {value:g}"
            )
        if other.digest() == digest:
            raise ValueError(
                f"{engine!r}: varied({{{name!r}: {changed:g}}}) has the same digest, expected "
                "another one: its answers may differ"
            )


def _check_answer(engine: Engine, problem: Problem, batch: Batch) -> None:
    """Its dtypes, that it stays as it is, and that what it has are states."""
    first = engine.play(_copied(batch))
    if isinstance(first, tuple) and len(first) == len(PARTS):  # or _play says so
        for what, part in zip(PARTS, first, strict=True):
            kind = getattr(part, "dtype", None)
            if kind != np.float64:
                raise ValueError(
                    f"{engine!r}: play returned {what} of dtype {kind}, expected arrays of float64"
                )
        before = [np.array(part) for part in first]
        engine.play(replace(_copied(batch), pushes=-batch.pushes))
        for what, part, kept in zip(PARTS, first, before, strict=True):
            if not np.array_equal(part, kept, equal_nan=True):
                raise ValueError(
                    f"{engine!r}: play wrote over the {what} that it had returned before, expected "
                    "a new array for each answer"
                )
    for state in _play(engine, batch)[0].reshape(-1, batch.states.shape[1]):
        try:
            if np.isfinite(state).all():
                problem.scene.unpack(state)
        except ValueError as error:
            raise ValueError(f"{engine!r}: play returned what is no state: {error}") from error


def _check_begin(engine: Engine, problem: Problem, batch: Batch) -> None:
    """Whether a rollout begins with the velocity of its state."""
    free = {joint.child for joint in problem.scene.joints}
    for body in problem.scene.bodies:
        if body.role != "object" or body.name in free or not all(body.linear_factor):
            continue
        other = batch.states.copy()
        other[:, problem.scene.slice(body.name)][:, 7] += FASTER
        try:
            memory = engine._start(other)
        except ValueError:  # it refuses other states than its own
            return
        slow, fast = (
            _play(engine, replace(batch, states=states, memory=own))[0][:, 0]
            for states, own in ((batch.states, batch.memory), (other, memory))
        )
        if np.array_equal(slow, fast):
            raise ValueError(
                f"{engine!r}: rollouts from a state in which {body.name!r} is faster by {FASTER:g} "
                "m/s have the same states, expected others: start(states) has to begin there"
            )


def _check_start(engine: Engine, batch: Batch) -> None:
    """A start is a function of its state alone."""
    whole, order = engine._start(batch.states.copy()), slice(None, None, -1)
    others = {
        "asked again": engine._start(batch.states.copy()),
        "in another order": engine._start(batch.states[order].copy())[order],
        "of a row alone": np.concatenate([engine._start(row[None]) for row in batch.states]),
    }
    for how, other in others.items():
        if not np.array_equal(whole, other):
            off = float(np.nanmax(np.abs(whole - other)))
            raise ValueError(
                f"{engine!r}: start {how} has other memory, off by {off:.3g}, expected the same "
                "bits: what is drawn at random has to follow from the state"
            )


def _check_threads(engine: Engine, batch: Batch, whole: Played) -> None:
    """Rows that several threads ask for at once, and switch often."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        with ThreadPoolExecutor(ROWS) as pool:
            for _ in range(ROUNDS):
                alone = pool.map(lambda row: _play(engine, _rows(batch, [row])), range(ROWS))
                for row, answer in enumerate(list(alone)):
                    what = f"row {row} beside other threads"
                    _require_same(
                        engine, what, answer, [part[[row]] for part in whole], "concurrent = False"
                    )
    finally:
        sys.setswitchinterval(interval)


def _copied(batch: Batch) -> Batch:
    commands = {name: values.copy() for name, values in batch.commands.items()}
    arrays = batch.states.copy(), batch.memory.copy(), batch.pushes.copy()
    return Batch(*arrays, commands, batch.steps, batch.every)


def _rows(batch: Batch, rows: list[int]) -> Batch:
    return replace(
        batch,
        states=batch.states[rows],
        memory=batch.memory[rows],
        pushes=batch.pushes[rows],
        commands={name: values[rows] for name, values in batch.commands.items()},
    )


def _steps(batch: Batch, first: int, last: int) -> Batch:
    return replace(
        batch,
        pushes=batch.pushes[:, first:last],
        commands={name: values[:, first:last] for name, values in batch.commands.items()},
        steps=last - first,
    )


def _check_bits(engine: Engine, batch: Batch, whole: Played) -> None:
    _require_same(engine, "the same batch, asked again,", _play(engine, batch), whole)
    idle = _play(engine, replace(batch, commands={}))
    _require_same(engine, "the batch without commands, which begin with those values,", idle, whole)
    order = list(range(ROWS))[::-1]
    turned = _play(engine, _rows(batch, order))
    _require_same(engine, "the batch in another order", turned, [part[order] for part in whole])
    for row in range(ROWS):
        alone = _play(engine, _rows(batch, [row]))
        _require_same(engine, f"row {row} alone", alone, [part[[row]] for part in whole])
    first = _play(engine, _steps(batch, 0, EVERY))
    rest = _steps(batch, EVERY, batch.steps)
    rest = replace(rest, states=first[0][:, -1].copy(), memory=first[1])
    then = _play(engine, rest)
    both = [np.concatenate([first[0], then[0]], 1), then[1], np.concatenate([first[2], then[2]], 1)]
    _require_same(engine, "a rollout that is saved and goes on", both, whole)


def _require_same(
    engine: Engine,
    what: str,
    found: Played | list[Numbers],
    wanted: Played | list[Numbers],
    way_out: str = "deterministic = False",
) -> None:
    for name, one, other in zip(PARTS, found, wanted, strict=True):
        if not np.array_equal(one, other):
            off = float(np.nanmax(np.abs(one - other)))
            raise ValueError(
                f"{engine!r}: {what} has other {name}, off by {off:.3g}, expected the same bits: "
                "what a rollout goes on from has to be in its state and memory, or the engine says "
                f"{way_out}"
            )


def _check_work(engine: Engine, problem: Problem, batch: Batch) -> None:
    """The work of each step: its push at the mean of the velocities before and after it."""
    still = _play(engine, replace(batch, pushes=np.zeros_like(batch.pushes)))[2]
    if still.any():
        raise ValueError(
            f"{engine!r}: work is {float(np.abs(still).max()):.3g} J without a push, expected 0"
        )
    states, _, work = _play(engine, replace(batch, every=1))
    path = np.concatenate([batch.states[:, None], states], axis=1)
    objects = [body for body in problem.scene.bodies if body.role == "object"]
    for k, body in enumerate(objects):
        twists = np.array([[_twist(problem, state, body.name) for state in row] for row in path])
        powers = [(batch.pushes[:, :, k] * of).sum(-1) for of in (twists[:, :-1], twists[:, 1:])]
        ends = problem.scene.step * np.sort(powers, axis=0)
        slack = SLACK * np.abs(ends).max() + 1e-12
        if engine.substeps == 1:
            ends = np.repeat(ends.mean(axis=0, keepdims=True), 2, axis=0)
        else:  # whose velocities nobody sees: what the way says, to a substep
            ways = np.array([_ways(problem, row, body.name) for row in path])
            middle, part = (batch.pushes[:, :, k] * ways).sum(-1), np.ptp(ends, axis=0)
            ends = np.stack([middle - part / engine.substeps, middle + part / engine.substeps])
            slack += TURN * np.abs(middle).max()
        low, high = ends[0] - slack, ends[1] + slack
        outside = (work[:, :, k] < low) | (work[:, :, k] > high)
        if outside.any():
            row, step = (int(i) for i in np.argwhere(outside)[0])
            raise ValueError(
                f"{engine!r}: the push on {body.name!r} in step {step} of row {row} works "
                f"{work[row, step, k]:.6g} J, expected {ends[0, row, step]:.6g} to "
                f"{ends[1, row, step]:.6g}, from f . v + tau . omega before and after the step"
            )


def _ways(problem: Problem, states: Numbers, name: str) -> Numbers:
    """By how much a body's centre of mass moves and the body turns from state to state, (m, 6)."""
    from scipy.spatial.transform import Rotation

    places = [_center(problem, state, name) for state in states]
    turns = Rotation.from_quat([turn for _, turn in places])
    moves = np.diff([place for place, _ in places], axis=0)
    return np.concatenate([moves, (turns[1:] * turns[:-1].inv()).as_rotvec()], axis=1)


def _center(problem: Problem, state: Numbers, name: str) -> tuple[Numbers, Numbers]:
    """A body's centre of mass and its orientation."""
    from scipy.spatial.transform import Rotation

    now, scene = problem.scene.unpack(state)[name], problem.scene
    body = next(body for body in scene.bodies if body.name == name)
    center = np.zeros(3) if body.inertial is None else np.array(body.inertial.center)
    turn = np.array(now["orientation"])
    return now["position"] + Rotation.from_quat(turn).apply(center), turn


def _twist(problem: Problem, state: Numbers, name: str) -> Numbers:
    """Velocity and angular velocity of a body at its centre of mass, shape (6,)."""
    now = problem.scene.unpack(state)[name]
    spin = np.array(now["angular_velocity"])
    arm = _center(problem, state, name)[0] - now["position"]
    return np.concatenate([now["velocity"] + np.cross(spin, arm), spin])
