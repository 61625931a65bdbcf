"""Datasets of LeRobot, version 3: their episodes as recordings.

The folder has data/chunk-*/file-*.parquet, a row a frame, meta/info.json, which names the features
in them, and meta/episodes, which has the length of each episode. A feature is a number, as
"timestamp", or a vector whose elements may have names.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin.base.aliases import AnyPath, Floats
from energymargin.base.errors import needs_extra
from energymargin.base.plausibility import warn
from energymargin.records.recordings.cleaning import LooseRules, Rules, cleaned
from energymargin.records.recordings.csv_files import Columns, headers
from energymargin.records.recordings.formats import INFO, require_own_files, require_recording
from energymargin.records.recordings.recording import Recording
from energymargin.records.recordings.smoothing import usual_step
from energymargin.records.recordings.table import FileSource

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack

EPISODE, FRAME, TIME, SUCCESS = "episode_index", "frame_index", "timestamp", "next.success"
OWN = {FRAME: "frame", TIME: "time"}
MOST_OFF = 0.1  # share by which times may differ from the frames a second that are said
MOST_ELEMENTS = 10_000  # of a feature; an image's side, too
MOST_NUMBERS = 200_000_000  # that are read of a file: 1.6 GB
HINT = "Are units others (mm, deg)? columns= says so"

Place = tuple[str, int, int]
"""A feature, the place of one of its elements, and how many it has."""


def read_lerobot(
    path: AnyPath,
    columns: Columns | Mapping[str, Any] | AnyPath | None = None,
    **rules: Unpack[LooseRules],
) -> list[Recording]:
    """The episodes of a LeRobot dataset (version 3), in the order of their numbers: a recording
    each, named FOLDER:EPISODE. Needs the extra [lerobot].

    Args:
        path: its folder.
        columns: which feature is what, as of `read_csv`. An element of a vector is
            "FEATURE/NAME", or "FEATURE/0" by its place. None: elements have the names of the
            documented header, as object_x, in any feature.
        rules: as of `read_csv`.

    Raises OSError, ImportError without the extra, and ValueError that names the file: on a dataset
    of another version, or one that lacks frames, and on all that `read_csv` refuses.
    """
    require_recording(Path(path))
    layout, folder = Columns.of(columns), Path(path)
    checked = Rules(**rules).in_frame(layout.origin)
    places = element_places(folder, named=not layout.columns)
    allowed = places if layout.columns else headers(places)
    known = [name for name in places if name in allowed]
    try:
        fields = layout.places(known)
    except ValueError as error:
        raise ValueError(f"{folder / INFO}: {error}; it has {', '.join(places)}") from None
    used = {name: places[known[number]] for name, (number, _) in fields.items()}
    sizes = {name: size for name, (_, size) in fields.items()}
    found = []
    for episode, values in read_episodes(folder, used).items():
        source = FileSource(folder.with_name(f"{folder.name}:{episode}"), "frame", HINT)
        _compare_rate(source, folder, sizes["time"] * values["time"].to_numpy())
        found.append(cleaned((values * sizes).assign(**layout.constants), source, checked))
    return found


def _compare_rate(source: FileSource, folder: Path, times: Floats) -> None:
    """Warns if the times of an episode are not those of the frames a second that are said."""
    rate = json.loads((folder / INFO).read_text(encoding="utf-8")).get("fps")
    step = usual_step(times)
    told = isinstance(rate, (int, float)) and math.isfinite(rate) and rate > 0.0
    if told and 0.0 < step < math.inf and abs(step * rate - 1.0) > MOST_OFF:
        text = (
            f"{source.path}: its times are {step:.4g} s apart, {1.0 / step:.4g} frames a second, "
            f"and {INFO} says fps {rate:g}: the times hold. Which of them is right?"
        )
        warn([(str(source.path.parent), text)], text)


def read_successes(path: AnyPath) -> dict[str, bool] | None:
    """Whether each episode succeeded, by the name of its recording: whether `next.success` was ever
    true. None: the dataset does not have that. Errors as `read_lerobot`."""
    folder = Path(path)
    places = element_places(folder)
    if SUCCESS not in places:
        return None
    episodes = read_episodes(folder, {SUCCESS: places[SUCCESS]})
    return {f"{folder.name}:{number}": bool(own[SUCCESS].any()) for number, own in episodes.items()}


def element_places(folder: Path, *, named: bool = False) -> dict[str, Place]:
    """By name, where each number of a row is: "timestamp", or of a vector "FEATURE/NAME" and
    "FEATURE/0"; with `named` the names of elements alone, and frame and time.

    Raises ValueError that names the file, if the dataset is of another version.
    """
    require_own_files(folder)
    path = folder / INFO
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
        version, features = str(info["codebase_version"]), dict(info["features"])
        shapes = {name: (list(own["shape"]), own.get("names")) for name, own in features.items()}
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: {error!r}, expected that of a LeRobot dataset") from error
    if not version.startswith("v3."):
        text = f"{path}: the dataset has version {version}, expected v3"
        raise ValueError(f"{text}: LeRobot's convert_dataset_v21_to_v30 converts older ones")
    found: dict[str, Place] = {}
    for feature, (shape, names) in shapes.items():
        if not all(isinstance(size, int) and 0 <= size <= MOST_ELEMENTS for size in shape):
            text = f"{path}: {feature!r} has the shape {shape}"
            raise ValueError(f"{text}, expected whole numbers from 0 to {MOST_ELEMENTS}")
        if shape == [1]:
            found[OWN.get(feature, feature) if named else feature] = (feature, 0, 1)
        elif len(shape) == 1:
            lists = [_names(names), *([] if named else [[str(k) for k in range(shape[0])]])]
            before = "" if named else f"{feature}/"
            for listed in lists:
                found |= {f"{before}{one}": (feature, k, shape[0]) for k, one in enumerate(listed)}
    return found


def _names(names: Any) -> list[str]:
    """The names of a vector's elements, which may be in groups; empty without any."""
    groups = names.values() if isinstance(names, dict) else [names]
    return [str(one) for group in groups if isinstance(group, list) for one in group]


def data_files(folder: Path) -> list[Path]:
    """The files of a dataset's frames, in their order. Raises ValueError if there are none."""
    files = sorted((folder / "data").glob("*/*.parquet"))
    if not files:
        raise ValueError(f"{folder}: there is no data/chunk-*/file-*.parquet, expected some")
    return files


def read_episodes(folder: Path, columns: Mapping[str, Place]) -> dict[int, pd.DataFrame]:
    """These columns by episode: its frames in their order, a row each.

    Raises ValueError if an episode has another number of frames than meta/episodes says.
    """
    with needs_extra("a LeRobot dataset", "lerobot"):
        import pandas as pd
    places = {EPISODE: (EPISODE, 0, 1), FRAME: (FRAME, 0, 1), **columns}
    parts = []
    for file in data_files(folder):
        table = _table(file, sorted({feature for feature, _, _ in places.values()}))
        parts.append(pd.DataFrame({n: _numbers(file, table, *own) for n, own in places.items()}))
    frames = pd.concat(parts).sort_values([EPISODE, FRAME], kind="stable")
    groups = {int(own[EPISODE].iloc[0]): own for _, own in frames.groupby(EPISODE)}
    found = {n: own[list(columns)].reset_index(drop=True) for n, own in groups.items()}
    _require_whole(folder, {episode: len(own) for episode, own in found.items()})
    return found


def _require_whole(folder: Path, counts: Mapping[int, int]) -> None:
    """Raises ValueError unless each episode has the frames that meta/episodes says."""
    for file in sorted((folder / "meta" / "episodes").glob("*/*.parquet")):
        table = _table(file, [EPISODE, "length"])
        number, length = (_numbers(file, table, name, 0, 1) for name in (EPISODE, "length"))
        for episode, frames in zip(number.astype(int), length.astype(int), strict=True):
            if counts.get(episode, 0) != frames:
                raise ValueError(
                    f"{folder}: episode {episode} has {counts.get(episode, 0)} frames, expected "
                    f"{frames}, as meta/episodes says: is a file missing?"
                )


def _table(file: Path, columns: Sequence[str]) -> Any:
    """Some columns of a Parquet file."""
    with needs_extra("a LeRobot dataset", "lerobot"):
        from pyarrow import parquet
    try:
        with parquet.ParquetFile(file) as opened:
            groups = map(opened.metadata.row_group, range(opened.metadata.num_row_groups))
            stored = [group.column(k) for group in groups for k in range(group.num_columns)]
            asked = (one for one in stored if one.path_in_schema.partition(".")[0] in columns)
            count = sum(one.num_values for one in asked)
            if count > MOST_NUMBERS:
                raise ValueError(f"has {count} numbers, expected at most {MOST_NUMBERS} in a file")
            return opened.read(columns=list(columns))
    except ValueError as error:  # those of pyarrow are such
        raise ValueError(f"{file}: {error}") from error


def _numbers(file: Path, table: Any, feature: str, place: int, size: int) -> Floats:
    """The numbers of an element of a feature of this size, shape (R,)."""
    if feature not in table.column_names:
        raise ValueError(f"{file}: there is no column {feature!r}, expected it")
    column = table[feature].combine_chunks()
    flat = column if size == 1 else column.flatten()
    numbers = np.asarray(flat.to_numpy(zero_copy_only=False), dtype=np.float64)
    if len(numbers) != size * len(table):
        raise ValueError(f"{file}: {feature!r} has rows without its {size} numbers")
    return numbers[place::size]
