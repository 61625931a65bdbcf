"""The bits of an engine: eight digits that change as soon as a score of a task does, in
its first four decimals.

Releases say by their version since when the same settings give the same bits. Between two releases
the physics may move; so a page of results has these digits too, of the engine that made it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from functools import cache
from hashlib import sha256

from energymargin import tasks
from energymargin._core import Problem, capture_score, escape_effort, force_score
from energymargin.base.plausibility import PlausibilityWarning

__all__ = ["bits", "engine_bits"]

# (seed, frame) of a state of each task of which the scores have something to say.
MOMENTS = {
    "balance": (8, 4),
    "grasp": (8, 5),
    "push": (9, 2),
    "push-multi": (7, 0),
    "scoop": (8, 5),
    "topple": (9, 3),
}
NODES = 30
DECIMALS = 4  # so that what is rounded otherwise in a last digit is no other engine


@cache
def bits(*, improved: bool = False) -> str:
    """Digits of the physics and the published search; with `improved` of the improved one too.

    They take a second, and are the same in every process and on every thread.
    """
    return _digits(value for one in _problems() for value in _scores(one, improved=improved))


@cache
def engine_bits(engine: str) -> str:
    """Digits of an engine that is not ours: of the scores with "bullet", of a tenth of a second of
    "mujoco". Raises ImportError without MuJoCo."""
    if engine == "mujoco":
        return _digits(value for one in _problems() for value in _end_in_mujoco(one))
    others = (one.with_engine(engine) for one in _problems())
    return _digits(value for one in others for value in _scores(one))


def _digits(values: Iterable[float]) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)
        words = " ".join(f"{round(value, DECIMALS) + 0.0}" for value in values)
    return sha256(words.encode()).hexdigest()[:8]


def _problems() -> Iterator[Problem]:
    for name, (seed, frame) in MOMENTS.items():
        task = tasks.make(name)
        ran = task.rollout(seed=seed)
        yield task.problem(ran.states[frame], ran.params, ran.contacts[frame])


def _scores(problem: Problem, *, improved: bool = False) -> Iterator[float]:
    capture = capture_score(problem, nodes=NODES, warn=False)
    yield from problem.state.tolist()
    yield from (capture.capture, capture.success or 0.0, force_score(problem).force)
    yield escape_effort(problem, nodes=NODES, search="published").effort
    if improved:
        yield escape_effort(problem, nodes=NODES).effort


def _end_in_mujoco(problem: Problem) -> list[float]:
    import mujoco

    from energymargin.mujoco import model_of

    model = model_of(problem.scene, problem.state)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, round(0.1 / model.opt.timestep))
    end: list[float] = data.qpos.tolist()
    return end
