import numpy as np
import pytest

import energymargin as em
from energymargin.scenes import moved_apart


def scene(gap):
    """A ball between two walls, whose faces are `gap` apart, over a table."""
    made = em.Scene()
    made.add_plane("table")
    for side, name in ((-1, "left"), (1, "right")):
        made.add_body(
            name, em.Box((0.1, 1, 0.2)), mass=0, position=(side * (gap / 2 + 0.05), 0, 0.1)
        )
    made.add_body("ball", em.Sphere(0.05), mass=0.1, position=(0, 0, 0.05), role="object")
    return made


def test_a_body_that_overlaps_another_is_moved_until_they_touch_and_nothing_else_changes():
    world = em.World(scene(gap=0.2))
    state = world.scene.pack(ball={"position": (0.07, 0.3, 0.05), "velocity": (0.1, 0, 0)})
    moved = moved_apart(world, state, ["ball"])
    assert world.distance(moved, "ball", "right") == pytest.approx(0, abs=1e-4)
    x = world.scene.slice("ball").start
    assert np.flatnonzero(~np.isclose(moved, state, rtol=0, atol=1e-6)).tolist() == [x]


def test_a_body_that_overlaps_nothing_stays_also_where_it_is_sunk_into_the_ground():
    world = em.World(scene(gap=0.2))
    state = world.scene.pack(ball={"position": (0, 0, 0.04)})
    assert np.array_equal(moved_apart(world, state, ["ball"]), state)


def test_a_body_with_no_room_is_refused():
    world = em.World(scene(gap=0.08))
    with pytest.raises(ValueError, match=r"'ball' overlaps others by 0\.02 m, wherever"):
        moved_apart(world, world.scene.pack(), ["ball"])


@pytest.mark.parametrize(
    ("bodies", "directions", "message"),
    [
        (["left"], (1, 1, 0), "'left' is fixed or a link, expected a free one"),
        (["cube"], (1, 1, 0), "cube"),
        (["ball"], (1, 2, 0), r"directions is \[1, 2, 0\], expected three numbers, 0 or 1"),
    ],
)
def test_wrong_arguments_are_named(bodies, directions, message):
    world = em.World(scene(gap=0.2))
    with pytest.raises(ValueError, match=message):
        moved_apart(world, world.scene.pack(), bodies, directions=directions)
