"""What a prompt shows of results that hold large arrays: in a few lines, and telling."""

import inspect
import re
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from pkgutil import walk_packages

import numpy as np
import pytest

import energymargin as em
from energymargin import _core
from energymargin.base.reprs import short_repr


@dataclass
class Holder:
    name: str
    values: object
    __repr__ = short_repr


@pytest.mark.parametrize(
    ("values", "text"),
    [
        (np.zeros((10, 26)), "array(10, 26)"),
        ({"capture": np.zeros(3), "seed": 1}, "{'capture': array(3,), 'seed': 1}"),
        ({"capture": {0: 1.0, 1: 2.0}}, "{'capture': {2 float}}"),
        (tuple(range(7)), "[7 int]"),
        ((1, 2), "(1, 2)"),
        ([[1], []], "[2 list]"),
        ({}, "{}"),
        ("a text that is longer than six letters", "'a text that is longer than six letters'"),
    ],
)
def test_an_array_is_told_by_its_shape_and_a_long_list_by_its_length(values, text):
    assert repr(Holder("one", values)) == f"Holder(name='one', values={text})"


def test_a_dataset_says_what_it_is_in_memory_and_in_a_file(tmp_path):
    dataset = em.datasets.generate("topple", trajectories=3, frames=4, seed=1)
    dataset.save(tmp_path / "topple.h5")
    text = (
        "Dataset(task='topple', parameters={'friction': None, 'effector': 'coast'}, seed=1, "
        "trajectories=3, states=12)"
    )
    assert repr(dataset) == text
    with em.datasets.open(tmp_path / "topple.h5") as opened:
        assert repr(opened) == text
    assert repr(opened) == text  # closed
    first = repr(dataset.trajectories[0])
    assert first.startswith("Trajectory(times=array(4,), states=array(4, 39), contacts=[4 list]")
    assert len(first) < 400


def test_a_table_of_scores_is_short():
    problems = em.datasets.generate("topple", trajectories=2, frames=4, seed=1).problems()
    table = em.score(problems, ["force"])
    assert repr(table) == (
        "ScoreTable(index=array(8,), seconds=array(8,), scores={'force': array(8,)}, "
        "steps=array(8,), unconverged=array(8,), lost_time=array(8,), warnings={}, complete=True)"
    )


def test_compiled_things_show_their_numbers_and_no_address():
    scene = em.Scene()
    scene.add_body("o", em.Box((0.1, 0.2, 0.3)), mass=2.0, position=(0, 0, 0.5), role="object")
    shape = "Box(size=(0.1, 0.2, 0.3))"
    assert repr(scene.bodies[0].shape) == shape
    assert repr(scene.bodies[0]).startswith(
        f"Body(name='o', shape={shape}, mass=2.0, position=(0.0, 0.0, 0.5), "
    )
    assert repr(em.mass_properties(em.Box((1, 1, 1)))) == (
        "MassProperties(volume=1.0, center=(0.0, 0.0, 0.0), "
        "moments=(0.166667, 0.166667, 0.166667), axes=(0.0, 0.0, 0.0, 1.0))"
    )
    moved = em.World(scene).simulate(scene.pack(), 9)
    assert repr(moved).startswith(
        "Simulation(times=array(9,), states=array(9, 13), memory=array(9, 0), "
    )
    assert "audit=Audit(...)" in repr(
        em.World(scene).rollout(scene.pack(), np.zeros(6), 0.1, audit=True)
    )


def test_every_compiled_class_with_properties_has_a_text():
    kinds = [kind for kind in vars(_core).values() if inspect.isclass(kind)]
    told = [k for k in kinds if any(isinstance(m, property) for m in vars(k).values())]
    assert len(told) > 30
    assert [k.__name__ for k in told if "__repr__" not in vars(k)] == []


def test_each_object_of_a_probability_shows_its_own():
    scene = em.Scene()
    scene.add_plane("table")
    for name, x in (("a", 0.0), ("b", 0.5)):
        scene.add_body(name, em.Sphere(0.1), mass=1.0, position=(x, 0, 0.1), role="object")
    problem = em.Problem(
        scene,
        scene.pack(),
        force=(1, 1, 0),
        torque=(0, 0, 0),
        duration=0.1,
        captured={name: em.regions.Speed(name, 99.0) for name in ("a", "b")},
        horizon=0.1,
    )
    found = em.capture_probability(problem, rollouts=10, by_object=True)
    assert repr(next(iter(found.by_object.values()))).startswith(
        "Survival(captured=1.0, curve=array(7,), mean_time="
    )


def modules():
    """All of the package but `__main__`."""
    for module in walk_packages(em.__path__, "energymargin."):
        if module.name != "energymargin.__main__":
            yield import_module(module.name)


def test_every_dataclass_with_arrays_is_short():
    kinds = {
        kind
        for module in modules()
        for name, kind in vars(module).items()
        if inspect.isclass(kind) and is_dataclass(kind) and not name.startswith("_")
        if kind.__module__.startswith("energymargin.")
    }
    arrays = re.compile(r"^(?!.*Callable).*\b(NDArray|Vector|Array)\b")
    large = [kind for kind in kinds if any(arrays.search(str(f.type)) for f in fields(kind))]
    assert len(large) > 20
    # What `dataclass` makes itself is wrapped against recursion, and prints every number.
    assert [kind.__qualname__ for kind in large if hasattr(kind.__repr__, "__wrapped__")] == []


def test_a_set_shows_what_it_is_made_of():
    ball, slow = em.regions.Ball("a", (0, 0, 0), radius=1.0), em.regions.Speed("b", 0.1)
    assert repr(ball & ~(slow | ball)) == "Region((Ball('a') & ~(Speed('b') | Ball('a'))))"
