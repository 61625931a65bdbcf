"""What callers may hand over by mistake, and changes of what is right."""

import copy
import math

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

NUMBERS = st.one_of(
    st.floats(), st.floats(-3, 3), st.integers(-3, 3), st.integers(), st.just(10**400)
)
SCALARS = st.one_of(NUMBERS, st.none(), st.booleans(), st.text(), st.binary(), st.complex_numbers())
ARRAYS = arrays.arrays(
    dtype=st.one_of(
        arrays.floating_dtypes(), arrays.integer_dtypes(), arrays.boolean_dtypes(), st.just("U3")
    ),
    shape=arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
ANYTHING = st.recursive(
    st.one_of(SCALARS, ARRAYS, st.builds(object), st.just([float("nan")] * 3)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=4).map(tuple),
        st.dictionaries(st.text(max_size=8), inner, max_size=3),
    ),
    max_leaves=6,
)
VECTORS = st.lists(NUMBERS, min_size=3, max_size=3)

JSON = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-3, 3),
        st.integers(),
        st.floats(allow_nan=False, allow_infinity=False),
        st.sampled_from(["inf", "-inf", "box", "cup", "tip", "table", "hinge", "object"]),
        st.text(),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=6,
)


def places(value, path=()):
    """The path of each value in a structure of dicts and lists."""
    yield path
    if isinstance(value, (dict, list)):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(inner, (*path, key))


@st.composite
def changed(draw, value):
    """A structure of dicts and lists with something else at a place or two, or nothing there."""
    value = copy.deepcopy(value)
    for _ in range(draw(st.integers(1, 2))):
        *path, last = draw(st.sampled_from([place for place in places(value) if place]))
        inside = value
        for key in path:
            inside = inside[key]
        if draw(st.integers(0, 3)) == 0:
            del inside[last]
        elif isinstance(inside[last], float) and draw(st.booleans()):
            inside[last] *= draw(st.sampled_from([-1, 0, 0.1, 10, 1e3, 1e10, 1e100, 1e-10, 1e-160]))
        else:
            inside[last] = draw(JSON)
    return value


@st.composite
def damaged(draw, data):
    """Bytes with some others among them, or cut short."""
    data = bytearray(data)
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data) - 1))
        new = draw(st.binary(min_size=1, max_size=8))
        data[start : start + len(new)] = new
    return bytes(data[: draw(st.one_of(st.just(len(data)), st.integers(0, len(data))))])


def finite(*values):
    return all(math.isfinite(number) for value in values for number in np.ravel(value))
