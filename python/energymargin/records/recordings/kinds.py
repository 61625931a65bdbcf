"""Which kind of recording a path is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from energymargin.records.recordings import bags
from energymargin.records.recordings.lerobot import INFO

Kind = Literal["csv", "bag", "lerobot"]


def kind_of(path: str | os.PathLike[str]) -> Kind:
    """Who reads it: `read_lerobot` the folder of a LeRobot dataset, `read_bag` any other folder and
    what has a bag's suffix, `read_csv` the rest."""
    if (Path(path) / INFO).is_file():
        return "lerobot"
    return "bag" if Path(path).suffix.lower() in bags.SUFFIXES or Path(path).is_dir() else "csv"
