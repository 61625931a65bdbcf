"""Files of labels: what happened to recordings, and in each of their frames."""

from __future__ import annotations

import os
import re
from pathlib import Path

from energymargin.records.recordings.csv_files import read_cells
from energymargin.records.recordings.table import FileSource

FRAME = re.compile(r"0|[1-9][0-9]{,14}")
WORDS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


def read_labels(path: str | os.PathLike[str]) -> dict[str, bool]:
    """Whether each recording succeeded, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, ImportError without pandas, and ValueError with the line that is something else
    or names a recording again.
    """
    return {name: label for (name,), label in _labelled(path, ("recording", "success")).items()}


def read_frame_labels(path: str | os.PathLike[str]) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    labels: dict[str, dict[int, bool]] = {}
    for (name, number), label in _labelled(path, ("recording", "frame", "captured")).items():
        labels.setdefault(name, {})[int(number)] = label
    return labels


def _labelled(path: str | os.PathLike[str], header: tuple[str, ...]) -> dict[tuple[str, ...], bool]:
    """The labels of a file with this header, by what comes before them in their rows."""
    source = FileSource(Path(path))
    (first, names), *rows = read_cells(source).items()
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    labels: dict[tuple[str, ...], bool] = {}
    for line, (*key, word) in rows:
        known = key[0] and all(map(FRAME.fullmatch, key[1:])) and word.lower() in WORDS
        if not known or tuple(key) in labels:
            raise source.error(
                f"has {','.join([*key, word])!r}, expected {','.join(header)}: the name of a "
                f"recording's file, a frame's number, one of {', '.join(WORDS)}; each once",
                line,
            )
        labels[tuple(key)] = WORDS[word.lower()]
    if not labels:
        raise source.error("has no labels")
    return labels
