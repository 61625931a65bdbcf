"""A store's scores as a table: a data frame, CSV, or Parquet. One row is a state of a run.

The curves of probabilities are a table of their own: a row is a time of a curve.
"""

from __future__ import annotations

import csv
import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin.replacing import replaced
from energymargin.store.file import ScoreStore
from energymargin.store.run import Run

if TYPE_CHECKING:
    import pandas as pd

SUFFIXES = (".csv", ".parquet")
QUANTILES = (0.1, 0.5, 0.9)  # of the particles of a belief


def load(path: str | os.PathLike[str], *, run: int | None = None) -> pd.DataFrame:
    """All scores of a store, or those of one run, with the states' labels and the settings.

    A row is a state of a run: its `run`, `task`, `trajectory`, `frame`; the labels `captured`,
    `succeeded` (of its trajectory) and, with several objects, `captured_any`, `succeeded_any`; the
    settings, and of what is asked of the future `horizon` [frames], `plan` ("none": it coasts), and
    `check`, `dwell` [s] (missing where a run has no such one); a column for each metric (NaN: not
    there yet, inf: no escape was found); `seconds` of computing. A seed of 64 bits makes its column
    text. Of beliefs, whose scores are means, `capture_q10`, `_q50` and `_q90` are
    quantiles over the particles. Needs the extra [tables]. Raises what ScoreStore does.
    """
    with ScoreStore(path) as store:
        return _frame(_states(_runs(store, run)))


def export(
    path: str | os.PathLike[str], output: str | os.PathLike[str], *, run: int | None = None
) -> int:
    """Writes the table of `load` into a .csv file, row by row, or a .parquet file; returns how many
    rows it has.

    If there are curves of probabilities, they are in a file beside it: scores-curves.csv of
    scores.csv. A row is a time of a curve: `run`, `trajectory`, `frame`, `metric`, `time` [s] from
    the frame on, and the probability of being `captured` throughout until then.

    Each file is written in one go: it is whole, or as it was. Parquet needs the extra [tables].
    Raises ValueError on another suffix.
    """
    output = Path(output)
    if output.suffix not in SUFFIXES:
        raise ValueError(f"output is {str(output)!r}, expected a name with {' or '.join(SUFFIXES)}")
    if not output.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(output.parent))
    write = _write_csv if output.suffix == ".csv" else _write_parquet
    with ScoreStore(path) as store:
        runs = _runs(store, run)
        if any(one.has_curves for one in runs):
            with replaced(curves_path(output)) as file:
                write(_curves(runs), file)
        with replaced(output) as file:
            return write(_states(runs), file)


def curves_path(output: str | os.PathLike[str]) -> Path:
    """The file into which `export` writes the curves, if there are any."""
    output = Path(output)
    return output.with_name(f"{output.stem}-curves{output.suffix}")


@dataclass(frozen=True, eq=False)
class _Table:
    """Columns with the types of their values, and rows: a value for each column, None where there
    is none."""

    kinds: dict[str, type]
    rows: Iterator[tuple[Any, ...]]


def _curves(runs: Sequence[Run]) -> _Table:
    """The curves of some runs, below one another: a row for each time of a curve."""
    kinds: dict[str, type] = {"run": int, "trajectory": int, "frame": int}
    kinds |= {"metric": str, "time": float, "probability": float}
    rows = (
        (run.number, trajectory, frame, metric, time, captured)
        for run in runs
        for trajectory, frame, metric, curve in run.curves()
        for time, captured in zip(*(numbers.tolist() for numbers in curve), strict=True)
    )
    return _Table(kinds, rows)


def _states(runs: Sequence[Run]) -> _Table:
    """Some runs of a store, below one another: a row for each state."""
    kinds: dict[str, type] = {"run": int, "task": str, "trajectory": int, "frame": int}
    kinds |= {"captured": bool, "succeeded": bool}
    if any(run.several for run in runs):
        kinds |= {"captured_any": bool, "succeeded_any": bool}
    for name in {name: None for run in runs for name in _asked(run)}:
        kinds[name] = _widest([_kind(_asked(run).get(name)) for run in runs])
    kinds |= {"algorithm": str}
    kinds |= {metric: float for run in runs for metric in run.metrics}
    spread = [metric for run in runs for metric in run.with_quantiles]
    kinds |= {name: float for metric in spread for name in _quantile_columns(metric)}
    kinds |= {"seconds": float}
    return _Table(kinds, (row for run in runs for row in _rows(run, kinds)))


def _rows(run: Run, kinds: Mapping[str, type]) -> Iterator[tuple[Any, ...]]:
    of_run = {"run": run.number, "task": run.task, "algorithm": run.algorithm}
    of_run |= {n: None if v is None else kinds[n](v) for n, v in _asked(run).items()}
    spread = {metric: run.quantiles(metric, QUANTILES) for metric in run.with_quantiles}
    for number, state in enumerate(run.rows()):
        values = of_run | dict(zip(run.metrics, state.scores, strict=True))
        values |= {
            "trajectory": state.trajectory,
            "frame": state.frame,
            "captured": bool(state.captured),
            "succeeded": bool(state.success),
            "captured_any": _flag(state.captured_any),
            "succeeded_any": _flag(state.success_any),
            "seconds": state.seconds,
        }
        for metric, of_states in spread.items():
            found = [None if np.isnan(q) else float(q) for q in of_states[number]]
            values |= zip(_quantile_columns(metric), found, strict=True)
        yield tuple(values.get(column) for column in kinds)


def _quantile_columns(metric: str) -> list[str]:
    return [f"{metric}_q{round(100 * share)}" for share in QUANTILES]


def _asked(run: Run) -> dict[str, Any]:
    """The settings of a run, with what is not known of its models, and those of its future."""
    asked = run.settings | (run.sampling.all() if run.sampling is not None else {})
    if run.future is None:
        return asked
    return asked | run.future.all() | {"plan": run.future.plan or "none"}


def _write_csv(table: _Table, path: Path) -> int:
    count = 0
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table.kinds)
        for row in table.rows:
            writer.writerow(row)
            count += 1
    return count


def _write_parquet(table: _Table, path: Path) -> int:
    frame = _frame(table)
    frame.to_parquet(path, index=False)
    return len(frame)


_OF_PANDAS = {int: "int64", bool: "boolean", float: "float64", str: "str"}


def _frame(table: _Table) -> pd.DataFrame:
    try:
        import pandas as pd
    except ImportError:
        raise ImportError(
            "data frames and Parquet need pandas: pip install 'energymargin[tables]'"
        ) from None
    columns = list(zip(*table.rows, strict=True)) or [()] * len(table.kinds)
    return pd.DataFrame(
        {
            name: pd.Series(column, dtype=_of_pandas(kind, column))
            for (name, kind), column in zip(table.kinds.items(), columns, strict=True)
        }
    )


def _of_pandas(kind: type, column: Sequence[Any]) -> str:
    """The pandas type of a column; plain int64 has no missing values."""
    return "Int64" if kind is int and None in column else _OF_PANDAS[kind]


def _runs(store: ScoreStore, number: int | None) -> list[Run]:
    return store.runs() if number is None else [store.run(number)]


def _kind(value: Any) -> type | None:
    """The type of a setting; a whole number of more than 63 bits, as a seed, becomes text."""
    if value is None:
        return None
    if isinstance(value, int) and value >= 2**63:
        return str
    return next((kind for kind in (bool, int, float) if isinstance(value, kind)), str)


def _widest(kinds: Sequence[type | None]) -> type:
    """A type for one setting in all runs; None is a run that does not have the setting."""
    there = {kind for kind in kinds if kind is not None}
    if not there:
        return float
    if len(there) == 1:
        return there.pop()
    return float if there == {int, float} else str


def _flag(label: int | None) -> bool | None:
    return None if label is None else bool(label)
