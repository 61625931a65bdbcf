"""A file of scores of grasps: HDF5, whole at any time, and gone on with where it ended."""

from __future__ import annotations

import hashlib
import json
import time
from pathlib import Path

import h5py
import numpy as np

from energymargin.closing import Closing
from energymargin.disturbances import text_of
from energymargin.grasps.scores import ARRAYS, GraspScores
from energymargin.grasps.trials import ENDINGS
from energymargin.locks import Lock
from energymargin.replacing import replaced
from energymargin.searches import algorithm

SAVE = 2.0  # s between two writes


class ScoreFile(Closing):
    """The file of some scores, which it fills with what it has already. It is written every two
    seconds, and at the end of the `with` block."""

    def __init__(self, path: str | Path, scores: GraspScores, effort: int | None) -> None:
        """Raises ValueError if the file has the scores of another question or another process
        writes it, OSError if it cannot be read or written."""
        self._path, self._scores = Path(path), scores
        self._question = question(scores, effort)
        self._lock = Lock(self._path, "scoring into")
        self._saved = time.monotonic()
        try:
            if self._path.exists():
                self._read()
        except BaseException:
            self._lock.close()
            raise

    def close(self) -> None:
        """Writes what there is."""
        try:
            self.save()
        finally:
            self._lock.close()

    def save_now_and_then(self) -> None:
        """Writes the file if the last time was a while ago."""
        if time.monotonic() - self._saved > SAVE:
            self.save()

    def save(self) -> None:
        """Writes the file: whole, or not at all."""
        scores = self._scores
        with replaced(self._path) as path, h5py.File(path, "w") as file:
            file.attrs["energymargin"] = self._question
            file.attrs["endings"] = list(ENDINGS)
            file["names"] = np.array(scores.grasps.names, dtype=h5py.string_dtype())
            file["probabilities"], file["intervals"] = scores.probabilities, scores.interval()
            for name in ARRAYS:
                file[name] = getattr(scores, name)
            texts = [scores.errors.get(k, "") for k in range(len(scores.grasps))]
            file["errors"] = np.array(texts, dtype=h5py.string_dtype())
        self._saved = time.monotonic()

    def _read(self) -> None:
        try:
            with h5py.File(self._path) as file:
                asked = json.loads(str(file.attrs["energymargin"]))
                found = {name: file[name][()] for name in ARRAYS}
                errors = file["errors"].asstr()[()]
        except (KeyError, OSError, ValueError) as error:
            raise ValueError(
                f"store is {str(self._path)!r}, which is no file of scores of grasps ({error}): "
                "give another name, or delete it"
            ) from error
        for name, value in json.loads(self._question).items():
            if asked.get(name) != value:
                raise ValueError(
                    f"store is {str(self._path)!r}, whose scores have another {name}: give another "
                    "name, delete it, or ask as then"
                )
        for name, values in found.items():
            getattr(self._scores, name)[...] = values
        self._scores.errors.update({k: str(text) for k, text in enumerate(errors) if text})


def question(scores: GraspScores, effort: int | None) -> str:
    """What was asked, as JSON: the same for equal scores alone.

    Raises ValueError on a disturbance or a belief that cannot be written down.
    """
    trials, grasps = scores.trials, scores.grasps
    rows = b"".join(
        np.ascontiguousarray(one).tobytes()
        for one in (grasps.poses, grasps.openings, grasps.object_poses)
    )
    asked = {
        "algorithm": algorithm(),
        **{name: getattr(trials, name).text for name in ("hand", "object", "protocol", "belief")},
        "disturbance": text_of(trials.disturbance),
        **{name: getattr(trials, name) for name in ("colliding", "seed", "step")},
        "rollouts": scores.endings.shape[1],
        "effort": effort,
        "grasps": hashlib.sha256(rows).hexdigest(),
    }
    return json.dumps(asked)
