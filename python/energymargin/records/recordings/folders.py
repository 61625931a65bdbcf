"""Folders of recordings, which may be a stranger's: all files that are read lie in them."""

from __future__ import annotations

import os
from pathlib import Path

MOST_FILES = 1_000_000


def require_own_files(folder: Path) -> None:
    """Raises ValueError that names a link which leads out of a folder, and on too many files.

    A folder of Hugging Face's cache (snapshots/REVISION) may have links into the blobs beside it.
    """
    top, count = folder.resolve(), 0
    own = [top, *([top.parents[1] / "blobs"] if top.parent.name == "snapshots" else [])]
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(place, name)
            if path.is_symlink() and not any(path.resolve().is_relative_to(one) for one in own):
                raise ValueError(
                    f"{path} is a link to {os.readlink(path)!r}, which is not in {folder}: "
                    "expected a folder that is whole by itself; `cp -RL` makes one, if you trust it"
                )
            if not (path.is_file() or path.is_dir()):
                raise ValueError(f"{path} is neither a file nor a folder, expected one")
        count += len(files)
        if count > MOST_FILES:
            raise ValueError(f"{folder} has more than {MOST_FILES} files, expected a recording's")
