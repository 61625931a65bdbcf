"""Writes a dataset as they were before: format version 2, a group for each trajectory."""

import json

import h5py
import numpy as np

CONTACT = np.dtype(
    [
        ("frame", "<i8"),
        ("body_a", h5py.string_dtype()),
        ("body_b", h5py.string_dtype()),
        ("position", "<f8", (3,)),
        ("normal", "<f8", (3,)),
        ("distance", "<f8"),
        ("normal_force", "<f8"),
        ("tangential_force", "<f8", (3,)),
        ("friction", "<f8"),
    ]
)


def write_version_2(dataset, path):
    with h5py.File(path, "w") as file:
        file.attrs.update(
            format="energymargin dataset",
            version=2,
            task=dataset.task,
            parameters=json.dumps(dataset.parameters),
            seed=dataset.seed,
            count=len(dataset.trajectories),
        )
        for index, trajectory in enumerate(dataset.trajectories):
            _write(file.create_group(f"trajectories/{index:04d}"), trajectory)


def _write(group, trajectory):
    group.attrs.update(
        success=trajectory.success, seed=trajectory.seed, params=json.dumps(trajectory.params)
    )
    for name in ("times", "states", "captured"):
        group[name] = getattr(trajectory, name)
    if trajectory.captured_any is not None:
        group["captured_any"] = trajectory.captured_any
        group.attrs["success_any"] = trajectory.success_any
    rows = [_row(k, c) for k, frame in enumerate(trajectory.contacts) for c in frame]
    group.create_dataset("contacts", data=np.array(rows, dtype=CONTACT))


def _row(frame, contact):
    return (frame, *(getattr(contact, name) for name in CONTACT.names[1:]))
