"""What a prompt shows of results that hold large arrays: in a few lines, and telling."""

from dataclasses import dataclass

import numpy as np
import pytest

import energymargin as em
from energymargin.reprs import short_repr


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
