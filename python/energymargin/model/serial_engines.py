"""An engine of a simulator that has one state at a time: it is saved, restored and stepped."""

from __future__ import annotations

from abc import abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Mapping
from hashlib import blake2b
from typing import Any, NamedTuple

import numpy as np

from energymargin.base.aliases import Floats
from energymargin.model.engines import Batch, Engine

MOST = 1000
LONGER = 100
KEY = 2  # numbers that name a saved state
HALF = 6  # bytes of each: a double holds them exactly


class Recipe(NamedTuple):
    """How a state came about."""

    parent: bytes | None
    """Key of the state before; None: it was put there."""
    state: Floats
    """Of the scene, shape (d,), if it was put there."""
    pushes: Floats
    """In the steps from the parent on, shape (steps, k, 6)."""
    commands: Floats
    """Likewise, shape (steps, m)."""


class Handles:
    """Saved states of a simulator that are no numbers, by keys of two numbers.

    A key is a hash of how the state came about, so a rollout has the same keys in any batch. At
    most `most` are kept: the one that was used longest ago is released, and made again if it is
    asked for. How states came about is known of `most` times LONGER.
    """

    def __init__(self, most: int, release: Callable[[Any], None]) -> None:
        """`release`: called with each saved state that is not kept any longer."""
        self.most, self._release = most, release
        self._saved: OrderedDict[bytes, Any] = OrderedDict()
        self._recipes: OrderedDict[bytes, Recipe] = OrderedDict()

    def __len__(self) -> int:
        """Number of states that are kept."""
        return len(self._saved)

    def keep(self, key: bytes, saved: Any, recipe: Recipe | None = None) -> None:
        """Keeps a state, and how it came about if that is new."""
        if key in self._saved:
            self._release(self._saved.pop(key))
        self._saved[key] = saved
        if recipe is not None:
            self._recipes[key] = recipe
        while len(self._saved) > self.most:
            self._release(self._saved.popitem(last=False)[1])
        while len(self._recipes) > LONGER * self.most:
            self._recipes.popitem(last=False)

    def way_to(self, key: bytes) -> tuple[Any, list[Recipe]]:
        """The nearest saved state on the way to one, None if there is none, and the recipes from
        there on. Raises RuntimeError if the way is not known any more."""
        way: list[Recipe] = []
        at: bytes | None = key
        while at is not None and at not in self._saved:
            if at not in self._recipes:
                raise RuntimeError(
                    f"a saved state was released, since there were more than {LONGER * self.most}: "
                    "expected handles of a larger `most`, or fewer nodes or rollouts at a time"
                )
            way.append(self._recipes[at])
            at = way[-1].parent
        if at is None:
            return None, way[::-1]
        self._saved.move_to_end(at)
        return self._saved[at], way[::-1]


def key_of(*parts: bytes) -> Floats:
    """The key, shape (2,), of a state that came about by some bytes."""
    hashed = blake2b(b"".join(parts), digest_size=KEY * HALF).digest()
    halves = (hashed[:HALF], hashed[HALF:])
    return np.array([float(int.from_bytes(half, "little")) for half in halves])


class Serial(Engine):
    """An engine whose simulator has one state at a time.

    It is asked to `put` a state of the scene, or to `restore` what it has saved, and then to
    `advance` step by step. `save` returns numbers, `saved` of them, or with `saved = None` anything
    else, a handle: at most `most` of them are kept here, and those that were released are simulated
    again. A handle is not known in another process, where rollouts begin at states of the scene.
    """

    saved: int | None = None
    """How many numbers `save` returns; None: it returns a handle."""
    most: int = MOST
    """Handles that are kept at most."""
    observed: int = 0
    """How many numbers `observe` returns. They are the last ones of the memory, which policies see
    behind the states."""

    @abstractmethod
    def put(self, state: Floats) -> None:
        """Goes to a state of the scene, shape (d,), that is set from outside."""

    @abstractmethod
    def save(self) -> Any:
        """All that the simulator goes on from."""

    @abstractmethod
    def restore(self, saved: Any) -> None:
        """Goes back to what was saved."""

    @abstractmethod
    def advance(self, pushes: Floats, commands: Mapping[str, float]) -> None:
        """One step under wrenches, shape (k, 6), and all commands."""

    @abstractmethod
    def read(self) -> Floats:
        """The state of the scene, shape (d,)."""

    @abstractmethod
    def bodies(self) -> Floats:
        """Position of the centre of mass, orientation x, y, z, w, velocity and angular velocity of
        each object, along the world's axes, shape (k, 13)."""

    def observe(self) -> Floats:
        """What a policy sees besides, shape (`observed`,)."""
        return np.zeros(0)

    def release(self, saved: Any) -> None:
        """Called with each handle that is kept no longer."""

    @property
    def handles(self) -> Handles:
        """Those that are kept."""
        if not hasattr(self, "_handles"):
            self._handles = Handles(self.most, self.release)
        return self._handles

    @property
    def memory(self) -> int:  # type: ignore[override]
        """Numbers behind the scene's: what was saved or its key, commands, and what is observed."""
        return (KEY if self.saved is None else self.saved) + len(self.commands) + self.observed

    def start(self, states: Floats) -> Floats:
        """As the base class says."""
        memory, rows = np.empty((len(states), self.memory)), np.ascontiguousarray(states)
        none = np.zeros((0, 0, 6)), np.zeros((0, len(self.commands)))
        for row, state in zip(memory, rows, strict=True):
            self.put(state)
            recipe = Recipe(None, state.copy(), *none)
            self._remember(row, key_of(state.tobytes()), dict(self.commands), recipe)
        return memory

    def play(self, batch: Batch) -> tuple[Floats, Floats, Floats]:
        """As the base class says, one row after the other."""
        count, steps, objects = batch.pushes.shape[:3]
        states = np.empty((count, steps // batch.every, batch.states.shape[1]))
        memory, work = batch.memory.copy(), np.zeros((count, steps, objects))
        for row in range(count):
            self._play_row(batch, row, states[row], memory[row], work[row])
        return states, memory, work

    def _play_row(
        self, batch: Batch, row: int, states: Floats, memory: Floats, work: Floats
    ) -> None:
        parent, commands = self._recall(memory)
        key, before = parent, self.bodies()
        given = np.empty((batch.steps, len(commands)))
        for step, pushes in enumerate(batch.pushes[row]):
            commands |= {name: float(v[row, step]) for name, v in batch.commands.items()}
            given[step] = list(commands.values())
            self.advance(pushes, commands)
            key = key_of(key.tobytes(), pushes.tobytes(), given[step].tobytes())
            after = self.bodies()
            work[step] = self._work(pushes, before, after)
            before = after
            if (step + 1) % batch.every == 0:
                states[(step + 1) // batch.every - 1] = self.read()
            if not np.isfinite(after).all():
                states[step // batch.every :] = memory[:] = np.nan
                return
        recipe = Recipe(parent.tobytes(), np.zeros(0), batch.pushes[row].copy(), given)
        self._remember(memory, key, commands, recipe)

    def _remember(
        self, memory: Floats, key: Floats, commands: Mapping[str, float], recipe: Recipe
    ) -> None:
        """Writes down where the simulator is."""
        saved = self.save()
        if self.saved is None:
            self.handles.keep(key.tobytes(), saved, recipe)
            saved = key
        memory[:] = np.concatenate([saved, list(commands.values()), self.observe()])

    def _recall(self, memory: Floats) -> tuple[Floats, dict[str, float]]:
        """Goes there: the key, and the commands."""
        size = KEY if self.saved is None else self.saved
        key = memory[:size].copy()
        if self.saved is None:
            self._go_back(key.tobytes())
        else:
            self.restore(key)
        return key, dict(zip(self.commands, memory[size:].tolist(), strict=False))

    def _go_back(self, key: bytes) -> None:
        """To a saved state; one that was released is made again."""
        saved, way = self.handles.way_to(key)
        if saved is not None:
            self.restore(saved)
        for recipe in way:
            if recipe.parent is None:
                self.put(recipe.state)
            for pushes, values in zip(recipe.pushes, recipe.commands, strict=True):
                self.advance(pushes, dict(zip(self.commands, values.tolist(), strict=True)))
        if way:
            self.handles.keep(key, self.save())

    def _work(self, pushes: Floats, before: Floats, after: Floats) -> Floats:
        """Sum over the substeps at the means of the velocities before and after each."""
        twists = before[:, 7:], after[:, 7:]
        if self.substeps == 1:
            moves = self.step * (twists[0] + twists[1]) / 2
        else:  # an implicit step ends where its last velocity leads
            moves = ways(before, after) - self.step / self.substeps * (twists[1] - twists[0]) / 2
        return np.asarray((pushes * moves).sum(axis=1))


def ways(before: Floats, after: Floats) -> Floats:
    """By how much centres of mass move and bodies turn from rows (n, 13) to others, as those of
    `Serial.bodies`, shape (n, 6)."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(after[:, 3:7]) * Rotation.from_quat(before[:, 3:7]).inv()
    return np.concatenate([after[:, :3] - before[:, :3], turns.as_rotvec()], axis=1)
