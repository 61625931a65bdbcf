"""Scores as columns of a LeRobot dataset: a copy of it, with a feature more for each score."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.errors import needs_extra
from energymargin.records import datasets
from energymargin.records.datasets import Dataset
from energymargin.records.recordings import lerobot
from energymargin.records.recordings.cleaning import MOST_REPAIRED
from energymargin.records.store.file import ScoreStore

PREFIX = "energymargin."
SAME_TIME = 1e-5  # s; of times that are kept as floats of 32 bits

Columns = dict[str, NDArray[np.float32]]
"""By name: a score of each frame of an episode, shape (K,)."""


def export_lerobot(
    path: str | os.PathLike[str],
    data: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    run: int | None = None,
) -> list[str]:
    """Copies a LeRobot dataset, with the scores of its frames as features; returns their names.

    A feature is a float a frame, as "energymargin.probability"; of the states as they are, where a
    score over a horizon has the same name, "energymargin.now_effort_est". A frame that was not
    scored, as one that import left out, has NaN; no escape is inf. The copy appears whole or not at
    all. Needs the extra [lerobot].

    Args:
        path: the file of scores.
        data: the dataset that was scored, as `energymargin import` made it of `folder` alone.
        folder: the LeRobot dataset.
        output: the copy's folder, which must not be there.
        run: as of `ScoreStore.run`; with its scores are those of the states as they are beside it.

    Raises FileExistsError if there is something at `output`, ValueError if these files do not
    belong together, and what ScoreStore and `read_lerobot` raise.
    """
    folder, output = Path(folder), Path(output)
    if os.path.lexists(output):
        raise FileExistsError(f"{output} exists, expected the name of a new folder")
    scored = [name for name in lerobot.element_places(folder) if name.startswith(PREFIX)]
    if scored:
        raise ValueError(
            f"{folder} has {scored[0]} already, expected the dataset that was imported"
        )
    with ScoreStore(path) as store, datasets.open(data) as dataset:
        chosen = store.run(run)
        if why := chosen.why_not_of(dataset, str(data), str(path)):
            raise ValueError(why)
        scores = store.scores(chosen)
        named = {PREFIX + metric.replace("/", "_"): own for metric, own in scores.items()}
        episodes = _by_episode(folder, dataset, named)
    part = output.with_name(f".{output.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        shutil.copytree(folder, part)
        for file in lerobot.data_files(part):
            _add_columns(file, episodes)
        _add_features(part / lerobot.INFO, named)
        os.replace(part, output)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return list(named)


def _by_episode(
    folder: Path, dataset: Dataset, scores: Mapping[str, NDArray[np.float64]]
) -> dict[int, Columns]:
    """The scores of each episode's frames: those of the trajectory of the same place, by time."""
    time = lerobot.element_places(folder)[lerobot.TIME]
    frame = (lerobot.FRAME, 0, 1)
    episodes = lerobot.read_episodes(folder, {lerobot.TIME: time, lerobot.FRAME: frame})
    if len(episodes) != len(dataset.trajectories):
        raise ValueError(
            f"{folder} has {len(episodes)} episodes and the dataset {len(dataset.trajectories)} "
            "trajectories, expected as many: is it what was imported?"
        )
    found: dict[int, Columns] = {}
    first = 0
    for (number, own), trajectory in zip(episodes.items(), dataset.trajectories, strict=True):
        at = own[lerobot.TIME].to_numpy()
        if not np.array_equal(own[lerobot.FRAME], np.arange(len(at))):
            raise ValueError(f"episode {number} of {folder} lacks frames, expected 0, 1, 2, ...")
        rows = np.clip(np.searchsorted(at, trajectory.times - SAME_TIME), 0, len(at) - 1)
        same = np.abs(at[rows] - trajectory.times) <= SAME_TIME
        if (~same).mean() > MOST_REPAIRED:
            raise ValueError(
                f"episode {number} of {folder} has other times than its trajectory, expected the "
                "dataset that was imported"
            )
        found[number] = {}
        for name, values in scores.items():
            column = np.full(len(at), np.nan, dtype=np.float32)
            column[rows[same]] = values[first : first + len(same)][same]
            found[number][name] = column
        first += len(same)
    return found


def _add_columns(file: Path, episodes: Mapping[int, Columns]) -> None:
    """Writes a file of frames anew, with its columns and row groups, and the scores beside them."""
    with needs_extra("a LeRobot dataset", "lerobot"):
        import pyarrow
        from pyarrow import parquet
    names = list(next(iter(episodes.values())))
    old = file.with_suffix(".old")
    file.rename(old)
    with parquet.ParquetFile(old) as source:
        schema = source.schema_arrow
        for name in names:
            schema = schema.append(pyarrow.field(name, pyarrow.float32()))
        schema = schema.with_metadata(_told(schema.metadata or {}, names))
        with parquet.ParquetWriter(file, schema) as written:
            for group in range(source.num_row_groups):
                table = source.read_row_group(group)
                numbers, frames = (table[n].to_pylist() for n in (lerobot.EPISODE, lerobot.FRAME))
                rows = list(zip(numbers, frames, strict=True))
                for name in names:
                    column = np.array([episodes[e][name][k] for e, k in rows], dtype=np.float32)
                    table = table.append_column(name, pyarrow.array(column))
                written.write_table(table.cast(schema))
    old.unlink()


def _told(metadata: Mapping[bytes, bytes], names: list[str]) -> dict[bytes, bytes]:
    """A schema's metadata, in which the library datasets has its features, with these."""
    key, told = b"huggingface", dict(metadata)
    if key in told:
        info = json.loads(told[key])
        features = info.setdefault("info", {}).setdefault("features", {})
        features |= {name: {"dtype": "float32", "_type": "Value"} for name in names}
        told[key] = json.dumps(info).encode()
    return told


def _add_features(path: Path, names: Mapping[str, Any]) -> None:
    """Lists these features in meta/info.json."""
    info = json.loads(path.read_text(encoding="utf-8"))
    for name in names:
        info["features"][name] = {"dtype": "float32", "shape": [1], "names": None}
    path.write_text(json.dumps(info, indent=4, ensure_ascii=False), encoding="utf-8")
