"""Fingerprints of a dataset: of all that can change a score or a label, whatever the file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from typing import Any

import numpy as np

from energymargin._core import Contact
from energymargin.datasets.columns import COLUMNS, ROW, Block, Bodies
from energymargin.tasks.base import Trajectory

__all__ = ["digest", "digest_of_version_2"]

# A seed tells where a trajectory is from, and changes none of its numbers.
_HASHED = [name for name in (*(ROW.names or ()), *COLUMNS) if name != "seed"]


def digest(task: str, parameters: dict[str, Any], blocks: Iterable[Block]) -> str:
    """Of trajectories in any blocks: each column is a stream of bytes of its own."""
    streams = {name: hashlib.sha256() for name in _HASHED}
    bodies = Bodies()
    for block in blocks:
        columns = {**block.columns, "contacts": bodies.renumbered(block)}
        for name, stream in streams.items():
            column = columns[name] if name in columns else block.rows[name]
            stream.update(np.ascontiguousarray(column).data.cast("B"))
    parts = {name: stream.hexdigest() for name, stream in streams.items()}
    text = json.dumps([task, parameters, bodies.names, parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def digest_of_version_2(
    task: str, parameters: dict[str, Any], trajectories: Iterable[Trajectory]
) -> str:
    """The one of the formats 1 and 2, by which older files of scores name their dataset."""
    sha = hashlib.sha256()
    sha.update(json.dumps([task, parameters], sort_keys=True).encode())
    for trajectory in trajectories:
        sha.update(json.dumps([trajectory.params, trajectory.success], sort_keys=True).encode())
        sha.update(repr([_contact(c) for frame in trajectory.contacts for c in frame]).encode())
        arrays = [trajectory.times, trajectory.states, trajectory.captured]
        if trajectory.captured_any is not None:
            arrays.append(trajectory.captured_any)
        if trajectory.success_any is not None:
            arrays.append(np.array(trajectory.success_any))
        for array in arrays:
            sha.update(f"{array.shape}".encode() + np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()


def _contact(contact: Contact) -> tuple[Any, ...]:
    return (
        0,
        contact.body_a,
        contact.body_b,
        tuple(np.asarray(contact.position).tolist()),
        tuple(np.asarray(contact.normal).tolist()),
        float(contact.distance),
        float(contact.normal_force),
        tuple(np.asarray(contact.tangential_force).tolist()),
        float(contact.friction),
    )
