"""Where commands write: what is there already is replaced with --overwrite alone."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection
from pathlib import Path

from energymargin.base.replacing import replace_text

MARK = ".energymargin"
"""The file that marks a folder whose files a command made."""


def require_free(
    path: Path, *, overwrite: bool, option: str = "-o", suffixes: Collection[str] = ()
) -> None:
    """Raises ValueError unless a command may write this file: its name ends with one of the
    suffixes, if there are any, its folder exists, and it does not exist or is to be replaced.
    Raises OSError if nothing can be written into its folder."""
    if suffixes and path.suffix not in suffixes:
        raise ValueError(f"{option} is {path}, expected a name with {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise ValueError(f"{option} is {path}, but there is no folder {path.parent}")
    if path.is_dir():
        raise ValueError(f"{path} is a folder: choose another {option}, the name of a file")
    if os.path.lexists(path) and not overwrite:
        raise ValueError(f"{path} exists: choose another {option}, or give --overwrite")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from error


def require_own_folder(folder: Path, *, overwrite: bool) -> None:
    """Makes and marks the folder of a command that goes on with what it has made there.

    Raises ValueError if it has files that no such command made, unless they may be replaced.
    """
    mark = folder / MARK
    files = folder.is_dir() and any(not path.is_dir() for path in folder.iterdir())
    if files and not (overwrite or mark.exists()):
        raise ValueError(
            f"{folder} has files of others: choose another -o, or give --overwrite, which replaces "
            "those of the same names"
        )
    folder.mkdir(parents=True, exist_ok=True)
    replace_text(mark, "A command of energymargin made this folder, and goes on with its files.\n")


def dataset_of(scores: Path, data: Path | None) -> Path:
    """The dataset that is given, or the one beside its scores: push.h5 of push-scores.db."""
    return data or scores.with_name(f"{scores.stem.removesuffix('-scores')}.h5")
