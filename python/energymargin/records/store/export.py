"""The scores of a store as a table: a data frame, CSV, or Parquet; and as columns of a LeRobot
dataset: a copy of it, with a feature more for each score. A row of a table is a state of a run.

The curves of probabilities are a table of their own: a row is a time of a curve.
"""

from __future__ import annotations

import csv
import errno
import json
import math
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin.base.aliases import AnyPath, Floats
from energymargin.base.errors import needs_extra
from energymargin.base.replacing import replaced, require_suffix
from energymargin.records import datasets
from energymargin.records.datasets import Dataset
from energymargin.records.recordings import lerobot
from energymargin.records.recordings.cleaning import MOST_REPAIRED
from energymargin.records.recordings.formats import INFO
from energymargin.records.store.file import ScoreStore
from energymargin.records.store.run import Run

if TYPE_CHECKING:
    import pandas as pd

SUFFIXES = (".csv", ".parquet")
QUANTILES = (0.1, 0.5, 0.9)  # of the particles of a belief

OF_LABELS = ("captured", "succeeded", "captured_any", "succeeded_any")
OF_STATE = ("trajectory", "frame", *OF_LABELS, "seconds")  # a ScoredState's but for its scores
OF_PANDAS = {int: "int64", bool: "boolean", float: "float64", str: "str"}

Kinds = dict[str, type]
"""By column: the type of its values. They may be missing, as None."""
Table = tuple[Kinds, Iterator[tuple[Any, ...]]]
"""Columns, and rows of their values."""
PREFIX = "energymargin."
SAME_TIME = 1e-5  # s; of times that are kept as floats of 32 bits
Columns = dict[str, NDArray[np.float32]]
"""By name: a score of each frame of an episode, shape (K,)."""


def load(path: AnyPath, *, run: int | None = None) -> pd.DataFrame:
    """All scores of a store, or those of one run, with the states' labels and the settings.

    A row is a state of a run, so two runs give a state two rows: its `run`, `task`, `trajectory`,
    `frame`; the labels `captured`, `succeeded` (of its trajectory) and, with several objects,
    `captured_any`, `succeeded_any`; the settings, and of what is asked of the future `horizon`
    [frames], `plan` ("none": it coasts), and `check`, `dwell` [s] (missing where a run has no such
    one); a column for each metric (NaN: not there yet, inf: no escape was found); `seconds` of
    computing. A seed of 64 bits makes its column text. Of beliefs, whose scores are means,
    `capture_q10`, `_q50` and `_q90` are
    quantiles over the particles. Needs the extra [tables]. Raises what ScoreStore does.
    """
    with ScoreStore(path) as store:
        return _frame(*_states(store.runs() if run is None else [store.run(run)]))


def export(path: AnyPath, output: AnyPath, *, run: int | None = None) -> int:
    """Writes the table of `load` into a .csv file, row by row, or a .parquet file; returns how many
    rows it has.

    If there are curves of probabilities, they are in a file beside it: scores-curves.csv of
    scores.csv. A row is a time of a curve: `run`, `trajectory`, `frame`, `metric`, `time` [s] from
    the frame on, and the probability of being `captured` throughout until then.

    Each file is written in one go: it is whole, or as it was. Parquet needs the extra [tables].
    Raises ValueError on another suffix.
    """
    output = Path(output)
    require_suffix("output", output, SUFFIXES)
    if not output.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(output.parent))
    write = _write_csv if output.suffix == ".csv" else _write_parquet
    with ScoreStore(path) as store:
        runs = store.runs() if run is None else [store.run(run)]
        if any(one.has_curves for one in runs):
            with replaced(curves_path(output)) as file:
                write(file, *_curves(runs))
        with replaced(output) as file:
            return write(file, *_states(runs))


def curves_path(output: AnyPath) -> Path:
    """The file into which `export` writes the curves, if there are any."""
    output = Path(output)
    return output.with_name(f"{output.stem}-curves{output.suffix}")


def _curves(runs: Sequence[Run]) -> Table:
    """The curves of some runs, below one another: a row for each time of a curve."""
    kinds: Kinds = {"run": int, "trajectory": int, "frame": int}
    kinds |= {"metric": str, "time": float, "probability": float}
    rows = (
        (run.number, trajectory, frame, metric, time, captured)
        for run in runs
        for trajectory, frame, metric, curve in run.curves()
        for time, captured in zip(*(numbers.tolist() for numbers in curve), strict=True)
    )
    return kinds, rows


def _states(runs: Sequence[Run]) -> Table:
    """Some runs of a store, below one another: a row for each state."""
    kinds: Kinds = {"run": int, "task": str, "trajectory": int, "frame": int}
    kinds |= {"captured": bool, "succeeded": bool}
    if any(run.several for run in runs):
        kinds |= {"captured_any": bool, "succeeded_any": bool}
    for name in {name: None for run in runs for name in _asked(run)}:
        kinds[name] = _widest([_asked(run).get(name) for run in runs])
    kinds |= {"algorithm": str}
    kinds |= {metric: float for run in runs for metric in run.metrics}
    spread = [metric for run in runs for metric in run.with_quantiles]
    kinds |= {name: float for metric in spread for name in _quantile_columns(metric)}
    kinds |= {"seconds": float}
    return kinds, (row for run in runs for row in _rows(run, kinds))


def _rows(run: Run, kinds: Mapping[str, type]) -> Iterator[tuple[Any, ...]]:
    values = _asked(run) | {"run": run.number, "task": run.task, "algorithm": run.algorithm}
    spread = {metric: run.quantiles(metric, QUANTILES) for metric in run.with_quantiles}
    for number, state in enumerate(run.rows()):
        values |= zip(OF_STATE, state, strict=False)
        values |= zip(run.metrics, state.scores, strict=True)
        for metric, of_states in spread.items():
            values |= zip(_quantile_columns(metric), of_states[number], strict=True)
        yield tuple(_cast(values.get(column), kind) for column, kind in kinds.items())


def _cast(value: Any, kind: type) -> Any:
    """A value as one of this type; None if there is none, or it is NaN."""
    missing = value is None or (isinstance(value, float) and math.isnan(value))
    return None if missing else kind(value)


def _quantile_columns(metric: str) -> list[str]:
    return [f"{metric}_q{round(100 * share)}" for share in QUANTILES]


def _asked(run: Run) -> dict[str, Any]:
    """The settings of a run, with what is not known of its models, and those of its future."""
    asked = run.settings | (run.sampling.all() if run.sampling is not None else {})
    if run.future is None:
        return asked
    return asked | run.future.all() | {"plan": run.future.plan or "none"}


def _write_csv(path: Path, kinds: Kinds, rows: Iterator[tuple[Any, ...]]) -> int:
    count = 0
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(kinds)
        for row in rows:
            writer.writerow(row)
            count += 1
    return count


def _write_parquet(path: Path, kinds: Kinds, rows: Iterator[tuple[Any, ...]]) -> int:
    frame = _frame(kinds, rows)
    frame.to_parquet(path, index=False)
    return len(frame)


def _frame(kinds: Kinds, rows: Iterator[tuple[Any, ...]]) -> pd.DataFrame:
    with needs_extra("a data frame, as for Parquet,", "tables"):
        import pandas as pd
    columns = list(zip(*rows, strict=True)) or [()] * len(kinds)
    series = {}
    for (name, kind), column in zip(kinds.items(), columns, strict=True):
        dtype = "Int64" if kind is int and None in column else OF_PANDAS[kind]
        series[name] = pd.Series(column, dtype=dtype)
    return pd.DataFrame(series)


def _widest(values: Sequence[Any]) -> type:
    """A type for one setting of all runs, None in those that do not have it; a whole number of more
    than 63 bits, as a seed, becomes text."""
    large = any(isinstance(value, int) and value >= 2**63 for value in values)
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and not large:
        return int if kinds == {int} else float
    return bool if kinds == {bool} else str


def export_lerobot(
    path: AnyPath, data: AnyPath, folder: AnyPath, output: AnyPath, *, run: int | None = None
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
    if folder.resolve() in output.resolve().parents:
        raise ValueError(f"output is {output}, inside of {folder}, expected another place")
    scored = [name for name in lerobot.element_places(folder) if name.startswith(PREFIX)]
    if scored:
        text = f"{folder} has {scored[0]} already, expected the dataset that was imported"
        raise ValueError(text)
    with ScoreStore(path) as store, datasets.open(data) as dataset:
        chosen = store.run(run)
        chosen.scored(dataset, str(data), str(path))
        scores = store.scores(chosen)
        named = {PREFIX + metric.replace("/", "_"): own for metric, own in scores.items()}
        episodes = _by_episode(folder, dataset, named)
    part = output.with_name(f".{output.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        shutil.copytree(folder, part)
        for file in lerobot.data_files(part):
            _add_columns(file, episodes)
        _add_features(part / INFO, named)
        os.replace(part, output)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return list(named)


def _by_episode(folder: Path, dataset: Dataset, scores: Mapping[str, Floats]) -> dict[int, Columns]:
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
            text = f"episode {number} of {folder} has other times than its trajectory"
            raise ValueError(f"{text}, expected the dataset that was imported")
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
    names, old = list(next(iter(episodes.values()))), file.with_suffix(".old")
    file.rename(old)
    with parquet.ParquetFile(old) as source:
        schema = source.schema_arrow
        for name in names:
            schema = schema.append(pyarrow.field(name, pyarrow.float32()))
        schema = schema.with_metadata(_told(schema.metadata or {}, names))
        with parquet.ParquetWriter(file, schema) as written:
            for group in range(source.num_row_groups):
                table = source.read_row_group(group)
                places = (table[name].to_pylist() for name in (lerobot.EPISODE, lerobot.FRAME))
                rows = list(zip(*places, strict=True))
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
