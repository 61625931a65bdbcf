"""What em.mujoco.Engine takes beside MuJoCo alone: `python python/bench/mujoco_engine.py`.

100 rollouts of a second on two threads, and `mujoco.rollout` with the same steps, controls and
pushes in arrays that are there before. Both take turns; times are of the CPU, of all threads.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import cyclopts
import gymnasium_robotics  # type: ignore[import-untyped]
import mujoco
import numpy as np
from mujoco.rollout import Rollout

import energymargin as em
from measurements import in_turns

BOX = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body name="box" pos="0 0 .0499">
<freejoint/><geom type="box" size=".05 .05 .05" mass=".5"/></body></worldbody></mujoco>"""
CART = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body name="cart" pos="0 0 .049">
<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
<joint type="slide" axis="0 0 1"/><joint axis="0 0 1"/>
<geom type="box" size=".05 .05 .05" mass=".5"/></body></worldbody></mujoco>"""
DOOR = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body name="door" pos="0 0 .3">
<joint axis="0 0 1" damping=".01"/><geom type="box" size=".2 .02 .2" pos=".2 0 0" mass="2"/>
<body name="handle" pos=".35 0 0"><joint axis="0 1 0" damping=".01"/>
<geom type="box" size=".05 .01 .01" mass=".2"/></body></body></worldbody></mujoco>"""
BOWL = "libero_bowl/bowl_on_ramekin.xml"
KINDS = mujoco.mjtState
SPEC = KINDS.mjSTATE_CTRL.value | KINDS.mjSTATE_XFRC_APPLIED.value
ROLLOUTS, THREADS = 100, 2


def question(engine: em.mujoco.Engine, body: str, force: float) -> em.Problem:
    """Nothing leaves: all rollouts are whole."""
    room = em.regions.Ball(body, (0, 0, 0), 1e3)
    bounds = {"force": (force, force, 0), "duration": 0.2, "horizon": 1.0}
    return em.engines.problem(engine, captured=room, check=8 * engine.step, **bounds)


def of_mjcf(xml: str, body: str) -> em.Problem:
    """The question about a body of MJCF."""
    model = mujoco.MjModel.from_xml_string(xml)
    return question(em.mujoco.Engine(model, objects=body, threads=THREADS), body, 1.0)


def push() -> em.Problem:
    """The twin of a pushed box and its pusher."""
    problem = em.datasets.generate("push", trajectories=1, frames=10, seed=0).problems()[0]
    model = em.mujoco.model_of(problem.scene, problem.state)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    engine = em.mujoco.Engine(model, data, scene=problem.scene, threads=THREADS)
    return question(engine, "object", 1.0)


def fetch() -> em.Problem:
    """The arm of FetchPush with its block."""
    folder = Path(gymnasium_robotics.__file__).parent / "envs/assets/fetch"
    model = mujoco.MjModel.from_xml_path(str(folder / "push.xml"))
    data = mujoco.MjData(model)
    data.joint("object0:joint").qpos[:3] = 1.3, 0.75, 0.42
    given: dict[str, Any] = {"effector": "robot0:gripper_link", "threads": THREADS}
    return question(em.mujoco.Engine(model, data, objects="object0", **given), "object0", 1.0)


def bowl(folder: Path) -> em.Problem:
    """LIBERO's bowl on its ramekin, 65 boxes."""
    model = mujoco.MjModel.from_xml_path(str(folder / BOWL))
    data = mujoco.MjData(model)
    data.joint("ramekin").qpos[2] = 0.902
    data.joint("bowl").qpos[:3] = np.add(data.joint("ramekin").qpos[:3], [0, 0, 0.034])
    given: dict[str, Any] = {"effector": "ramekin", "threads": THREADS}
    return question(em.mujoco.Engine(model, data, objects="bowl", **given), "bowl", 0.1)


def alone(problem: em.Problem) -> tuple[Callable[[], None], int]:
    """MuJoCo's own rollouts of what the engine is asked, and how many steps they have."""
    engine: Any = problem.scene.engine
    model, play, batches = engine.model, engine.play, []

    def kept(batch: em.engines.Batch) -> Any:
        batches.append((batch.memory.copy(), batch.pushes.copy(), batch.steps))
        return play(batch)

    engine.play = kept
    em.capture_probability(problem, rollouts=ROLLOUTS)
    del engine.play
    pools = {threads: Rollout(nthread=threads) for threads in (0, THREADS)}
    data, calls = [mujoco.MjData(model) for _ in range(THREADS)], []
    for memory, pushes, steps in batches:
        count = len(memory)
        control = np.zeros((count, steps, model.nu + 6 * model.nbody))
        control[:, :, : model.nu] = memory[:, None, engine.columns.controls]
        for number, body in enumerate(engine.objects):
            first = model.nu + 6 * body
            control[:, :, first : first + 6] = pushes[:, :, number]
        threads = THREADS if count > 1 else 0
        start = np.ascontiguousarray(memory[:, engine.columns.physics])
        given = {
            "control_spec": SPEC,
            "skip_checks": True,
            "nstep": steps,
            "initial_warmstart": np.ascontiguousarray(memory[:, engine.columns.warmstart]),
            "state": np.empty((count, steps, start.shape[1])),
            "sensordata": np.empty((count, steps, model.nsensordata)),
        }
        own = data[: max(threads, 1)]
        calls.append(partial(pools[threads].rollout, [model] * count, own, start, control, **given))

    def run() -> None:
        for call in calls:
            call()

    return run, sum(len(memory) * steps for memory, _, steps in batches)


def main(*, real: Path | None = None, rounds: int = 21) -> None:
    """Prints a table.

    Args:
        real: A folder with LIBERO's bowl.
        rounds: Pairs of each scene.
    """
    scenes: dict[str, Callable[[], em.Problem]] = {"a box": partial(of_mjcf, BOX, "box")}
    scenes |= {"a cart on slides and a hinge": partial(of_mjcf, CART, "cart")}
    scenes |= {"a door's handle": partial(of_mjcf, DOOR, "handle")}
    scenes |= {"push": push, "FetchPush": fetch}
    scenes |= {"LIBERO's bowl": partial(bowl, real)} if real else {}
    print(
        "| scene | MuJoCo alone [us a step] | ours / MuJoCo, CPU | pairs from |\n"
        "| --- | ---: | ---: | ---: |"
    )
    for name, made in scenes.items():
        problem = made()
        own, steps = alone(problem)
        ask = partial(em.capture_probability, problem, rollouts=ROLLOUTS)
        ask(), own()
        ours, theirs = in_turns([ask, own], rounds, time.process_time)
        ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
        middle = f"{1e6 * median(theirs) / steps:.2f} | {median(ratios):.2f}"
        print(f"| {name} | {middle} | {min(ratios):.2f} to {max(ratios):.2f} |", flush=True)


if __name__ == "__main__":
    cyclopts.run(main)
