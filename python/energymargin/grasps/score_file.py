"""A file of scores of grasps: HDF5, whole at any time, and gone on with where it ended.

Its first 512 bytes, which HDF5 leaves to its users, have a checksum of all others.
"""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import h5py
import numpy as np

from energymargin.base.closing import Closing
from energymargin.base.locks import Lock
from energymargin.base.replacing import replace_bytes
from energymargin.disturbances import text_of
from energymargin.evaluate.searches import algorithm
from energymargin.grasps.scores import ARRAYS, GraspScores
from energymargin.grasps.trials import ENDINGS

SAVE = 2.0  # s between two writes
HEAD = 512  # bytes before those of HDF5


class ScoreFile(Closing):
    """The file of some scores, which is written every two seconds, and at the end of the `with`
    block, if there are new ones."""

    scores: GraspScores
    """Those that it has, or is to have."""

    def __init__(self, path: str | Path, scores: GraspScores, effort: int | None) -> None:
        """`scores`: those that there are without the file. Raises ValueError if it has the scores
        of another question, has changed or another process writes it, OSError if it cannot be read
        or written."""
        self._path, self.scores = Path(path), scores
        self._question = question(scores, effort)
        self._lock = Lock(self._path, "scoring into")
        self._saved, self._is_old = time.monotonic(), False
        try:
            if self._path.exists():
                self._read()
        except BaseException:
            self._lock.close()
            raise

    def close(self) -> None:
        """Writes what is new."""
        try:
            if self._is_old:
                self.save()
        finally:
            self._lock.close()

    def put(self, scores: GraspScores) -> None:
        """These are its scores; it is written if the last time was a while ago."""
        self.scores, self._is_old = scores, True
        if time.monotonic() - self._saved > SAVE:
            self.save()

    def save(self) -> None:
        """Writes the file: whole, or not at all."""
        scores, image = self.scores, BytesIO()
        with h5py.File(image, "w", userblock_size=HEAD) as file:
            file.attrs["energymargin"] = self._question
            file.attrs["endings"] = list(ENDINGS)
            file["names"] = np.array(scores.grasps.names, dtype=h5py.string_dtype())
            file["probabilities"], file["intervals"] = scores.probabilities, scores.interval()
            for name in ARRAYS:
                file[name] = getattr(scores, name)
            texts = [scores.errors.get(k, "") for k in range(len(scores.grasps))]
            file["errors"] = np.array(texts, dtype=h5py.string_dtype())
        content = image.getvalue()[HEAD:]
        replace_bytes(self._path, _head(content) + content)
        self._saved, self._is_old = time.monotonic(), False

    def _read(self) -> None:
        image = self._path.read_bytes()
        try:
            if image[:HEAD] != _head(image[HEAD:]):
                raise ValueError("its checksum is another")
            with h5py.File(BytesIO(image)) as file:
                asked = json.loads(str(file.attrs["energymargin"]))
                found = {name: file[name][()] for name in ARRAYS}
        except (KeyError, OSError, ValueError) as error:
            raise ValueError(
                f"store is {str(self._path)!r}, which is no file of scores of grasps as it was "
                f"written ({error}): give another name, or delete it"
            ) from error
        for name, value in json.loads(self._question).items():
            if asked.get(name) != value:
                raise ValueError(
                    f"store is {str(self._path)!r}, whose scores have another {name}: give another "
                    "name, delete it, or ask as then"
                )
        self.scores = replace(self.scores, **found)


def _head(content: bytes) -> bytes:
    """The first bytes of a file with this content."""
    return hashlib.sha256(content).hexdigest().encode().ljust(HEAD, b"\0")


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
