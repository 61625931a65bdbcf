"""What became of recordings, and of their frames, from CSV files."""

from __future__ import annotations

import os
from pathlib import Path

from energymargin.recordings.table import Source, lines_of

__all__ = ["read_frame_labels", "read_labels"]

MOST_DIGITS = 15  # of a frame's number
WORDS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


def read_labels(path: str | os.PathLike[str]) -> dict[str, bool]:
    """Whether each recording ended well, by its file's name.

    The file has the columns recording,success, where success is 1, true or yes, or 0, false or no.
    Raises OSError, and ValueError with the line that is something else or names a recording again.
    """
    source = Source(Path(path))
    labels: dict[str, bool] = {}
    for line, (name, word) in _rows(path, ("recording", "success")):
        if name in labels:
            raise source.error(f"{name!r} has a label already", line)
        labels[name] = _label(source, line, "success", word)
    return labels


def read_frame_labels(path: str | os.PathLike[str]) -> dict[str, dict[int, bool]]:
    """Whether the object was captured in each frame, by the file's name and the frame's number.

    The file has the columns recording,frame,captured. Raises as `read_labels`.
    """
    source = Source(Path(path))
    labels: dict[str, dict[int, bool]] = {}
    for line, (name, number, word) in _rows(path, ("recording", "frame", "captured")):
        of_recording = labels.setdefault(name, {})
        if not (number.isascii() and number.isdecimal() and len(number) <= MOST_DIGITS):
            raise source.error(f"frame is {number!r}, expected a whole number", line)
        if int(number) in of_recording:
            raise source.error(f"frame {number} of {name!r} has a label already", line)
        of_recording[int(number)] = _label(source, line, "captured", word)
    return labels


def _rows(path: str | os.PathLike[str], header: tuple[str, ...]) -> list[tuple[int, list[str]]]:
    """Raises ValueError on another header, and on rows that are not as long."""
    source = Source(Path(path))
    (first, names), *rows = lines_of(path)
    if tuple(names) != header:
        raise source.error(f"the header is {','.join(names)}, expected {','.join(header)}", first)
    for line, cells in rows:
        if len(cells) != len(header):
            raise source.error(f"has {len(cells)} cells, expected {len(header)}", line)
        if not cells[0]:
            raise source.error("has no name, expected that of a recording's file", line)
    if not rows:
        raise source.error("has no labels")
    return rows


def _label(source: Source, line: int, name: str, word: str) -> bool:
    if word.lower() not in WORDS:
        raise source.error(f"{name} is {word!r}, expected one of {', '.join(WORDS)}", line)
    return WORDS[word.lower()]
