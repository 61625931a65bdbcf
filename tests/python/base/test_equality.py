"""Records compare and hash without an error, whatever they hold."""

import builtins
import dataclasses
import importlib
import inspect
import pkgutil
import sys
import types
import typing
from collections import abc

import numpy as np
import pytest

import energymargin as em
import energymargin_paper

HELD = (np.ndarray, list, dict, set, abc.Mapping, abc.Sequence)


class Names(dict):
    """The names of a module; what it imports for type checkers alone is Any."""

    def __missing__(self, name):
        if hasattr(builtins, name):
            raise KeyError(name)
        return typing.Any


def records():
    """All dataclasses of the package and of its studies."""
    for package in (em, energymargin_paper):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith("__main__"):
                module = importlib.import_module(found.name)
                for kind in vars(module).values():
                    record = isinstance(kind, type) and dataclasses.is_dataclass(kind)
                    if record and kind.__module__ == found.name:
                        yield kind


RECORDS = sorted(set(records()), key=lambda kind: (kind.__module__, kind.__qualname__))


def type_of(kind, field):
    owner = next(c for c in kind.__mro__ if field.name in inspect.get_annotations(c))
    names = Names(vars(sys.modules[owner.__module__]))
    return eval(field.type, {}, names) if isinstance(field.type, str) else field.type


def sample(annotation):
    """A value of a type: what can be changed has an array in it."""
    origin = typing.get_origin(annotation) or annotation
    parts = [part for part in typing.get_args(annotation) if part is not Ellipsis]
    if origin in (typing.Union, types.UnionType, tuple):
        values = [sample(part) for part in parts]
        held = [value for value in values if isinstance(value, (np.ndarray, list, dict, tuple))]
        return tuple(values) if origin is tuple else [*held, *values][0]
    if origin is np.ndarray:
        return np.array([1.0, np.nan])
    if origin in (dict, abc.Mapping):
        return {"a": sample(parts[1])}
    if origin in HELD:
        return [sample(part) for part in parts]
    return None if origin is typing.Any else 0.5


def made(kind):
    """A record with a sample of each field's type."""
    record = object.__new__(kind)
    for field in dataclasses.fields(kind):
        object.__setattr__(record, field.name, sample(type_of(kind, field)))
    return record


@pytest.mark.parametrize("kind", RECORDS, ids=lambda kind: f"{kind.__module__}.{kind.__name__}")
def test_a_record_compares_and_hashes_whatever_it_holds(kind):
    one, other = made(kind), made(kind)
    same = one
    assert one == same and (one == other) in (True, False)
    assert len({one, same}) == 1


def test_there_are_records_of_values_and_of_arrays():
    assert len(RECORDS) > 100
    assert em.SearchSettings(nodes=5) == em.SearchSettings(nodes=5) != em.SearchSettings(nodes=6)
    one, other = (em.tasks.make("topple").rollout(seed=0) for _ in range(2))
    assert one in [one] and one != other and len({one, other, one}) == 2
    assert np.array_equal(one.states, other.states)
