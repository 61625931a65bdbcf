"""Trajectories in flat columns, as a file of version 3 has them, and back.

A block has consecutive trajectories: a row for each, with how many entries of each column are its
own, and the columns, in which those entries follow one another. So a million states are a few
arrays.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import Contact
from energymargin.base.aliases import Ints
from energymargin.base.checks import check_type, whole_number
from energymargin.base.reprs import Record
from energymargin.tasks.trajectories import Trajectory

ROW = np.dtype(
    [
        ("frames", "<i8"),  # K
        ("width", "<i8"),  # n, the length of its state vectors
        ("contact_count", "<i8"),  # of all its frames
        ("params_bytes", "<i8"),  # of their JSON
        ("seed", "<i8"),
        ("success", "?"),
        ("success_any", "i1"),  # NO_LABEL where there is one set for all objects
    ]
)
"""The type of a row: what a trajectory has once."""

CONTACT = np.dtype(
    [
        ("body_a", "<u4"),  # its number in the table of the bodies' names
        ("body_b", "<u4"),
        ("position", "<f8", (3,)),
        ("normal", "<f8", (3,)),
        ("distance", "<f8"),
        ("normal_force", "<f8"),
        ("tangential_force", "<f8", (3,)),
        ("friction", "<f8"),
    ]
)
CONTACT_NUMBERS = (CONTACT.names or ())[2:]

COLUMNS = {
    "times": ("frames", np.dtype("<f8")),
    "captured": ("frames", np.dtype("?")),
    "captured_any": ("frames", np.dtype("i1")),  # NO_LABEL as above
    "contact_counts": ("frames", np.dtype("<i8")),
    "states": ("values", np.dtype("<f8")),  # frame by frame
    "contacts": ("contact_count", CONTACT),
    "params": ("params_bytes", np.dtype("u1")),  # JSON texts, in UTF-8
}
"""The columns: what counts the entries of a trajectory in it, and its type."""

NO_LABEL = -1
BLOCK_STATES = 4096  # a few MB, beside which the overhead of a block is small


@dataclass(frozen=True, eq=False, repr=False)
class Block(Record):
    """Consecutive trajectories."""

    rows: NDArray[np.void]
    """A row for each trajectory, shape (T,), type ROW."""
    columns: Mapping[str, NDArray[Any]]
    """By name, as in COLUMNS."""
    bodies: Sequence[str]
    """Names, by the numbers in the contacts."""

    def __len__(self) -> int:
        """T, the number of trajectories."""
        return len(self.rows)

    @cached_property
    def starts(self) -> dict[str, Ints]:
        """Where each trajectory begins in the columns, by what counts their entries."""
        return starts(self.rows)

    def trajectory(self, index: int) -> Trajectory:
        """One trajectory. Raises ValueError if its entries do not fit together."""
        row = self.rows[index]
        columns = between(self.columns, self.starts, index, index + 1)
        params = json.loads(columns["params"].tobytes())
        check_type("params", params, dict, "a table of numbers by their names")
        absent = columns["captured_any"] == NO_LABEL
        if absent.any() and not absent.all():
            raise ValueError("some of its frames have a label of at least one object, others none")
        states = columns["states"].reshape(row["frames"], row["width"])
        contacts = _Contacts(columns["contacts"], columns["contact_counts"], self.bodies)
        frames = columns["times"], states, contacts, columns["captured"]
        some = None if absent.any() else columns["captured_any"].astype(bool)
        any_end = None if row["success_any"] == NO_LABEL else bool(row["success_any"])
        return Trajectory(*frames, bool(row["success"]), params, int(row["seed"]), some, any_end)

    def check(self) -> None:
        """Raises ValueError unless the entries fit together."""
        counts, contacts = self.columns["contact_counts"], self.columns["contacts"]
        sums = np.diff(np.concatenate([[0], np.cumsum(counts)])[self.starts["frames"]])
        if (counts < 0).any() or (sums != self.rows["contact_count"]).any():
            raise ValueError("the contacts of its frames are not as many as of its trajectories")
        for name in ("body_a", "body_b"):
            if len(contacts) and contacts[name].max() >= len(self.bodies):
                raise ValueError(f"a contact is of body {contacts[name].max()}, which has no name")
        check_labels(self.columns["captured_any"])


def starts(rows: NDArray[np.void]) -> dict[str, Ints]:
    """Where each of T trajectories begins in a column, and the end; shape (T + 1,)."""
    counts = {name: rows[name] for name in ("frames", "contact_count", "params_bytes")}
    counts["values"] = rows["frames"] * rows["width"]
    return {name: np.concatenate([[0], np.cumsum(count)]) for name, count in counts.items()}


def between(
    columns: Mapping[str, Any], starts: Mapping[str, Ints], first: int, last: int
) -> dict[str, Any]:
    """The entries of the trajectories from the first on, before the last, in each column."""
    counters = {name: counter for name, (counter, _) in COLUMNS.items()}
    return {n: columns[n][starts[c][first] : starts[c][last]] for n, c in counters.items()}


def cuts(frames: Ints) -> list[int]:
    """Where trajectories of so many frames are cut into blocks: the first of each, and the end.

    A block ends with the trajectory that fills it, so that the cuts depend on what is cut alone.
    """
    ends = np.cumsum(frames)
    found = [0]
    while found[-1] < len(ends):
        before = ends[found[-1] - 1] if found[-1] else 0
        found.append(min(int(np.searchsorted(ends, before + BLOCK_STATES)) + 1, len(ends)))
    return found


def check_labels(labels: NDArray[np.int8]) -> None:
    """Raises ValueError on a label that is none."""
    if not np.isin(labels, (NO_LABEL, 0, 1)).all():
        raise ValueError("a label of at least one object is neither there nor absent")


class BodyNumbers(dict[str, int]):
    """Numbers of bodies by their names, in the order of their first contacts.

    That order depends on the contacts alone, not on the blocks in which they come.
    """

    def renumbered(self, block: Block) -> NDArray[np.void]:
        """A block's contacts with these numbers; names that lack one get it."""
        contacts = block.columns["contacts"]
        pairs = np.stack([contacts["body_a"], contacts["body_b"]], axis=1)
        used, first = np.unique(pairs, return_index=True)
        order = used[np.argsort(first)].tolist()
        numbers = np.zeros(len(block.bodies), dtype=np.uint32)
        for old in order:
            numbers[old] = self.setdefault(block.bodies[old], len(self))
        if (numbers[used] == used).all():
            return contacts
        renumbered = contacts.copy()
        renumbered["body_a"], renumbered["body_b"] = numbers[pairs[:, 0]], numbers[pairs[:, 1]]
        return renumbered


def as_block(trajectories: Sequence[Trajectory]) -> Block:
    """A block of these trajectories. Raises ValueError on a seed of more than 64 bits."""
    bodies: dict[str, int] = {}
    entries, rows = [], []
    for one in trajectories:
        entries.append(own := _entries(one, bodies))
        seed = whole_number("seed", one.seed, -(2**63), 2**63 - 1)
        counts = *np.shape(one.states), len(own["contacts"]), len(own["params"])
        any_end = NO_LABEL if one.success_any is None else one.success_any
        rows.append((*counts, seed, one.success, any_end))
    joined = {
        name: np.concatenate([np.zeros(0, kind), *(own[name] for own in entries)])
        for name, (_, kind) in COLUMNS.items()
    }
    return Block(np.array(rows, dtype=ROW), joined, list(bodies))


def _entries(one: Trajectory, bodies: dict[str, int]) -> dict[str, NDArray[Any]]:
    """What a trajectory has in each column; bodies have their numbers in `bodies`, which gets new
    names."""
    some = np.full(len(one), NO_LABEL) if one.captured_any is None else one.captured_any
    params = json.dumps(one.params, sort_keys=True, default=float).encode()
    contacts, counts = _contact_columns(one.contacts, bodies)
    found = {
        "times": one.times,
        "captured": one.captured,
        "captured_any": some,
        "contact_counts": counts,
        "states": np.ravel(one.states),
        "contacts": contacts,
        "params": np.frombuffer(params, np.uint8),
    }
    return {name: np.asarray(found[name], kind) for name, (_, kind) in COLUMNS.items()}


def as_blocks(trajectories: Iterable[Trajectory]) -> Iterator[Block]:
    """All trajectories, block by block, cut as by `cuts`."""
    waiting, frames = [], 0
    for trajectory in trajectories:
        waiting.append(trajectory)
        frames += len(trajectory)
        if frames >= BLOCK_STATES:
            yield as_block(waiting)
            waiting, frames = [], 0
    if waiting:
        yield as_block(waiting)


class _Contacts(Sequence[list[Contact]]):
    """The contacts of recorded frames, made when a frame is asked for."""

    def __init__(self, rows: NDArray[np.void], counts: Ints, bodies: Sequence[str]) -> None:
        self.rows, self.counts, self.bodies = rows, counts, bodies
        self._ends = np.cumsum(counts).tolist()

    def __len__(self) -> int:
        return len(self.counts)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        frame = range(len(self))[index]
        first = self._ends[frame - 1] if frame else 0
        names, found = self.bodies, []
        for a, b, *values in self.rows[first : self._ends[frame]].tolist():
            numbers = dict(zip(CONTACT_NUMBERS, values, strict=True))
            found.append(Contact(body_a=names[a], body_b=names[b], **numbers))
        return found


def _contact_columns(
    contacts: Sequence[Sequence[Contact]], bodies: dict[str, int]
) -> tuple[NDArray[np.void], Ints]:
    """The contacts of all frames, and how many each has; bodies have their numbers in `bodies`,
    which gets new names."""
    if isinstance(contacts, _Contacts):
        numbers = [bodies.setdefault(name, len(bodies)) for name in contacts.bodies]
        rows = contacts.rows.copy()
        for name in ("body_a", "body_b"):
            rows[name] = np.array(numbers, dtype=np.uint32)[rows[name]] if len(rows) else 0
        return rows, contacts.counts
    entries = []
    for contact in chain.from_iterable(contacts):
        pair = (bodies.setdefault(n, len(bodies)) for n in (contact.body_a, contact.body_b))
        entries.append((*pair, *(getattr(contact, name) for name in CONTACT_NUMBERS)))
    return np.array(entries, dtype=CONTACT), np.array([len(frame) for frame in contacts], np.int64)
