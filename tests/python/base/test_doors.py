"""Another kind of object comes through a public door: an answer, or the argument's name."""

import importlib
import inspect
import re

import numpy as np
import pytest

import energymargin as em
from energymargin.base import doors

PACKAGES = ["", *em.PLAIN, "scenes", "store", "surrogates", "tasks", *em.EXTRAS]
BAD = [None, object(), 5.0, "x", [], {}, em.ForceWeights(), float("nan"), -1]


def public():
    """(name, function) of all public functions, and of the methods of public classes."""
    for package in PACKAGES:
        module = importlib.import_module(f"energymargin.{package}".rstrip("."))
        for name in module.__all__:
            door = getattr(module, name)
            if not str(getattr(door, "__module__", "")).startswith("energymargin"):
                continue
            path = f"{package}.{name}".lstrip(".")
            if inspect.isfunction(door):
                yield path, door
            elif isinstance(door, type) and not issubclass(door, BaseException):
                for method, member in doors.methods(door):
                    yield f"{path}.{method}", getattr(member, "__func__", member)


DOORS = dict(public())


def test_every_package_has_doors_that_name_what_is_wrong():
    plain = [path for path, door in DOORS.items() if not hasattr(door, "__wrapped__")]
    of_core = {f"{name}" for name in vars(em._core) if name in em.__all__}
    of_core.add("Problem.from_mujoco")  # which em.mujoco.problem answers
    assert len(DOORS) > 200 and set(plain) <= of_core


@pytest.mark.parametrize("path", DOORS)
def test_an_argument_of_another_kind_is_named(path):
    """The other arguments are missing, of which Python itself would speak first."""
    door = DOORS[path]
    if not hasattr(door, "__wrapped__"):  # the core checks these, in test_arguments.py
        return
    required = {p.name for p in inspect.signature(door).parameters.values() if p.default is p.empty}
    for name, kind in doors.kinds_of(inspect.unwrap(door))[1].items():
        for bad in BAD:
            if not kind.has(bad) and required - {name, "args", "kwargs", "options", "settings"}:
                with pytest.raises(
                    (TypeError, ValueError), match=rf"^{name} (is|has) .*, expected "
                ):
                    door(**{name: bad})


@pytest.mark.parametrize("progress", [3, 0, ""])
@pytest.mark.parametrize(
    "path",
    [path for path, door in DOORS.items() if "progress" in inspect.signature(door).parameters],
)
def test_a_progress_that_is_no_function_is_refused_before_anything_else(path, progress):
    names = [
        p.name for p in inspect.signature(DOORS[path]).parameters.values() if p.default is p.empty
    ]
    task = em.tasks.make("push", friction=0.3)
    problem = task.problem(task.rollout(3, frames=2).states[1])
    with pytest.raises((TypeError, ValueError), match=r"^progress is .*, expected a function$"):
        DOORS[path](**dict.fromkeys(names, problem), progress=progress)


def knocks():
    """Calls that are right, by the name of what is called."""
    task = em.tasks.make("push")
    trajectory = task.rollout(3)
    problem = task.problem(trajectory.states[1], trajectory.params).replace(horizon=0.3)
    few = {"rollouts": 2, "timeout": 20.0}
    curves = {"values": [np.linspace(1, 0, 9)] * 4, "lost": [np.arange(9) > 6] * 4}
    law = {"observed": ["a.x"], "corrected": ["a.fx"], "gains": [[1.0]], "period": 0.1}
    yield em.Feedback, law
    yield em.score, {"problems": [problem], "metrics": ["force"], "progress": None, "timeout": 20.0}
    yield em.rank, {"problems": {"a": problem, "b": problem}, "metric": "probability", **few}
    yield (
        em.margin_profile,
        {"problem": problem, "plan": None, "every": 0.5, "effort": False, **few},
    )
    yield (
        em.critical_value,
        {"problem_of": lambda _: problem, "quantity": "none", "range": (0.1, 1.0), "draws": 16},
    )
    yield em.longest_step, {"problems": [problem], "error": 0.5, "rollouts": 2}
    yield (
        em.score_belief,
        {"belief": em.Belief(problem, friction=0.05), "metrics": ["probability"], **few},
    )
    yield em.beliefs.Uncertainty.from_json, {"text": em.beliefs.Uncertainty(mass=0.1).to_json()}
    yield em.datasets.generate, {"task": "push", "trajectories": 1, "frames": 2, "progress": None}
    yield em.tasks.make, {"name": "push", "friction": 0.3}
    yield em.monitor.alarms, {**curves, "alarm": em.monitor.Alarm(0.5)}
    yield em.monitor.threshold, {**curves, "false_alarms": 0.1}
    yield em.motions.lift, {"height": 0.1, "duration": 0.1}
    yield em.motions.shake, {"axis": (0, 0, 1), "amplitude": 0.1, "frequency": 20, "duration": 0.1}
    yield em.grasps.ParallelGripper, {"opening": 0.1, "force": 1.0, "pad": (0.02, 0.02)}
    yield em.grasps.Motion, {"kind": "lift", "duration": 0.1, "amount": 0.1}
    yield em.grasps.GraspSet, {"poses": [np.eye(4)], "openings": [0.1], "names": ["a"]}
    yield em.store.add_scores, {"path": "none.db", "dataset": None, "scores": {}, "settings": {}}
    yield em.evaluation.evaluate, {"labelled": None, "frames": (0,)}


@pytest.mark.parametrize(("door", "right"), knocks(), ids=lambda of: getattr(of, "__name__", ""))
def test_a_call_with_one_argument_of_another_kind_answers_or_names_it(door, right):
    for name in right:
        for bad in BAD:
            try:
                door(**{**right, name: bad})
            except (TypeError, ValueError, TimeoutError, em.EnergyMarginError) as error:
                names = "|".join([*right, "uncertainty", "task"])
                assert re.search(rf"\b({names})\b", str(error)), (name, bad, error)
